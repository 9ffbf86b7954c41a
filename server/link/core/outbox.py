"""What waits for one browser. Bounded by construction; never slows down others.

State frames are conflated: only the newest of each kind and drone is kept. Transactional frames keep their order up to
a bound. Beyond it the oldest are dropped, those of the drone with the most waiting first, and the browser learns how
many it lost. Sans-I/O: `now` in, bytes out.
"""

from collections import Counter, deque
from collections.abc import Sequence, Set
from typing import Final

from wire.ids import DroneId
from wire.state_messages import StateKey

DEFAULT_WATCH_RATE_HZ: Final = 5.0

FAR_PERIOD_S: Final = 1.0
"""How often the state of drones outside the browser's map is due, unless it watches more slowly than that anyway."""

MAX_TRANSACTIONAL: Final = 4096
"""Frames. A parameter download is about 1,400 and comes at the speed of the link, so this is several at once."""

MAX_AT_ONCE: Final = 4096
"""State frames that other towers sent and that wait: of a squad of 100 drones."""

MAX_STATE_KINDS: Final = 128
"""Kinds of state per drone. Real autopilots send about 40. Further kinds are dropped, counted as lost, and reported to
the browser."""


class Outbox:
    """Offer frames as they come; take what is due when the socket can send."""

    def __init__(self, now: float) -> None:
        self._watch_period_s = 1.0 / DEFAULT_WATCH_RATE_HZ
        self._next_beat = now
        self._next_far_beat = now
        self._transactional: dict[DroneId, deque[bytes]] = {}
        self._transactional_count = 0
        self._focused: dict[tuple[DroneId, StateKey], bytes] = {}
        self._watched: dict[DroneId, dict[StateKey, bytes]] = {}
        self._lost: Counter[DroneId] = Counter()
        self.focus: DroneId | None = None
        """The drone whose frames are due at once."""
        self.far: Set[DroneId] = frozenset()
        """Drones that the browser's map does not show."""

    def set_watch_rate(self, rate_hz: float, now: float) -> None:
        """How often the state of drones that are not focused is due."""
        self._watch_period_s = 1.0 / rate_hz
        self._next_beat = min(self._next_beat, now + self._watch_period_s)

    def offer_all(
        self, drone_id: DroneId, state: Sequence[tuple[StateKey, bytes]], transactional: Sequence[bytes] = ()
    ) -> bool:
        """Takes tagged frames of one drone, each kind in order. True if the sender must look again: something is due, a
        beat is set."""
        recheck = False
        if transactional:
            self._queue(drone_id, transactional)
            recheck = True
        if not state:
            return recheck
        if drone_id == self.focus:
            for key, tagged in state:
                if len(self._focused) < MAX_STATE_KINDS or (drone_id, key) in self._focused:
                    self._focused[drone_id, key] = tagged
                else:
                    self._lost[drone_id] += 1
            return True
        kinds = self._watched.get(drone_id)
        if kinds is None:
            recheck = recheck or not self._watched
            kinds = self._watched[drone_id] = {}
        for key, tagged in state:
            if key in kinds or len(kinds) < MAX_STATE_KINDS:
                kinds[key] = tagged
            else:
                self._lost[drone_id] += 1
        return recheck

    def offer_at_once(
        self, drone_id: DroneId, state: Sequence[tuple[StateKey, bytes]], transactional: Sequence[bytes]
    ) -> None:
        """Takes tagged frames of one drone that are due at once, because they waited for their beat elsewhere."""
        if transactional:
            self._queue(drone_id, transactional)
        for key, tagged in state:
            if len(self._focused) < MAX_AT_ONCE or (drone_id, key) in self._focused:
                self._focused[drone_id, key] = tagged
            else:
                self._lost[drone_id] += 1

    def offer(self, drone_id: DroneId, key: StateKey | None, tagged: bytes) -> bool:
        """`offer_all` of one frame; `key` None: it is transactional."""
        return self.offer_all(drone_id, (), (tagged,)) if key is None else self.offer_all(drone_id, ((key, tagged),))

    def _queue(self, drone_id: DroneId, tagged: Sequence[bytes]) -> None:
        queue = self._transactional.get(drone_id)
        if queue is None:
            queue = self._transactional[drone_id] = deque()
        queue.extend(tagged)
        self._transactional_count += len(tagged)
        while self._transactional_count > MAX_TRANSACTIONAL:
            self._lose_one(drone_id)

    def lose(self, drone_id: DroneId, count: int) -> None:
        """Transactional frames of this drone were lost earlier: report that to the browser."""
        self._lost[drone_id] += count

    def _lose_one(self, offered: DroneId) -> None:
        queues = self._transactional
        longest = offered
        if len(queues[offered]) * len(queues) < self._transactional_count:  # it has less than its share
            longest = max(queues, key=lambda drone_id: len(queues[drone_id]))
        queues[longest].popleft()
        self._transactional_count -= 1
        self._lost[longest] += 1

    def forget(self, drone_id: DroneId) -> None:
        """Throws away all that waits of a drone: this browser may not see it any more."""
        self._watched.pop(drone_id, None)
        self._lost.pop(drone_id, None)
        self._focused = {key: frame for key, frame in self._focused.items() if key[0] != drone_id}
        self._transactional_count -= len(self._transactional.pop(drone_id, ()))
        self.far = self.far - {drone_id}
        if self.focus == drone_id:
            self.focus = None

    def take(self, now: float) -> list[bytes]:
        """Tagged frames that are due, transactional ones first, those of each drone in order. Empty if nothing is."""
        taken: list[bytes] = []
        if self._transactional_count:
            for queue in self._transactional.values():
                taken.extend(queue)
            self._transactional.clear()
            self._transactional_count = 0
        if self._focused:
            taken.extend(self._focused.values())
            self._focused.clear()
        if now >= self._next_beat:
            self._next_beat = max(self._next_beat + self._watch_period_s, now)
            self._take_watched(taken, now)
        return taken

    def _take_watched(self, taken: list[bytes], now: float) -> None:
        watched, far = self._watched, self.far
        if far and now < self._next_far_beat:
            self._watched = {drone_id: kinds for drone_id, kinds in watched.items() if drone_id in far}
            for drone_id, kinds in watched.items():
                if drone_id not in far:
                    taken.extend(kinds.values())
            return
        if not far.isdisjoint(watched):
            self._next_far_beat = now + FAR_PERIOD_S
        for kinds in watched.values():
            taken.extend(kinds.values())
        watched.clear()

    def take_lost(self) -> dict[DroneId, int]:
        """Frames dropped since the last call, per drone."""
        if not self._lost:
            return {}
        lost, self._lost = dict(self._lost), Counter()
        return lost

    def next_beat(self) -> float | None:
        """When state is due next, or None while none waits."""
        return self._next_beat if self._watched else None

    def waiting(self) -> tuple[int, int]:
        """(transactional frames, state frames) that wait at this moment."""
        state = len(self._focused) + sum(len(kinds) for kinds in self._watched.values())
        return self._transactional_count, state
