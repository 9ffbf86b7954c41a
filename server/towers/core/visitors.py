"""The browsers of other towers that watch and fly drones of this one.

Each is a Browser of this tower's hub whose socket is the bus. So everything that holds for a browser here holds for it:
who may see a drone, whose frames pass, presence, rate limits, conflation. No I/O.
"""

from collections.abc import Callable
from typing import Final, Protocol

from server.kernel.people import Principal, SignInId, TokenId
from server.link.core.viewport import Viewport
from server.live.browser import Browser
from server.live.hub import GOING_DOWN, Hub
from server.live.live_messages import (
    Focus,
    MalformedRequest,
    MapShown,
    PersonFix,
    Ping,
    Pong,
    ToBrowser,
    Watch,
    decode_request,
)
from server.towers.core.messages import (
    Attach,
    CloseBrowser,
    Detach,
    FramesDown,
    Message,
    PingBrowser,
    Request,
    SessionsEnded,
    UserEnded,
    sign_in_of,
)
from wire.drops import DropReason
from wire.ids import DroneId, UserId

MAX_UNKNOWN: Final = 10_000
"""Browsers that wait until their sign-ins are known. More come again when their tower tells of them again."""


class Stop(Protocol):
    """Ends the writing to a visitor."""

    def __call__(self) -> None: ...


class Visitor(Browser):
    """A browser that is connected to another tower. `remote`: its number there."""

    is_visitor = True

    def __init__(
        self,
        number: int,
        viewer: Principal,
        now: float,
        *,
        tower: str,
        remote: int,
        address: str,
        ping: Callable[[int], None],
        close: Callable[[int, str], None],
    ) -> None:
        super().__init__(number, viewer, now, wake=_nothing, close=close, address=address)
        self.tower = tower
        self.remote = remote
        self._ping = ping
        self.stop: Stop = _nothing

    def notify(self, event: ToBrowser) -> None:
        """Puts a text message in the queue. A ping goes at once and by itself: that tower numbers it anew."""
        if isinstance(event, Ping):
            self._ping(event.sequence)
        else:
            super().notify(event)


class Visitors:
    """One for a tower. `begin_writing`: empties a visitor's outbox to the bus from now on; returns its end."""

    def __init__(
        self, hub: Hub, *, send: Callable[[str, Message], None], begin_writing: Callable[[Visitor], Stop]
    ) -> None:
        self._hub = hub
        self._send = send
        self._begin_writing = begin_writing
        self._visitors: dict[str, dict[int, Visitor]] = {}
        self._unknown: dict[tuple[str, int], Attach] = {}
        """Of sign-ins that this tower does not know yet, because its picture of the fleet is older."""
        self.on_unknown: Callable[[], None] = lambda: None
        """Called when a session is to be looked up in the database (`unknown_sessions`)."""

    def unknown_sessions(self) -> set[int]:
        """Sessions of browsers that wait because this tower does not know them: they began after its picture of the
        fleet, or never were."""
        signed_in = (sign_in_of(one) for one in self._unknown.values())
        return {one for one in signed_in if isinstance(one, int) and not self._hub.fleet.knows_sign_in(one)}

    def __len__(self) -> int:
        return sum(len(one) for one in self._visitors.values())

    def heard(self, tower: str, message: Message, now: float) -> None:
        """A tower tells of one of its browsers."""
        match message:
            case Attach():
                self._attach(tower, message, now)
            case Detach():
                self._unknown.pop((tower, message.number), None)
                self._detach(tower, message.number, now)
            case Request():
                visitor = self._visitors.get(tower, {}).get(message.number)
                if visitor is not None and self._hub.admits_request(visitor, now):
                    self._request(visitor, message.text, now)
            case FramesDown():
                visitor = self._visitors.get(tower, {}).get(message.number)
                if visitor is not None:
                    self._hub.frames_from_browser(visitor, message.message, now)
            case SessionsEnded():
                ended: list[SignInId] = [*message.sessions, *(TokenId(one) for one in message.tokens)]
                self._hub.end_sessions(ended, message.why, told=True)
            case UserEnded():
                self._hub.end_user(UserId(message.user_id), message.why, told=True)
            case _:
                pass

    def left(self, tower: str, now: float) -> None:
        """That tower is not heard any more, or says everything again: its browsers are gone until it names them."""
        for key in [one for one in self._unknown if one[0] == tower]:
            del self._unknown[key]
        for number in list(self._visitors.get(tower, {})):
            self._detach(tower, number, now)
        self._visitors.pop(tower, None)

    def fleet_changed(self, now: float) -> None:
        """Accounts and sessions may be known now."""
        waiting, self._unknown = self._unknown, {}
        for (tower, _), attach in waiting.items():
            self._attach(tower, attach, now)

    def _attach(self, tower: str, attach: Attach, now: float) -> None:
        number, sign_in = attach.number, sign_in_of(attach)
        self._detach(tower, number, now)
        viewer = self._hub.fleet.principal_of(sign_in, UserId(attach.user_id), attach.expires_at)
        if viewer is None:
            if len(self._unknown) < MAX_UNKNOWN:
                self._unknown[tower, number] = attach
            if isinstance(sign_in, int) and not self._hub.fleet.knows_sign_in(sign_in):
                self.on_unknown()
            return

        def close(code: int, why: str) -> None:
            if code != GOING_DOWN:  # only this tower ends
                self._send(tower, CloseBrowser(number, code, why))
            self._detach(tower, number, now)

        visitor = Visitor(
            self._hub.next_browser_number(),
            viewer,
            now,
            tower=tower,
            remote=number,
            address=attach.address,
            ping=lambda sequence: self._send(tower, PingBrowser(number, sequence)),
            close=close,
        )
        visitor.stop = self._begin_writing(visitor)
        self._visitors.setdefault(tower, {})[number] = visitor
        self._hub.attach_visitor(visitor, now)

    def _detach(self, tower: str, number: int, now: float) -> None:
        visitor = self._visitors.get(tower, {}).pop(number, None)
        if visitor is not None:
            visitor.stop()
            self._hub.detach_browser(visitor, now)

    def _request(self, visitor: Visitor, text: str, now: float) -> None:
        try:
            request = decode_request(text)
        except MalformedRequest:
            self._hub.state.drops[DropReason.MALFORMED] += 1
            return
        match request:
            case Focus():
                drone_id = None if request.drone_id is None else DroneId(request.drone_id)
                drone = self._hub.state.drones.get(drone_id) if drone_id is not None else None
                # The drone may have moved on to a third tower meanwhile.
                if drone_id is None or (drone is not None and visitor.number in drone.watchers):
                    self._hub.audience.focus(visitor, drone_id, now)
            case Pong():
                visitor.trip.pong(request.sequence, now)
            case PersonFix():
                self._hub.person_fix(visitor, request, now)
            case MapShown():
                bounds = request.bounds
                shown = None if bounds is None else Viewport(bounds.south, bounds.west, bounds.north, bounds.east)
                self._hub.audience.show_map(visitor, shown)
            case Watch():
                visitor.outbox.set_watch_rate(request.rate_hz, now)


def _nothing() -> None:
    pass
