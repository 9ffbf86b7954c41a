"""What waits to be sent to one browser. Bounded by construction; never slows anybody else.

State frames are conflated: of each kind of each drone only the newest is kept. Transactional frames are kept in
order up to a bound, beyond which the oldest are dropped and the browser is told how many it lost. Sans-I/O:
`now` in, bytes out.
"""

from collections import Counter, deque
from collections.abc import Iterable
from typing import Final

from wire.ids import DroneId
from wire.state_messages import StateKey

DEFAULT_WATCH_RATE_HZ: Final = 5.0

MOST_TRANSACTIONAL: Final = 4096
"""Frames. A parameter download is about 1,400 and comes at the speed of the link, so this is several at once."""

MOST_STATE_KINDS: Final = 128
"""Kinds of state per drone. Real autopilots send about 40; a sender that invents more gets no more memory."""


class Outbox:
    """Offer frames as they come; take what is due when the socket can send."""

    def __init__(self, now: float) -> None:
        self._watch_period_s = 1.0 / DEFAULT_WATCH_RATE_HZ
        self._next_beat = now
        self._transactional: deque[tuple[DroneId, bytes]] = deque()
        self._focused: dict[tuple[DroneId, StateKey], bytes] = {}
        self._watched: dict[DroneId, dict[StateKey, bytes]] = {}
        self._lost: Counter[DroneId] = Counter()
        self.focus: DroneId | None = None
        """The drone whose frames are due at once."""

    def set_watch_rate(self, rate_hz: float, now: float) -> None:
        """How often the state of drones that are not focused is due."""
        self._watch_period_s = 1.0 / rate_hz
        self._next_beat = min(self._next_beat, now + self._watch_period_s)

    def offer(self, drone_id: DroneId, key: StateKey | None, tagged: bytes) -> bool:
        """Takes one tagged frame. True if the sender must look again: something is due, or a beat is set."""
        if key is None:
            if len(self._transactional) >= MOST_TRANSACTIONAL:
                dropped_drone, _ = self._transactional.popleft()
                self._lost[dropped_drone] += 1
            self._transactional.append((drone_id, tagged))
            return True
        if drone_id == self.focus:
            self._focused[drone_id, key] = tagged
            return True
        first = not self._watched
        kinds = self._watched.setdefault(drone_id, {})
        if key in kinds or len(kinds) < MOST_STATE_KINDS:
            kinds[key] = tagged
        return first

    def forget(self, drone_id: DroneId) -> None:
        """Throws away all that waits of a drone: this browser may not see it any more."""
        self._watched.pop(drone_id, None)
        self._lost.pop(drone_id, None)
        self._focused = {key: frame for key, frame in self._focused.items() if key[0] != drone_id}
        self._transactional = deque(item for item in self._transactional if item[0] != drone_id)
        if self.focus == drone_id:
            self.focus = None

    def take(self, now: float) -> list[bytes]:
        """Tagged frames that are due, transactional ones first. Empty if nothing is."""
        due: Iterable[bytes] = ()
        if self._transactional:
            due = [tagged for _, tagged in self._transactional]
            self._transactional.clear()
        taken = list(due)
        if self._focused:
            taken.extend(self._focused.values())
            self._focused.clear()
        if now >= self._next_beat:
            self._next_beat = max(self._next_beat + self._watch_period_s, now)
            for kinds in self._watched.values():
                taken.extend(kinds.values())
            self._watched.clear()
        return taken

    def take_lost(self) -> dict[DroneId, int]:
        """Transactional frames dropped since the last call, per drone."""
        lost, self._lost = dict(self._lost), Counter()
        return lost

    def next_beat(self) -> float | None:
        """When watched state will be due, or None while there is none."""
        return self._next_beat if self._watched else None
