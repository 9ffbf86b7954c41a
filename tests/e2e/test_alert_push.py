"""Alerts in a closed console: a browser subscribes, the tower pushes, and the service worker shows it.

A headless browser reaches no push service, so the page gets a subscription at a server of this test, with real keys.
What that server receives is decrypted with them and handed to the service worker, as the browser would.
"""

import json
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any

import pytest
from console_page import FLAGS, TOURED, ConsolePage
from playwright.sync_api import BrowserContext, CDPSession, expect, sync_playwright
from worlds.processes import World
from worlds.push_browser import PushBrowser, unpadded, vapid_claims

SUBSCRIBED = """
({ endpoint, keys }) => {
  const KEY = 'test.subscription';
  class Subscription {
    endpoint = endpoint;
    toJSON() { return { endpoint, expirationTime: null, keys }; }
    async unsubscribe() { localStorage.removeItem(KEY); return true; }
  }
  PushManager.prototype.subscribe = async (options) => {
    localStorage.setItem(KEY, JSON.stringify([...new Uint8Array(options.applicationServerKey)]));
    return new Subscription();
  };
  PushManager.prototype.getSubscription = async () => (localStorage.getItem(KEY) ? new Subscription() : null);
}
"""


@dataclass
class PushService:
    browser: PushBrowser = field(default_factory=PushBrowser)
    origin: str = ""
    plain: list[str] = field(default_factory=list)
    headers: list[dict[str, str]] = field(default_factory=list)
    status: int = 201


@contextmanager
def push_service() -> Iterator[PushService]:
    service = PushService()

    class Push(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers["Content-Length"]))
            service.headers.append({name.lower(): value for name, value in self.headers.items()})
            service.plain.append(service.browser.decrypt(body).decode())
            self.send_response(service.status)
            self.send_header("Content-Length", "0")
            self.end_headers()

        def log_message(self, format: str, *args: object) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Push) as server:
        service.origin = f"http://127.0.0.1:{server.server_address[1]}"
        Thread(target=server.serve_forever, daemon=True).start()
        yield service
        server.shutdown()


@pytest.fixture
def profile(modest_chromium: Path, console: Path, tmp_path: Path) -> Iterator[BrowserContext]:
    """A browser profile on disk: a private window has no web push."""
    expect.set_options(timeout=20_000)
    with sync_playwright() as playwright:
        context = playwright.chromium.launch_persistent_context(
            tmp_path / "profile",
            executable_path=modest_chromium,
            args=list(FLAGS),
            viewport={"width": 1280, "height": 800},
            reduced_motion="reduce",
        )
        context.add_init_script(TOURED)
        yield context
        context.close()


class ServiceWorkers:
    """The browser's numbers of service workers, by their scope; and which of them are activated."""

    def __init__(self, session: CDPSession) -> None:
        self._session = session
        self.numbers: dict[str, str] = {}
        self.activated: set[str] = set()
        self.errors: list[str] = []
        session.on("ServiceWorker.workerRegistrationUpdated", self._updated)
        session.on("ServiceWorker.workerVersionUpdated", self._versions_updated)
        session.on("ServiceWorker.workerErrorReported", lambda event: self.errors.append(str(event["errorMessage"])))
        session.send("ServiceWorker.enable")

    def _updated(self, event: dict[str, Any]) -> None:
        self.numbers |= {one["scopeURL"]: one["registrationId"] for one in event["registrations"]}

    def _versions_updated(self, event: dict[str, Any]) -> None:
        self.activated |= {one["registrationId"] for one in event["versions"] if one["status"] == "activated"}

    def deliver(self, address: str, text: str) -> None:
        """As if it came from the push service."""
        number = self.numbers[f"{address}/"]
        message = {"origin": address, "registrationId": number, "data": text}
        self._session.send("ServiceWorker.deliverPushMessage", message)


def notifications(console: ConsolePage) -> list[dict[str, Any]]:
    shown: list[dict[str, Any]] = console.page.evaluate(
        """async () => {
          const all = await (await navigator.serviceWorker.ready).getNotifications();
          return all.map(({ title, body, tag, data }) => ({ title, body, tag, path: data.path }));
        }"""
    )
    return shown


