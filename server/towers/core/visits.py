"""The browsers of this tower at the other towers: what they ask and send goes to the tower that has the drone, and what
that tower has for them goes to them.

Judges nothing: the home of the drone does. It only keeps apart what is whose. No I/O.
"""

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final, Protocol

import msgspec

from server.control.core.policy import Kind, kind_of
from server.kernel.people import SignInId, TokenId
from server.link.core.flood_gate import FloodGate
from server.live.browser import Browser
from server.live.live_drone import MANUAL_FOR_S
from server.live.live_messages import Focus, FromBrowser, MapShown, PersonFix, Pong, Relayed, Watch
from server.live.live_state import LiveState
from server.towers.core.messages import (
    CloseBrowser,
    Detach,
    EventUp,
    FramesDown,
    FramesUp,
    Message,
    PingBrowser,
    Request,
    SessionsEnded,
    UserEnded,
    attach_of,
)
from server.towers.core.place import Place
from wire.drops import DropReason
from wire.frames import MalformedFrame
from wire.ids import DroneId, UserId
from wire.state_messages import StateKey, state_key
from wire.tagged import MAX_UPWARD_MESSAGE_BYTES, split_stamp, split_tagged, stamp, tag

PINGS_OF_A_TOWER: Final = 1 << 32
"""Pings of other towers are told from those of this one by a multiple of this in their sequence."""
_REMOVED: Final = b'{"type":"drone_removed"'


class Reach(Protocol):
    """The other towers, as far as this part must know them."""

    def ready(self) -> Iterable[str]:
        """Towers that are within reach, and know the browsers of this one."""

    def home_of(self, drone_id: DroneId) -> str | None:
        """The tower that is the drone's home."""

    def send(self, tower: str, message: Message) -> None:
        """Sends a message, if that tower is ready for it."""


@dataclass
class _Visit:
    browser: Browser
    focus: DroneId | None = None
    rate: str | None = None
    map_shown: str | None = None
    sticks_at: float = float("-inf")
    """When it last moved sticks of a drone elsewhere."""


class _DroneRemoved(msgspec.Struct):
    drone_id: int


