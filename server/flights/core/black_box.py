"""Fetches from the black boxes of drones what their links lost, piece by piece and after everything else. Pure.

- One piece at a time of each drone, and of few drones at once. After each piece the fetch rests several times as long
  as the piece took, so it uses a fraction of what the link has left.
- While datagrams share the control channel (no UDP), nothing is fetched of an armed drone: pieces would stand in
  their way.
- A fetch goes on where it broke off, also over another link.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

from server.link.core.agent_link import AgentLink
from server.link.core.agent_routes import OVER_CHANNEL
from server.live.live_drone import LiveDrone
from server.live.live_state import LiveState
from wire.black_box import BLACK_BOX, BlackBoxFlight, BlackBoxPiece, BlackBoxState, BlackBoxToTower, BlackBoxWanted
from wire.black_box import inflated as inflate
from wire.ids import DroneId

REST_ARMED: Final = 3.0
"""Times as long as a piece took, while the drone is armed."""
REST_ON_GROUND: Final = 0.5
MIN_REST_S: Final = 0.1
ANSWER_WITHIN_S: Final = 10.0
MAX_TRIES: Final = 5
"""Of one piece in a row; then the drone's fetches rest."""
REST_AFTER_TRIES_S: Final = 60.0
MAX_AT_ONCE: Final = 8
"""Pieces that the tower waits for."""
MAX_GAP_BYTES: Final = 64 * 1024 * 1024
"""Two hours of 200 frames a second. What is more stays on the drone."""
MAX_PER_DRONE: Final = 128
EDGE_US: Final = 30_000_000
"""A flight of the black box has seconds before arming that `began_us` does not count."""
SETTLED_US: Final = 1_000_000
"""The drone's disk is this far behind, at most."""
NOT_THERE: Final = "the drone has no recording of it"
TOO_MUCH: Final = "more than the tower takes of one gap"
NO_PIECE: Final = "the drone sent something that is no piece of a recording"


@dataclass
class Gap:
    """A stretch of a flight's file, by its clock. `resume_us`: by the agent's clock, where an earlier tower's fetch
    ended."""

    id: int
    drone_id: DroneId
    file: str
    from_us: int
    to_us: int
    resume_us: int = 0
    todo: list[str] | None = None
    """Flights of the black box that have some of it, the first in work."""
    at: int = 0
    got_bytes: int = 0


@dataclass
class _Drone:
    gaps: deque[Gap] = field(default_factory=deque)
    state: BlackBoxState | None = None
    shift_us: int = 0
    """What added to the agent's times gives the tower's."""
    link: AgentLink | None = None
    request: int = 0
    asked_at: float | None = None
    tries: int = 0
    rest_until: float = 0.0