def test_a_browser_shows_what_the_tower_pushes(
    profile: BrowserContext, tmp_path: Path, prepared_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "world"
    shutil.copytree(prepared_folder, folder)
    monkeypatch.setenv("TOWER_WEBHOOKS_MAY_BE_PRIVATE", "yes")
    with push_service() as service, World(folder, prepared=True) as world:
        world.start_tower()
        profile.grant_permissions(["notifications"], origin=world.address)
        subscription = {"endpoint": f"{service.origin}/of/alice", "keys": service.browser.keys}
        profile.add_init_script(f"({SUBSCRIBED})({json.dumps(subscription)})")
        console = ConsolePage(profile.new_page(), world.address)
        console.open()
        console.sign_in("alice")
        expect(console.part("squad-row").first).to_be_visible()
        workers = ServiceWorkers(profile.new_cdp_session(console.page))
        console.wait("the service worker", lambda: workers.numbers.get(f"{world.address}/") in workers.activated)
        arrives = partial(workers.deliver, world.address)

        console.open("/#/account/alerts")
        state, row = console.part("this-browser-state"), console.part("channels").get_by_role("row")
        expect(state).to_contain_text("It can show your alerts")
        console.part("this-browser-choose").click()
        console.part("this-browser-severity").select_option("critical")
        console.part("this-browser-on").click()
        expect(state).to_contain_text("It shows your alerts")
        expect(row.filter(has_text="Chromium or Chrome on Linux")).to_contain_text("critical only")
        expect(console.part("channels")).not_to_contain_text("of/alice")

        # The test goes through the tower, the push service and the service worker.
        console.part("this-browser-test").click()
        console.wait("the test", lambda: len(service.plain) == 1)
        key = console.page.evaluate("localStorage.getItem('test.subscription')")
        claims = vapid_claims(service.headers[0]["authorization"], unpadded(bytes(json.loads(key))))
        assert claims["aud"] == service.origin
        arrives(service.plain[0])
        console.wait("the notification", lambda: len(notifications(console)) == 1)
        (shown,) = notifications(console)
        assert (shown["title"], shown["path"]) == ("A test of your alerts", "#/account/alerts")

        # An alert is replaced by its end; what cannot be read is shown all the same.
        alert = {"title": "Kestrel: Lost in the air", "body": "Critical: Kestrel is lost.", "severity": "critical"}
        alert |= {"happening": "opened", "tag": "alert-7", "path": "#/drone/1"}
        arrives(json.dumps(alert))
        console.wait("the alert", lambda: "alert-7" in {one["tag"] for one in notifications(console)})
        arrives(json.dumps(alert | {"title": "Over: Kestrel: Lost in the air", "happening": "closed"}))
        console.wait("its end", lambda: "Over: Kestrel: Lost in the air" in titles(console))
        assert "Kestrel: Lost in the air" not in titles(console)
        arrives("not ours")
        console.wait("words", lambda: "Control Tower" in titles(console))

        # A reload finds the subscription again; the sign-out ends it at the tower and in the browser.
        with console.page.expect_response(lambda answer: answer.url.endswith("/keep")):
            console.page.reload()
        expect(state).to_contain_text("It shows your alerts")
        console.part("user-menu").click()
        console.part("sign-out").click()
        expect(console.part("sign-in-name")).to_be_visible()
        console.sign_in("alice")
        console.open("/#/account/alerts")
        expect(state).to_contain_text("It can show your alerts")
        expect(row.filter(has_text="Chromium")).to_have_count(0)
        kept = "localStorage.getItem('test.subscription')"
        console.wait("the browser's end", lambda: console.page.evaluate(kept) is None)

        # Once more, and turned off by hand.
        console.part("this-browser-choose").click()
        console.part("this-browser-on").click()
        expect(state).to_contain_text("It shows your alerts")
        service.status = 410
        console.part("this-browser-test").click()
        expect(console.part("this-browser-problem")).to_contain_text("the browser has ended its subscription")
        expect(state).to_contain_text("It can show your alerts")
        service.status = 201
        console.part("this-browser-choose").click()
        console.part("this-browser-on").click()
        console.part("this-browser-off").click()
        expect(state).to_contain_text("It can show your alerts")
        expect(row.filter(has_text="Chromium")).to_have_count(0)
        assert [said for said in console.complaints if "401" not in said] == []


def titles(console: ConsolePage) -> set[str]:
    return {one["title"] for one in notifications(console)}
