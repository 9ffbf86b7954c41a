"""A user adds, tries and deletes the ways by which alerts reach them, in the browser; with real servers on loopback."""

import re
import shutil
import socketserver
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from email import message_from_bytes
from email.message import Message
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread

import pytest
from console_page import visitors
from playwright.sync_api import Browser, expect
from worlds.processes import World


@dataclass
class Inbox:
    mails: list[Message] = field(default_factory=list)
    calls: list[dict[str, str]] = field(default_factory=list)


@contextmanager
def served(server: socketserver.TCPServer) -> Iterator[int]:
    with server:
        Thread(target=server.serve_forever, daemon=True).start()
        yield server.server_address[1]
        server.shutdown()


@contextmanager
def mail_server(inbox: Inbox) -> Iterator[int]:
    class Mail(socketserver.StreamRequestHandler):
        def handle(self) -> None:
            self.wfile.write(b"220 here\r\n")
            while line := self.rfile.readline():
                verb = line[:4].upper()
                if verb == b"DATA":
                    self.wfile.write(b"354 go on\r\n")
                    text = b""
                    while (one := self.rfile.readline()) != b".\r\n":
                        text += one
                    inbox.mails.append(message_from_bytes(text))
                self.wfile.write(b"250 well\r\n")  # also to QUIT, which most servers answer with 221
                if verb == b"QUIT":
                    return

    with served(socketserver.ThreadingTCPServer(("127.0.0.1", 0), Mail)) as port:
        yield port


@contextmanager
def webhook(inbox: Inbox) -> Iterator[int]:
    class Hook(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            self.rfile.read(int(self.headers["Content-Length"]))
            inbox.calls.append({name.lower(): value for name, value in self.headers.items()})
            self.send_response(204)
            self.end_headers()

        def log_message(self, format: str, *args: object) -> None:
            pass

    with served(ThreadingHTTPServer(("127.0.0.1", 0), Hook)) as port:
        yield port


def test_channels_are_added_tried_and_deleted(
    chromium: Browser, tmp_path: Path, prepared_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    inbox = Inbox()
    shutil.copytree(prepared_folder, tmp_path, dirs_exist_ok=True)
    with mail_server(inbox) as mail_port, webhook(inbox) as hook_port:
        monkeypatch.setenv("TOWER_MAIL_SERVER", f"smtp+plain://127.0.0.1:{mail_port}")
        monkeypatch.setenv("TOWER_MAIL_FROM", "tower@example.org")
        monkeypatch.setenv("TOWER_WEBHOOKS_MAY_BE_PRIVATE", "yes")
        with World(tmp_path, prepared=True) as world:
            world.start_tower()
            with visitors(chromium, world.address) as come:
                console = come()
                console.sign_in("alice")
                console.open("/#/account/alerts")
                row = console.part("channels").get_by_role("row")

                console.part("new-channel").click()
                console.part("channel-target").fill("alice@example.org")
                console.part("channel-severity").select_option("critical")
                console.part("channel-add").click()
                console.part("channel-code").fill("WRONG123")
                console.part("channel-confirm").click()
                expect(console.part("channel-dialog").get_by_role("alert")).to_be_visible()
                code = re.search(r"(?m)^    (\w{8})\s*$", str(inbox.mails[0].get_payload()))
                assert code is not None
                assert inbox.mails[0]["To"] == "alice@example.org"
                console.part("channel-code").fill(code[1])
                console.part("channel-confirm").click()
                expect(row.filter(has_text="alice@example.org")).to_contain_text("critical only")

                console.part("new-channel").click()
                console.part("channel-kind").select_option("webhook")
                console.part("channel-target").fill(f"http://127.0.0.1:{hook_port}/alerts?key=secret")
                console.part("channel-add").click()
                expect(console.part("channel-secret")).to_be_visible()
                console.page.get_by_role("button", name="Done").click()
                hook = row.filter(has_text=f"127.0.0.1:{hook_port}")
                expect(hook).not_to_contain_text("secret")

                hook.get_by_test_id("channel-test").click()
                expect(hook.get_by_test_id("channel-state")).to_have_text("works")
                (call,) = inbox.calls
                assert any("signature" in name for name in call), call
                row.filter(has_text="alice@example.org").get_by_test_id("channel-test").click()
                console.wait("the mail", lambda: len(inbox.mails) == 2)
                assert inbox.mails[1]["Subject"] == "A test of your alerts"

                hook.get_by_test_id("channel-delete").click()
                console.page.get_by_role("button", name="Delete the channel").click()
                expect(hook).to_have_count(0)
                console.page.reload()
                expect(row.filter(has_text="alice@example.org").get_by_test_id("channel-state")).to_have_text("works")
                expect(hook).to_have_count(0)