class Visits:
    """One for a tower."""

    def __init__(self, state: LiveState, flood: FloodGate, reach: Reach) -> None:
        self._state = state
        self._flood = flood
        self._reach = reach
        self._visits: dict[int, _Visit] = {}
        self._slots: dict[str, int] = {}

    @property
    def has_others(self) -> bool:
        """Whether another tower is within reach."""
        return any(True for _ in self._reach.ready())

    def flies_by_hand(self, number: int, now: float) -> bool:
        """Whether this browser has just moved the sticks of a drone elsewhere."""
        visit = self._visits.get(number)
        return visit is not None and now - visit.sticks_at < MANUAL_FOR_S

    # -- from this tower's browsers ------------------------------------------------------------------------------

    def entered(self, browser: Browser) -> None:
        """A browser has connected here."""
        self._visits[browser.number] = _Visit(browser)
        for tower in self._reach.ready():
            self._reach.send(tower, attach_of(browser.number, browser.viewer, browser.address))

    def left(self, number: int) -> None:
        """It has gone. Idempotent."""
        if self._visits.pop(number, None) is not None:
            for tower in self._reach.ready():
                self._reach.send(tower, Detach(number))

    def request(self, browser: Browser, request: FromBrowser, text: str) -> bool:
        """A text message of a browser. Whether another tower alone is to act on it."""
        visit = self._visits.get(browser.number)
        if visit is None:
            return False
        match request:
            case Focus():
                return self._focus(visit, None if request.drone_id is None else DroneId(request.drone_id))
            case Pong() if request.sequence >= PINGS_OF_A_TOWER:
                slot, sequence = divmod(request.sequence, PINGS_OF_A_TOWER)
                for tower, known in self._slots.items():
                    if known == slot:
                        self._forward(tower, browser.number, Pong(sequence))
                return True
            case PersonFix():
                home = self._elsewhere(DroneId(request.drone_id))
                if home is not None:
                    self._reach.send(home, Request(browser.number, text))
                return home is not None
            case Watch():
                visit.rate = text
            case MapShown():
                visit.map_shown = text
            case _:
                return False
        for tower in self._reach.ready():
            self._reach.send(tower, Request(browser.number, text))
        return False

    def divert(self, browser: Browser, message: bytes, now: float) -> bytes | None:
        """A binary message of a browser: sends on what is for drones elsewhere. What is left for this tower; None if
        nothing is."""
        if len(message) > MAX_UPWARD_MESSAGE_BYTES:
            return message
        try:
            sent_ms, tagged = split_stamp(message)
            parts = split_tagged(tagged)
        except MalformedFrame:
            return message
        homes = {drone_id: self._elsewhere(drone_id) for drone_id, _ in parts}
        if not any(homes.values()):
            return message
        head = b"" if sent_ms is None else stamp(sent_ms)
        ours: list[bytes] = []
        theirs: defaultdict[str, list[bytes]] = defaultdict(list)
        for drone_id, frame in parts:
            home = homes[drone_id]
            visit = self._visits.get(browser.number)
            if visit is not None and kind_of(frame) is Kind.STICKS:
                visit.sticks_at = now
            if home is None:
                ours.append(tag(drone_id, frame))
            elif self._flood.admits(browser.viewer.user_id, None, flies=True, now=now):
                theirs[home].append(tag(drone_id, frame))
            else:
                self._state.refuse(browser, DropReason.FLOOD, None, now)
        for tower, frames in theirs.items():
            self._reach.send(tower, FramesDown(browser.number, head + b"".join(frames)))
        return head + b"".join(ours) if ours else None

    def sessions_ended(self, sessions: Iterable[SignInId], why: str) -> None:
        """Before the browsers of these sign-ins leave: whoever holds a drone elsewhere loses it at once."""
        ended = list(sessions)
        tokens = [one.id for one in ended if isinstance(one, TokenId)]
        by_session = [one for one in ended if not isinstance(one, TokenId)]
        for tower in self._reach.ready():
            self._reach.send(tower, SessionsEnded(by_session, tokens, why))

    def user_ended(self, user_id: UserId, why: str) -> None:
        """Every connection of this account is about to end."""
        for tower in self._reach.ready():
            self._reach.send(tower, UserEnded(user_id, why))

    # -- from and about other towers -----------------------------------------------------------------------------

    def opened(self, tower: str) -> None:
        """That tower knows nothing of the browsers here: says everything again."""
        for number, visit in self._visits.items():
            self._reach.send(tower, attach_of(number, visit.browser.viewer, visit.browser.address))
            for text in (visit.rate, visit.map_shown):
                if text is not None:
                    self._reach.send(tower, Request(number, text))
            if visit.focus is not None and self._reach.home_of(visit.focus) == tower:
                self._forward(tower, number, Focus(visit.focus))

    def moved(self, drone_id: DroneId) -> None:
        """The drone is in another place: whoever has it in focus keeps it there."""
        for visit in self._visits.values():
            if visit.focus == drone_id and not self._focus(visit, drone_id):
                drone = self._state.drones.get(drone_id)
                if drone is not None and visit.browser.number in drone.watchers:
                    visit.browser.outbox.focus = drone_id

    def heard(self, tower: str, message: Message) -> None:
        """Something of that tower for a browser here."""
        if not isinstance(message, EventUp | FramesUp | PingBrowser | CloseBrowser):
            return
        visit = self._visits.get(message.number)
        if visit is None:
            return
        browser = visit.browser
        match message:
            case FramesUp():
                self._frames_up(browser, message.message)
            case EventUp():
                if message.text.startswith(_REMOVED):
                    browser.outbox.forget(DroneId(msgspec.json.decode(message.text, type=_DroneRemoved).drone_id))
                browser.notify(Relayed(message.text.decode()))
            case PingBrowser():
                slot = self._slots.setdefault(tower, len(self._slots) + 1)
                text = b'{"type":"ping","sequence":%d}' % (slot * PINGS_OF_A_TOWER + message.sequence)
                browser.notify(Relayed(text.decode()))
            case CloseBrowser():
                browser.close(message.code, message.why)

    def _frames_up(self, browser: Browser, message: bytes) -> None:
        state: list[tuple[StateKey, bytes]] = []
        transactional: list[bytes] = []
        drone_id, last = None, None
        for drone_id, frame in split_tagged(message):
            if last is not None and drone_id != last:
                browser.offer_at_once(last, state, transactional)
                state, transactional = [], []
            last = drone_id
            key = state_key(frame)
            tagged = tag(drone_id, frame)
            if key is None:
                transactional.append(tagged)
            else:
                state.append((key, tagged))
        if last is not None:
            browser.offer_at_once(last, state, transactional)

    # -- inside --------------------------------------------------------------------------------------------------

    def _elsewhere(self, drone_id: DroneId) -> str | None:
        drone = self._state.drones.get(drone_id)
        if drone is None or drone.place is not Place.ELSEWHERE:
            return None
        return self._reach.home_of(drone_id)

    def _focus(self, visit: _Visit, drone_id: DroneId | None) -> bool:
        home = self._elsewhere(drone_id) if drone_id is not None else None
        number = visit.browser.number
        for tower in self._reach.ready():
            if tower == home or visit.focus is not None:
                self._forward(tower, number, Focus(drone_id if tower == home else None))
        visit.focus = drone_id
        if home is not None:
            visit.browser.outbox.focus = None
        return home is not None

    def _forward(self, tower: str, number: int, request: FromBrowser) -> None:
        self._reach.send(tower, Request(number, msgspec.json.encode(request).decode()))