class BlackBoxFetcher:
    """One for the hub. `on_piece`: whole entries of a telemetry log with the agent's times, in order, and what to add
    to them. `on_done`: nothing follows; words tell why there is less than wanted."""

    def __init__(self, state: LiveState) -> None:
        self._state = state
        self._drones: dict[DroneId, _Drone] = {}
        self._now = 0.0
        self._request = 0
        self.on_piece: Callable[[Gap, bytes, int], None] = lambda gap, entries, shift_us: None
        self.on_done: Callable[[Gap, str], None] = lambda gap, words: None
        self.counts: Counter[str] = Counter(fetched=0, failed=0, bytes=0)

    @property
    def waiting(self) -> int:
        """Gaps that are not fetched yet."""
        return sum(len(one.gaps) for one in self._drones.values())

    def add(self, gap: Gap) -> bool:
        """A gap to fetch. False: too many of this drone wait."""
        drone = self._drones.setdefault(gap.drone_id, _Drone())
        if len(drone.gaps) >= MAX_PER_DRONE:
            return False
        drone.gaps.append(gap)
        return True

    def receive(self, drone: LiveDrone, link: AgentLink, message: BlackBoxToTower) -> None:
        """A message of this drone's agent."""
        if BLACK_BOX not in link.takes:
            return
        known = self._drones.setdefault(drone.drone_id, _Drone())
        if isinstance(message, BlackBoxState):
            tower_us = round(self._state.clock().timestamp() * 1e6)
            known.state, known.shift_us, known.link = message, tower_us - message.now_us, link
            drone.black_box_problem = message.problem
        elif known.asked_at is not None and message.request == known.request and known.link is link:
            self._piece(known, drone, message)

    def tick(self, now: float) -> None:
        """Several times a second."""
        self._now = now
        room = MAX_AT_ONCE - sum(one.asked_at is not None for one in self._drones.values())
        for drone_id, known in self._drones.items():
            if known.gaps:
                drone = self._state.drones.get(drone_id)
                if drone is None:
                    known.gaps.clear()
                    known.asked_at = None
                elif self._go_on(known, drone, now, may_ask=room > 0):
                    room -= 1

    def _go_on(self, known: _Drone, drone: LiveDrone, now: float, *, may_ask: bool) -> bool:
        """Whether a piece was asked for."""
        if known.asked_at is not None:
            if drone.link is known.link and now - known.asked_at < ANSWER_WITHIN_S:
                return False
            known.asked_at = None
            known.tries += 1
            if known.tries >= MAX_TRIES:
                known.tries, known.rest_until = 0, now + REST_AFTER_TRIES_S
        if not may_ask or now < known.rest_until or not self._may_fetch(known, drone, now):
            return False
        assert known.state is not None and known.link is not None
        gap = known.gaps[0]
        if self._state.clock().timestamp() * 1e6 < gap.to_us + SETTLED_US:
            return False
        from_us, to_us = gap.resume_us or gap.from_us - known.shift_us, gap.to_us - known.shift_us
        if gap.todo is None:
            gap.todo = [one.name for one in known.state.flights if _has_some(one, from_us, to_us)]
        if not gap.todo:
            self._end(known, NOT_THERE if not gap.got_bytes else "")
            return False
        self._request = known.request = self._request % 0xFFFFFFFF + 1
        known.asked_at = now
        known.link.post(
            BlackBoxWanted(
                request=known.request, flight=gap.todo[0], from_us=max(0, from_us), to_us=max(0, to_us), at=gap.at
            )
        )
        return True

    @staticmethod
    def _may_fetch(known: _Drone, drone: LiveDrone, now: float) -> bool:
        link = drone.link
        if link is None or link is not known.link or known.state is None:
            return False
        if not link.has_channel or not link.is_heard(now):
            return False
        return drone.armed is False or link.routes.newest != OVER_CHANNEL

    def _piece(self, known: _Drone, drone: LiveDrone, piece: BlackBoxPiece) -> None:
        gap = known.gaps[0]
        assert known.asked_at is not None and gap.todo is not None
        took_s, known.asked_at, known.tries = self._now - known.asked_at, None, 0
        rest = REST_ON_GROUND if drone.armed is False else REST_ARMED
        known.rest_until = self._now + max(MIN_REST_S, rest * took_s)
        try:
            entries = inflate(piece.data) if piece.data else b""
        except ValueError:
            self._end(known, NO_PIECE)
            return
        if entries:
            gap.got_bytes += len(entries)
            self.counts["bytes"] += len(entries)
            self.on_piece(gap, entries, known.shift_us)
        if gap.got_bytes > MAX_GAP_BYTES:
            self._end(known, TOO_MUCH)
        elif not piece.last and piece.next <= gap.at:
            self._end(known, NO_PIECE)
        elif piece.last:
            gap.todo.pop(0)
            gap.at = 0
            if not gap.todo:
                self._end(known, "" if gap.got_bytes else piece.words or NOT_THERE)
        else:
            gap.at = piece.next

    def _end(self, known: _Drone, words: str) -> None:
        gap = known.gaps.popleft()
        self.counts["failed" if words else "fetched"] += 1
        self.on_done(gap, words)


def _has_some(flight: BlackBoxFlight, from_us: int, to_us: int) -> bool:
    return flight.began_us - EDGE_US <= to_us and (flight.ended_us is None or flight.ended_us >= from_us)
