"""A simulated gamepad: `navigator.getGamepads` returns what the test has set."""

from typing import Final

from console_page import ConsolePage

_INSTALL: Final = """(id) => {
  window.fakePads = [];
  window.fakePad = (axes, down) => ({
    id, index: 0, connected: true, mapping: 'standard', timestamp: performance.now(), axes,
    buttons: [...Array(8).keys()].map((at) => ({ pressed: down.includes(at), touched: false, value: 0 })),
  });
  navigator.getGamepads = () => window.fakePads;
}"""


class FakePad:
    """A connected gamepad with its sticks at rest, in the standard layout of the Gamepad API: -1 is up."""

    def __init__(self, console: ConsolePage, name: str = "Test pad") -> None:
        self._page = console.page
        self._page.evaluate(_INSTALL, name)
        self.move()

    def move(self, *, left: tuple[float, float] = (0, 0), right: tuple[float, float] = (0, 0), down: int = -1) -> None:
        """Sets the stick positions, right and up positive, and the pressed button."""
        axes = [left[0], -left[1], right[0], -right[1]]
        self._page.evaluate("([axes, down]) => { window.fakePads = [window.fakePad(axes, [down])] }", [axes, down])

    def unplug(self) -> None:
        self._page.evaluate("window.fakePads = [null]")

    def flap(self) -> None:
        """Disconnects and reconnects faster than any poll: only the browser's own event reports it."""
        self._page.evaluate("""() => {
          const gone = new Event('gamepaddisconnected');
          Object.defineProperty(gone, 'gamepad', { value: { ...window.fakePads[0], connected: false } });
          window.dispatchEvent(gone);
        }""")
