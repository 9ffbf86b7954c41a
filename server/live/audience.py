"""The browsers that watch: they connect, choose what to see, leave, and are shut out when their sign-in ends.

Reports at once what depends on a person's presence: to agents about held drones, and lost rights (hub_events).
"""

from collections.abc import Callable, Iterable

from server.alerts.core.views import AlertView
from server.kernel.people import SignInId
from server.link.core.viewport import Viewport, place_in
from server.live import live_messages as live
from server.live.browser import Browser
from server.live.hub_events import RightLost
from server.live.live_drone import LiveDrone
from server.live.live_state import LiveState
from wire.drops import DropReason
from wire.ids import DroneId, UserId


class Audience:
    """No state of its own. `note_presence_of`: a browser of this user came or went; `close`: ends one for good."""

    def __init__(
        self,
        state: LiveState,
        *,
        note_presence_of: Callable[[UserId, float], None],
        close: Callable[[Browser, str], None],
    ) -> None:
        self._state = state
        self._note_presence_of = note_presence_of
        self._close = close

    def enter(
        self,
        browser: Browser,
        seen: list[LiveDrone],
        alerts: list[AlertView],
        server_time: str,
        now: float,
        *,
        other_towers: bool = False,
    ) -> None:
        """The browser gets the frames of `seen` from here on; the whole picture comes first."""
        self._state.browsers[browser.number] = browser
        for drone in seen:
            drone.watchers[browser.number] = browser
        viewer = browser.viewer
        user = live.User(viewer.user_id, viewer.name, viewer.role)
        browser.notify(
            live.WelcomeBrowser(
                user,
                [drone.view_for(viewer.user_id, viewer.role) for drone in seen],
                server_time,
                alerts,
                other_towers=other_towers,
            )
        )
        self._note_presence_of(viewer.user_id, now)

    def enter_visitor(self, browser: Browser, seen: list[LiveDrone], now: float) -> None:
        """The same for a browser of another tower, which has the whole picture from there."""
        self._state.browsers[browser.number] = browser
        viewer = browser.viewer
        for drone in seen:
            drone.watchers[browser.number] = browser
            browser.notify(live.DroneChanged(drone.view_for(viewer.user_id, viewer.role)))
        self._note_presence_of(viewer.user_id, now)

    def leave(self, browser: Browser, now: float) -> None:
        """Removes a browser. Idempotent."""
        if self._state.browsers.pop(browser.number, None) is None:
            return
        for drone in self._state.drones.values():
            drone.watchers.pop(browser.number, None)
        user_id = browser.viewer.user_id
        self._note_presence_of(user_id, now)
        if browser.viewer.may_fly and not self._state.has_browser(user_id):
            self._report_assistant_gone(user_id, "the assistant's browser is gone")

    def focus(self, browser: Browser, drone_id: DroneId | None, now: float) -> None:
        """The browser wants the frames of one drone at once."""
        drone = self._state.drones.get(drone_id) if drone_id is not None else None
        if drone_id is not None and (drone is None or browser.number not in drone.watchers):
            self._state.refuse(browser, DropReason.UNKNOWN_DRONE, drone_id, now)
            return
        browser.outbox.focus = drone_id

    def show_map(self, browser: Browser, viewport: Viewport | None) -> None:
        """The browser's map shows this part; None: all of it, or there is no map."""
        browser.viewport = viewport
        self._check_map_viewer(browser, self._places() if viewport else {})

    def check_map_viewers(self) -> None:
        """Once a second: which drones are outside whose map by now."""
        browsers = [browser for browser in self._state.browsers.values() if browser.viewport is not None]
        if browsers:
            places = self._places()
            for browser in browsers:
                self._check_map_viewer(browser, places)

    def _places(self) -> dict[DroneId, tuple[float, float]]:
        known = {}
        for drone_id, drone in self._state.drones.items():
            place = place_in(drone.position_frame) if drone.position_frame is not None else None
            if place is not None:
                known[drone_id] = place
        return known

    @staticmethod
    def _check_map_viewer(browser: Browser, places: dict[DroneId, tuple[float, float]]) -> None:
        # A drone without a position counts as inside.
        shows = None if browser.viewport is None else browser.viewport.shows
        browser.outbox.far = {drone_id for drone_id, place in places.items() if shows and not shows(*place)}

    def end_sessions(self, session_ids: Iterable[SignInId], why: str) -> None:
        """Closes the browsers of sessions and tokens that have ended. Who has no other loses the controls at once."""
        ended = set(session_ids)
        users = set()
        for browser in [one for one in self._state.browsers.values() if one.viewer.session_id in ended]:
            self._close(browser, why)
            if browser.viewer.may_fly:
                users.add(browser.viewer.user_id)
        for user_id in users:
            self._report_signed_out(user_id)

    def end_user(self, user_id: UserId, why: str) -> None:
        """Closes every browser of an account, which reads why."""
        for browser in [one for one in self._state.browsers.values() if one.viewer.user_id == user_id]:
            self._close(browser, why)
        self._report_signed_out(user_id)

    def _report_signed_out(self, user_id: UserId) -> None:
        if self._state.has_browser(user_id):
            return
        for drone in list(self._state.drones.values()):
            if drone.holder_id == user_id:
                self._state.on_event(RightLost(drone.drone_id, user_id, "holder", "the holder's session has ended"))
        self._report_assistant_gone(user_id, "the session has ended")

    def _report_assistant_gone(self, user_id: UserId, reason: str) -> None:
        for drone in list(self._state.drones.values()):
            if drone.lease.assistant is not None and drone.lease.assistant.id == user_id:
                self._state.on_event(RightLost(drone.drone_id, user_id, "assistant", reason))
