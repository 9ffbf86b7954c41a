"""Runs axe-core on a page of the console, dark with all rules; or in a theme of choice.

All rules apply once at each size. A theme changes colours alone, so other themes there are checked for contrast. The
long tier looks at each state of a page again: light, at the size of a tablet.

The script comes from the console's development packages. It is evaluated through the browser's debugger, which the
tower's Content-Security-Policy does not stop. With CONSOLE_PICTURES=FOLDER each check also saves a screenshot.
"""

import json
import os
from pathlib import Path
from typing import Any, Final, Literal

from console_page import ConsolePage
from playwright.sync_api import Page, expect
from worlds.processes import CHECKOUT
from worlds.tiers import is_long

AXE: Final = CHECKOUT / "web" / "node_modules" / "axe-core" / "axe.min.js"
GRAVE: Final = ("serious", "critical")
Theme = Literal["dark", "light", "contrast"]
THEMES: Final[tuple[Theme, ...]] = ("dark", "light", "contrast")
_DARK: Final[tuple[Theme, int, int]] = ("dark", 1440, 900)
CHECKS: Final[tuple[tuple[Theme, int, int], ...]] = (_DARK, ("light", 1024, 768)) if is_long() else (_DARK,)

CONTRAST: Final = ["color-contrast"]

RUN: Final = """async (rules) => {
  const GRAVE = %s;
  // What a modal dialog covers was looked at before it opened, and cannot be reached now.
  // The flight bar stays usable beside it.
  const dialog = document.querySelector('[role=dialog]');
  const bar = document.querySelector('#beside-dialogs');
  const looked = dialog ? { include: [dialog, bar].filter(Boolean) } : document;
  // A rule has one impact: those of which no finding counts here are a fifth of the work.
  const counts = ({ enabled, impact }) => enabled && GRAVE.includes(impact);
  const { violations } = await axe.run(looked, {
    runOnly: rules ?? axe._audit.rules.filter(counts).map(({ id }) => id),
    resultTypes: ['violations'],
    preload: false,
    elementRef: false,
  });
  return violations.map(({ id, impact, help, nodes }) => ({
    id, impact, help, nodes: nodes.map(({ target, failureSummary }) => `${target.join(' ')}: ${failureSummary}`),
  }));
}""".replace("%s", json.dumps(GRAVE))


def use_theme(page: Page, theme: Theme) -> None:
    """As the system of the user asks for it."""
    page.emulate_media(
        color_scheme="dark" if theme == "dark" else "light",
        contrast="more" if theme == "contrast" else "no-preference",
        reduced_motion="reduce",
    )
    expect(page.locator(f"html[data-theme={theme}]")).to_have_count(1)


class Axe:
    """Checks one page after another and collects the findings."""

    def __init__(self) -> None:
        self._script = AXE.read_text()
        self._pictures = os.environ.get("CONSOLE_PICTURES")
        self._looked_at = ("", "")
        """State and size of the page at the last look."""
        self.faults: list[str] = []

    def look(self, console: ConsolePage, state: str) -> None:
        for theme, width, height in CHECKS:
            console.page.set_viewport_size({"width": width, "height": height})
            self.look_in(console, theme, state)

    def look_in(self, console: ConsolePage, theme: Theme, state: str) -> None:
        page = console.page
        use_theme(page, theme)
        if not page.evaluate("'axe' in window"):
            page.evaluate(self._script)
        if self._pictures:
            page.screenshot(path=Path(self._pictures) / f"{state}-{theme}.png")
        looks_at, looked_at = (state, str(page.viewport_size)), self._looked_at
        self._looked_at = looks_at
        found: list[dict[str, Any]] = page.evaluate(RUN, CONTRAST if looks_at == looked_at else None)
        self.faults += [
            f"{state} ({theme}): {one['impact']} {one['id']}: {one['help']}: {json.dumps(one['nodes'], indent=1)}"
            for one in found
            if one["impact"] in GRAVE
        ]

    def look_beneath(self, console: ConsolePage, opener: str, state: str) -> None:
        """Checks the menu or dialog that a button opens. Escape must close it and return the focus."""
        button = console.part(opener)
        button.click()
        opened = console.page.locator("[role=dialog], [role=menu]")
        expect(opened).to_be_visible()
        self.look(console, state)
        console.page.keyboard.press("Escape")
        expect(opened).to_have_count(0)
        expect(button).to_be_focused()
