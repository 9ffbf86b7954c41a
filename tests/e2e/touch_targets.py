"""Measures what is pressed: whether it is as large as a finger, and nothing else lies over it."""

from typing import Final

from console_page import ConsolePage
from playwright.sync_api import ViewportSize

PHONE: Final[ViewportSize] = {"width": 390, "height": 844}
TARGET_PX: Final = 44

SMALL: Final = """(least) => {
  const TARGETS = 'a[href], button, input, select, textarea, summary, [role=tab], [role=menuitem], [role=option]';
  // Rows of half pixels are rounded.
  const small = ({ width, height }) => width < least - 0.5 || height < least - 0.5;
  return [...document.querySelectorAll(TARGETS)]
    .filter((one) => one.getClientRects().length > 0 && getComputedStyle(one).visibility !== 'hidden')
    // The label of a field is part of its target; a link within a sentence is read, and is as high as its line.
    .filter((one) => !one.matches('p a'))
    // Nobody sees it, and its label or a button stands for it.
    .filter((one) => !one.matches('.visually-hidden') || one.closest('label'))
    .filter((one) => {
      const label = one.matches('input[type=checkbox], input[type=radio], input[type=file]') && one.closest('label');
      return small((label || one).getBoundingClientRect());
    })
    .map((one) => {
      const { width, height } = one.getBoundingClientRect();
      const words = one.dataset.testid ?? one.getAttribute('aria-label') ?? one.textContent.trim().slice(0, 30);
      return `${one.tagName.toLowerCase()} ${words}: ${Math.round(width)} x ${Math.round(height)}`;
    });
}"""

COVERED: Final = """() => {
  const TARGETS = 'a[href], button, input, select, summary';
  const parts = [0.25, 0.75];
  // What is scrolled passes below the flight bar.
  const isScrolled = (one) => one !== null && (one.scrollTop > 0 || isScrolled(one.parentElement));
  const isPassing = (one, other) => isScrolled(one) && other.closest('[aria-label="Flight bar"]');
  // Somebody opened the card or a dialog over the map, and closes it.
  const isOfCard = (other) => other.closest('[data-testid="drone-card"], [role=dialog]');
  return [...document.querySelectorAll('[data-testid=map] :is(button, a[href])')]
    .filter((one) => one.getClientRects().length > 0)
    .flatMap((one) => {
      const { left, top, width, height } = one.getBoundingClientRect();
      const over = parts.flatMap((x) => parts.map((y) => [left + width * x, top + height * y]))
        .map(([x, y]) => document.elementFromPoint(x, y)?.closest(TARGETS))
        .find((other) => other && other !== one && !one.contains(other) && !isPassing(one, other) && !isOfCard(other));
      const words = (of) => of.getAttribute('aria-label') ?? of.textContent.trim();
      return over ? [`${words(over)} lies over ${words(one)}`] : [];
    });
}"""


class Measured:
    """Measures one state of a page after another, on a phone, and collects what is too small, covered, or too wide."""

    def __init__(self, console: ConsolePage) -> None:
        self._page = console.page
        self.faults: list[str] = []
        self._page.set_viewport_size(PHONE)

    def look(self, state: str) -> None:
        self.faults += [f"{state}: {one}" for one in self._page.evaluate(SMALL, TARGET_PX)]
        self.faults += [f"{state}: {one}" for one in self._page.evaluate(COVERED)]
        wide = self._page.evaluate("document.documentElement.scrollWidth")
        if wide > PHONE["width"]:
            self.faults.append(f"{state}: the page is {wide} px wide")
