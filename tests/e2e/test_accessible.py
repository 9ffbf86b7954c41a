"""No page has a fault that axe-core calls serious or critical, in the dark and in the light theme."""

from pathlib import Path
from typing import Any, Final

import pytest
from console_page import ConsolePage, Somebody, signed_in
from playwright.sync_api import expect
from worlds.processes import CHECKOUT

AXE: Final = Path(CHECKOUT) / "web" / "node_modules" / "axe-core" / "axe.min.js"
ACCOUNT: Final = ("password", "second-factor", "sessions", "tokens")
ADMIN: Final = ("users", "drones", "enrolment", "sessions", "tokens", "audit", "system")
PAGES: Final = ("/#/", "/#/drone/1", *(f"/#/account/{one}" for one in ACCOUNT), *(f"/#/admin/{one}" for one in ADMIN))


def faults(console: ConsolePage) -> list[str]:
    """What axe-core finds, as one line for each element."""
    page = console.page
    # By the debugger and not as a script of the page, which the policy forbids.
    page.evaluate(AXE.read_text())
    found: list[dict[str, Any]] = page.evaluate("async () => (await axe.run(document)).violations")
    return [
        f"{one['impact']} {one['id']}: {node['html'][:160]}"
        for one in found
        if one["impact"] in {"serious", "critical"}
        for node in one["nodes"]
    ]


def choose_theme(console: ConsolePage, theme: str) -> None:
    console.page.evaluate(f"localStorage.setItem('tower.preferences', JSON.stringify({{theme: '{theme}'}}))")
    console.page.reload()


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_no_page_has_a_serious_fault(somebody_early: Somebody, theme: str) -> None:
    visitor = somebody_early()
    choose_theme(visitor, theme)
    expect(visitor.part("sign-in-name")).to_be_visible()
    found = {"sign-in": faults(visitor)}
    admin = signed_in(somebody_early, "admin")
    choose_theme(admin, theme)
    for path in PAGES:
        admin.open(path)
        expect(admin.part("connection-state")).to_have_attribute("data-value", "open")
        expect(admin.page.locator("main").first).to_be_visible()
        expect(admin.page.get_by_text("Reading…")).to_have_count(0)
        found[path] = faults(admin)
    assert {page: lines for page, lines in found.items() if lines} == {}
