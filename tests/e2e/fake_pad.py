"""A simulated gamepad: `navigator.getGamepads` returns what the test has set."""

from typing import Final

from console_page import ConsolePage

_INSTALL: Final = """([id, mapping]) => {
  window.fakePads = [];
  window.fakePad = (axes, down) => ({
    id, index: 0, connected: true, mapping, timestamp: performance.now(), axes,
    buttons: [...Array(8).keys()].map((at) => ({ pressed: down.includes(at), touched: false, value: 0 })),
  });
  navigator.getGamepads = () => window.fakePads;
}"""


class FakePad:
    """A connected gamepad with its sticks at rest, in the standard layout of the Gamepad API: -1 is up.

    With `mapping=""` the browser does not know that layout, and axis 2 is a trigger that reads 0 until it is touched.
    """

    def __init__(self, console: ConsolePage, name: str = "Test pad", *, mapping: str = "standard") -> None:
        self._page = console.page
        self._has_trigger = mapping == ""
        self.trigger = 0.0
        self._page.evaluate(_INSTALL, [name, mapping])
        self.move()

    def move(self, *, left: tuple[float, float] = (0, 0), right: tuple[float, float] = (0, 0), down: int = -1) -> None:
        """Sets the stick positions, right and up positive, and the pressed button."""
        axes = [left[0], -left[1], *([self.trigger] if self._has_trigger else []), right[0], -right[1]]
        self._page.evaluate("([axes, down]) => { window.fakePads = [window.fakePad(axes, [down])] }", [axes, down])

    def sweep(self, *, left: tuple[float, float] = (0, 0), right: tuple[float, float] = (0, 0)) -> None:
        """Moves the sticks there from rest, slowly enough for the console to see them on their way."""
        for step in range(1, 17):
            share = step / 16
            self.move(left=(left[0] * share, left[1] * share), right=(right[0] * share, right[1] * share))
            self._page.evaluate("() => new Promise((seen) => requestAnimationFrame(() => requestAnimationFrame(seen)))")

    def show_sticks(self) -> None:
        """Moves both sticks to their ends and lets go of them, as the console asks before they may fly."""
        self.sweep(left=(1, 1), right=(1, 1))
        self.move()

    def unplug(self) -> None:
        self._page.evaluate("window.fakePads = [null]")

    def flap(self) -> None:
        """Disconnects and reconnects faster than any poll: only the browser's own event reports it."""
        self._page.evaluate("""() => {
          const gone = new Event('gamepaddisconnected');
          Object.defineProperty(gone, 'gamepad', { value: { ...window.fakePads[0], connected: false } });
          window.dispatchEvent(gone);
        }""")
