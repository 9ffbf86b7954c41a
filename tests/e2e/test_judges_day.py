"""From `make run` to a dropped payload in the console, as docs/how-to/challenge.md counts the clicks."""

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pytest
from console_page import ConsolePage, visitors
from playwright.sync_api import Browser, Locator, expect
from worlds.controllers import run_first
from worlds.free_ports import free_tcp_port, free_udp_ports
from worlds.processes import CHECKOUT, wait_for

pytestmark = pytest.mark.long("a demonstration; its parts have tests of their own")

OWN_PASSWORD: Final = "nine clicks to a payload"
TRIES: Final = 4
"""An autopilot that gets no processor for seconds does not answer: the person starts again."""
FLIES_WITHIN_S: Final = 400.0
LANDED: Final = re.compile(r"Payload landed at (-?[\d.]+),(-?[\d.]+)")


@pytest.fixture
def demonstration(tmp_path: Path) -> Iterator[tuple[str, Path]]:
    """`make run` with one drone: its address, and its folder."""
    var, said = tmp_path / "var", tmp_path / "said"
    environment = os.environ | {
        "TOWER_VAR": str(var),
        "TOWER_PORT": str(free_tcp_port()),
        "TOWER_UDP_PORT": str(free_udp_ports(1)[0]),
        "SQUAD": "1",
        "SQUAD_MODEL": "exact",
    }
    command = [sys.executable, str(CHECKOUT / "deploy" / "run_local.py")]
    with said.open("wb") as out:
        process = subprocess.Popen(
            command, env=environment, stdout=out, stderr=subprocess.STDOUT, start_new_session=True
        )
    try:

        def address() -> str | None:
            text = said.read_text()
            assert process.poll() is None, text
            return text.split("is running at", 1)[1].split()[0] if "Ctrl-C ends it all" in text else None

        running_at = wait_for("make run", address, timeout_s=240.0)
        run_first(process.pid)
        yield running_at, var
    finally:
        os.killpg(process.pid, signal.SIGINT)
        process.wait(30)


class Counted:
    """Clicks, counted."""

    def __init__(self, console: ConsolePage) -> None:
        self.console = console
        self.clicks = 0

    def click(self, what: Locator | str) -> None:
        self.clicks += 1
        (self.console.part(what) if isinstance(what, str) else what).click()


def test_nine_clicks_lead_to_a_dropped_payload(demonstration: tuple[str, Path], chromium: Browser) -> None:
    address, var = demonstration
    first_password = json.loads((var / "squad.json").read_text())["first_passwords"]["alice"]
    with visitors(chromium, address) as somebody:
        alice = somebody(is_first=True)
        page, hand = alice.page, Counted(alice)
        page.get_by_label("Name").fill("alice")
        page.get_by_label("Password").fill(first_password)
        hand.click(page.get_by_role("button", name="Sign in", exact=True))
        alice.part("old-password").fill(first_password)
        alice.part("new-password").fill(OWN_PASSWORD)
        alice.part("new-password-again").fill(OWN_PASSWORD)
        hand.click("change-password")
        hand.click(page.get_by_role("link", name="Open Kestrel"))
        hand.click("control-acquire")
        hand.click(alice.part("controllers").locator("summary"))
        hand.clicks += 1  # the choice
        alice.part("controller-name").select_option("challenge")
        expect(alice.part("setting-search_height_m")).to_have_value("10")
        hand.click("controller-take-off")
        start, clicks = alice.part("controller-start"), 0
        for _ in range(TRIES):
            expect(start).to_be_enabled()
            hand.click(start)
            hand.click("confirm-button")
            clicks = clicks or hand.clicks
            expect(alice.part("controller-running")).to_be_visible()
            alice.wait("its end", lambda: alice.part("controller-running").count() == 0, timeout_s=FLIES_WITHIN_S)
            words = alice.part("controller-end").inner_text()
            if "has landed it" in words:
                break
            assert re.search("no answer|arming|hangs|did not start in time", words), words
            alice.part("controller-name").select_option("challenge")
            alice.part("controller-take-off").check()
        assert "has landed it" in words
        assert clicks == 9
        expect(alice.part("finding").first).to_contain_text("Target")
    assert LANDED.search((var / "log" / "simulator.log").read_text()), "no payload landed"
