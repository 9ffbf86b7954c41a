"""Thins telemetry to the tower: only the newest of each state message, no more often than the profile allows. No I/O.

Rules:
- In `full`, everything passes at once and unchanged.
- Otherwise a state frame waits for the next beat of BEAT_S, and a newer frame of the same kind replaces it meanwhile.
  Frames that are due leave together.
- HEARTBEAT and everything that is not state passes at once and in order, in every profile. An unknown message is not
  state; it is counted, to explain a stream that does not get thinner.
"""

from collections import Counter
from typing import Final

from wire.dialect import mavlink
from wire.frames import is_known
from wire.state_messages import StateKey, state_key
from wire.stream_profiles import BEAT_S, StreamProfile, beats_between

MAX_KINDS: Final = 1024
"""Maximum number of kinds (sender, message, instance); several times what any drone has. Further kinds are dropped and
counted, because a companion computer has little memory, and a thousand kinds are noise."""

FORGET_EVERY_BEATS: Final = 100
"""Kinds that have not been sent for this long are forgotten; longer than the slowest rate."""

_NEVER: Final = -1_000_000
_HEARTBEAT: Final = mavlink.MAVLINK_MSG_ID_HEARTBEAT


class _Kind:
    """One message of one sender: the frame that waits, and the beat of the last sent frame."""

    __slots__ = ("sent_at_beat", "waiting")

    def __init__(self) -> None:
        self.waiting: bytes | None = None
        self.sent_at_beat = _NEVER


class Thinner:
    """Pass frames to `admit` and send what it returns. Call `due` at each tick and send what it returns."""

    def __init__(self) -> None:
        self.profile = StreamProfile.FULL
        self.by_hand = False
        """Flown by hand through the tower: messages that a pilot needs are sent more often."""
        self.counts: Counter[str] = Counter()
        """Dropped frames, by reason."""
        self.unknown_passed = 0
        """Frames of messages that the dialect lacks, passed on while thinning."""
        self._kinds: dict[StateKey, _Kind] = {}
        self._beat = 0
        self._forgot_at_beat = 0

    def admit(self, frames: list[bytes]) -> list[bytes]:
        """Returns the autopilot's frames that go now. The others wait, or a newer frame has replaced them."""
        if self.profile is StreamProfile.FULL:
            return self._all_that_wait() + frames if self._kinds else frames
        passed: list[bytes] = []
        for frame in frames:
            key = state_key(frame)
            if key is None or key[2] == _HEARTBEAT:
                passed.append(frame)
                if not is_known(frame):
                    self.unknown_passed += 1
            else:
                self._wait(key, frame)
        return passed

    def _wait(self, key: StateKey, frame: bytes) -> None:
        kind = self._kinds.get(key)
        if kind is None:
            if len(self._kinds) >= MAX_KINDS:
                self.counts["too many kinds of state"] += 1
                return
            kind = self._kinds[key] = _Kind()
        if kind.waiting is not None:
            self.counts["thinned"] += 1
        kind.waiting = frame

    def due(self, now: float) -> list[bytes]:
        """Returns the frames whose beat is due."""
        if self.profile is StreamProfile.FULL:
            return self._all_that_wait()
        beat = int(now / BEAT_S)
        if beat == self._beat:
            return []
        self._beat = beat
        frames: list[bytes] = []
        for key, kind in self._kinds.items():
            if kind.waiting is None:
                continue
            # Slow kinds share their beats: all kinds at 1 Hz go on the same beat, in one datagram.
            every = beats_between(self.profile, key[2], by_hand=self.by_hand)
            if beat // every != kind.sent_at_beat // every:
                frames.append(kind.waiting)
                kind.waiting = None
                kind.sent_at_beat = beat
        if beat - self._forgot_at_beat >= FORGET_EVERY_BEATS:
            self._forget(beat)
        return frames

    def _all_that_wait(self) -> list[bytes]:
        """Releases all waiting frames on a change to `full`, so that no old frame follows a newer one."""
        frames = [kind.waiting for kind in self._kinds.values() if kind.waiting is not None]
        self._kinds.clear()
        return frames

    def _forget(self, beat: int) -> None:
        self._forgot_at_beat = beat
        old = beat - FORGET_EVERY_BEATS
        self._kinds = {
            key: kind for key, kind in self._kinds.items() if kind.waiting is not None or kind.sent_at_beat > old
        }
