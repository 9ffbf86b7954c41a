"""The console as a test sees it: the page of one signed-in person, with what is shown and can be pressed."""

import contextlib
import math
import time
from collections import Counter
from collections.abc import Callable, Iterator
from typing import Final, Protocol

from playwright.sync_api import Browser, ConsoleMessage, Locator, Page, ViewportSize, WebSocket, expect
from worlds.processes import PASSWORD

from wire.tagged import split_tagged

FLAGS: Final = (
    "--no-sandbox",
    "--disable-gpu",
    "--enable-unsafe-swiftshader",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
"""Flags for a headless Chromium that calls no servers and draws as without a graphics card (web/bench/monitor.py)."""

SIMULATOR: Final = ("--boot-s", "2", "--seed", "7", "--speed", "3", "--real-rates")

FLIGHT_TIMEOUT_S: Final = 90.0
CHECK_TIMEOUT_S: Final = 10.0
"""The agent reads the parameters of a simulated drone within three."""
METRES_PER_DEGREE: Final = 111_195.0


TOURED: Final = "localStorage.setItem('tower.console', '{\"hasToured\": true}')"
"""For a browser in which the tour of the console was seen: it begins at a user's first sign-in."""


NO_MAP: Final = (
    "localStorage.getItem('tower.preferences') ?? localStorage.setItem('tower.preferences', '{\"map\": false}')"
)
"""For a test that is not about the map: loading and drawing it takes as long as all the rest of the console."""

WATCH_HELD: Final = """(one, withinMs) => {
  one.wasHeld = new Promise((done, fail) => {
    let isHeld = false;
    new MutationObserver(() => {
      const was = isHeld;
      isHeld = one.classList.contains('held');
      if (was && !isHeld) done();
    }).observe(one, { attributeFilter: ['class'] });
    setTimeout(() => fail(new Error('it was not held')), withinMs);
  });
}"""
"""`wasHeld` of a button that is held resolves when it has acted: a busy page takes longer than the second."""


class Somebody(Protocol):
    """Opens the console in a separate browser profile; with `has_touch` on a tablet, with `is_first` for a user who has
    not seen the tour, with `is_sharp` for a test that reads pixels, with `has_map` for one that looks at the map."""

    def __call__(
        self, *, has_touch: bool = False, is_first: bool = False, is_sharp: bool = False, has_map: bool | None = None
    ) -> "ConsolePage": ...


class ConsolePage:
    """Wraps the page and collects live-channel messages and the console's errors.

    Opens at the first look at it. Somebody who signs in before has a session already and never sees the sign-in page.
    """

    def __init__(self, page: Page, address: str) -> None:
        self._page = page
        self._is_open = False
        self.address = address
        self.drones_heard: set[int] = set()
        self.frames_heard: Counter[int] = Counter()
        self.complaints: list[str] = []
        page.on("websocket", self._watch)
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.on("console", self._note)

    def _note(self, said: ConsoleMessage) -> None:
        if said.type == "error":
            # Chromium does not say in its words what could not be loaded.
            self.complaints.append(f"{said.text} at {said.location['url']}")

    def _watch(self, socket: WebSocket) -> None:
        if not socket.url.endswith("/api/v1/live"):
            return  # a video

        def received(message: str | bytes) -> None:
            if isinstance(message, bytes):
                tags = [drone_id for drone_id, _ in split_tagged(message)]
                self.drones_heard |= set(tags)
                self.frames_heard.update(tags)

        if not socket.url.partition("?")[0].endswith("/video"):  # units, not frames
            socket.on("framereceived", received)

    @property
    def page(self) -> Page:
        if not self._is_open:
            self.open()
        return self._page

    def part(self, testid: str) -> Locator:
        return self.page.get_by_test_id(testid)

    def open(self, path: str = "/") -> None:
        self._is_open = True
        self._page.goto(self.address + path)

    def sign_in(self, name: str, password: str = PASSWORD, *, first_opens: str | None = None) -> None:
        """`first_opens`: the drone whose page opens first, and not the squad."""
        if not self._is_open:
            who, request = {"name": name, "password": password}, self._page.context.request
            answer = request.post(f"{self.address}/api/v1/session", data=who)
            if answer.ok:
                drones = request.get(f"{self.address}/api/v1/drones").json() if first_opens else []
                self.open("/" + "".join(f"#/drone/{one['id']}" for one in drones if one["name"] == first_opens))
                return
        self.page.get_by_label("Name").fill(name)
        self.page.get_by_label("Password").fill(password)
        self.page.get_by_role("button", name="Sign in", exact=True).click()

    def open_drone(self, name: str) -> None:
        self.page.get_by_role("link", name=f"Open {name}").click()
        expect(self.part("value-armed")).to_be_visible()

    def open_panel(self, panel: str) -> None:
        """A panel of the flight screen, unless it is open: on a narrow one they are closed, and open one at a time."""
        switch = self.part(f"panel-{panel}")
        if switch.get_attribute("aria-expanded") == "false":
            switch.click()
        expect(self.part(f"sheet-{panel}")).to_be_visible()

    def acquire(self, name: str) -> None:
        self.open_panel("commands")
        self.part("control-acquire").click()
        expect(self.part("blocked-reason")).to_contain_text(f"You fly {name}")
        self.read_loss_check(name)

    def read_loss_check(self, name: str) -> None:
        """A drone as it comes is in danger if its computer fails: whoever arms it has read that. Of one that is silent
        there is nothing to read."""
        request = self.page.request
        api = f"{self.address}/api/v1/drones"
        drone_id = next(one["id"] for one in request.get(api).json() if one["name"] == name)
        path = f"{api}/{drone_id}/loss-check"

        def is_read() -> bool:
            check = request.get(path).json()
            if not check["complete"] or check["has_radio"] is None:
                return False
            if check["dangerous"] and not check["acknowledged"]:
                request.post(f"{path}/acknowledge", data={"drone": name}, headers={"Origin": self.address})
                return False
            return True

        until = time.monotonic() + CHECK_TIMEOUT_S
        while not is_read() and time.monotonic() < until:
            self.page.wait_for_timeout(150)

    def take_off(self, name: str, height_m: float) -> None:
        self.wait("a position", lambda: self.word("gps") != "" and self.number("latitude") > 40)
        self.part("takeoff-height").fill(f"{height_m:g}")
        self.hold_take_off(name)
        self.wait(f"{height_m:g} m", lambda: abs(self.number("altitude") - height_m) < 0.5)

    def hold_take_off(self, name: str) -> None:
        """Holds the button until the page answers, which takes a second, and longer if it is busy drawing. A danger
        that was not read yet asks besides."""
        self.part("action-takeoff").hover()
        self.page.mouse.down()
        dialog, report = self.page.get_by_role("dialog"), self.part("action-report")
        self.wait("an answer", lambda: dialog.count() > 0 or (report.count() > 0 and "Take off" in report.inner_text()))
        self.page.mouse.up()
        if dialog.count() > 0:
            self.confirm(name)

    def squad(self) -> list[str]:
        return [row.get_attribute("data-drone-id") or "" for row in self.part("squad-row").all()]

    def confirm(self, drone: str) -> None:
        """Confirms a dangerous action, once, in the dialog that names the drone."""
        dialog = self.page.get_by_role("dialog")
        expect(dialog).to_contain_text(drone)
        if dialog.get_by_test_id("confirm-name").count() > 0:  # it names dangers
            dialog.get_by_test_id("confirm-name").fill(drone)
        button = dialog.get_by_test_id("confirm-button")
        if button.get_attribute("data-held-s") is None:
            button.click()
        else:
            button.hover()
            self.page.mouse.down()
            self.wait("the button to be held long enough", lambda: dialog.count() == 0)
            self.page.mouse.up()
        expect(dialog).to_have_count(0)

    def ends_flight(self, end: str) -> None:
        """Holds "return" or "land" in the flight bar."""
        self.hold(f"bar-{end}")

    def hold(self, name: str) -> None:
        """Holds a button for as long as it wants."""
        button = self.part(name)
        button.hover()
        button.evaluate(WATCH_HELD, FLIGHT_TIMEOUT_S * 1000)
        self.page.mouse.down()
        button.evaluate("(one) => one.wasHeld")
        self.page.mouse.up()

    def go_here(self, *share: float) -> None:
        """Presses the map (at these shares of its width and height, its middle by default), and "go here"."""
        self.press_map(*share)
        self.part("goto-confirm").click()

    def press_map(self, across: float = 0.5, down: float = 0.5) -> None:
        box = self.part("map").bounding_box()
        assert box is not None
        self.page.mouse.click(box["x"] + box["width"] * across, box["y"] + box["height"] * down)
        expect(self.part("map-menu")).to_be_visible()

    def word(self, name: str) -> str:
        """A value of the page's drone: among the chosen ones, or in the flight bar."""
        shown = self.page.locator(f"[data-testid='value-{name}'], [data-of='{name}']")
        return shown.first.get_attribute("data-value") or ""

    def number(self, name: str) -> float:
        text = self.word(name)
        return float(text) if text else math.nan

    def takes_from(
        self, pilot: str, drone: str, *, reason: str = "", may_watch: bool = True, may_watch_video: bool = True
    ) -> None:
        self.part("control-take").click()
        expect(self.page.get_by_role("dialog")).to_contain_text(pilot)
        self.part("confirm-reason").fill(reason)
        self.part("confirm-check").set_checked(may_watch)
        if may_watch:
            self.part("confirm-second-check").set_checked(may_watch_video)
        self.confirm(drone)

    def gives_back(self, drone: str) -> None:
        self.part("control-give").click()
        self.confirm(drone)

    def wait(self, what: str, condition: Callable[[], bool], *, timeout_s: float = FLIGHT_TIMEOUT_S) -> None:
        deadline = time.monotonic() + timeout_s
        while not condition():
            if time.monotonic() > deadline:
                shown = self.page.locator("[data-testid^=value-]").all()
                seen = {part.get_attribute("data-testid"): part.get_attribute("data-value") for part in shown}
                said = [part.inner_text() for part in self.part("messages").get_by_test_id("message").all()[-5:]]
                raise AssertionError(f"waited {timeout_s:g} s in vain for {what}; the page shows {seen}, {said}")
            self.page.wait_for_timeout(150)  # each look is several questions to the browser

    def wait_for_frames(self, drones: int = 1, *, timeout_s: float = 20.0) -> None:
        """Waits until frames of this many drones have arrived."""
        deadline = time.monotonic() + timeout_s
        while len(self.drones_heard) < drones:
            assert time.monotonic() < deadline, f"heard {self.drones_heard} in {timeout_s:g} s"
            self.page.wait_for_timeout(150)  # each look is several questions to the browser

    def distance_m(self, lat_deg: float, lon_deg: float) -> float:
        """Returns the distance from the position that the page shows for the drone."""
        north = (self.number("latitude") - lat_deg) * METRES_PER_DEGREE
        east = (self.number("longitude") - lon_deg) * METRES_PER_DEGREE * math.cos(math.radians(lat_deg))
        return math.hypot(north, east)


def signed_in(
    somebody: Somebody,
    name: str,
    drone: str | None = None,
    *,
    has_touch: bool = False,
    is_sharp: bool = False,
    has_map: bool | None = None,
) -> ConsolePage:
    """Signs somebody in, who then sees the squad or, without the way through it, the page of one drone."""
    console = somebody(has_touch=has_touch, is_sharp=is_sharp, has_map=has_map)
    if drone is None:
        console.sign_in(name)
        expect(console.part("squad-row").first).to_be_visible()
    else:
        console.sign_in(name, first_opens=drone)
        expect(console.part("value-armed")).to_be_visible()
    return console


@contextlib.contextmanager
def visitors(chromium: Browser, address: str, *, has_map: bool = False) -> Iterator[Somebody]:
    """`has_map`: for those who do not say."""
    contexts = []
    most_have_map = has_map

    def come(
        *, has_touch: bool = False, is_first: bool = False, is_sharp: bool = False, has_map: bool | None = None
    ) -> ConsolePage:
        size: ViewportSize = {"width": 1180, "height": 820} if has_touch else {"width": 1280, "height": 800}
        # The offline cache has tests of its own; filling it would cost each profile seconds.
        context = chromium.new_context(
            viewport=size,
            # A quarter of the pixels: drawing in software takes most of a test's processor time.
            device_scale_factor=1.0 if is_sharp else 0.5,
            reduced_motion="reduce",
            has_touch=has_touch,
            service_workers="block",
        )
        contexts.append(context)
        if not is_first:
            context.add_init_script(TOURED)
        if not (most_have_map if has_map is None else has_map):
            context.add_init_script(NO_MAP)
        return ConsolePage(context.new_page(), address)

    yield come
    for context in contexts:
        context.close()
