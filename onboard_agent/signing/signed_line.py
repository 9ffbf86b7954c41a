"""Signs what goes to the autopilot, and takes only what it signed. No I/O; takes the time.

Rules, each tested:
- A key that was offered counts with the first heartbeat of the autopilot that it fits: only then is it known that the
  autopilot took it. Until then both keys are good, so a lost answer or a crash locks nobody out.
- A time that is not newer than the last one of the same sender is a replay.
- The time follows the autopilot's where that is ahead: a computer without a clock of its own is heard too.
"""

from typing import Final

from wire.frame_signing import fits, is_signed, sign, stamp_of, ticks_of, without_signature
from wire.frames import source
from wire.own_system import is_autopilot_heartbeat
from wire.signing_key import Signing

UNSIGNED: Final = b""
"""As a key: frames carry no signature."""
LINK_ID: Final = 0
_RECENT_S: Final = 5.0

Keys = tuple[bytes, ...]
"""The key in use, and the one that was offered to the autopilot, if any."""


class SignedLine:
    """`keys`: as kept; none is UNSIGNED. `system_id`: of the own autopilot, if it is known."""

    def __init__(self, keys: Keys = (), system_id: int | None = None) -> None:
        self._keys: Keys = keys or (UNSIGNED,)
        self._system_id = system_id
        self._ticks = 0
        self._newest: dict[tuple[int, int, int], int] = {}
        """Of link, system and component: the time of the newest frame."""
        self._fitting_at = self._wrong_at = float("-inf")

    @property
    def keys(self) -> Keys:
        """To be kept whenever they change."""
        return self._keys

    @property
    def is_plain(self) -> bool:
        """Whether no key is in use or offered, so that frames pass as they are."""
        return self._keys == (UNSIGNED,)

    def offer(self, key: bytes) -> None:
        """A key (or UNSIGNED) is about to be sent to the autopilot."""
        self._keys = (self._keys[0], key)

    def withdraw(self) -> None:
        """The autopilot surely did not take what was offered."""
        self._keys = self._keys[:1]

    def forget(self) -> None:
        """Takes and sends frames without a signature from now on."""
        self._keys = (UNSIGNED,)

    def ticks(self, unix_s: float) -> int:
        """Returns the next time for a signature."""
        self._ticks = max(self._ticks + 1, ticks_of(unix_s))
        return self._ticks

    def sign(self, frame: bytes, unix_s: float) -> bytes:
        """Returns a frame as it goes to the autopilot."""
        key = self._keys[0]
        return sign(frame, key, link_id=LINK_ID, ticks=self.ticks(unix_s)) if key else frame

    def open(self, frames: list[bytes], now: float) -> list[bytes]:
        """Returns those frames that count, without signatures where a key is in use."""
        return [opened for frame in frames if (opened := self._opened(frame, now)) is not None]

    def state(self, now: float) -> Signing:
        """Whether the line is signed, by what came in the last seconds."""
        if not self._keys[0]:
            return Signing.OFF
        is_wrong = now - self._wrong_at < _RECENT_S and now - self._fitting_at >= _RECENT_S
        return Signing.WRONG_KEY if is_wrong else Signing.ON

    def _opened(self, frame: bytes, now: float) -> bytes | None:
        is_heartbeat = is_autopilot_heartbeat(frame)
        for key in self._keys:
            if key and fits(frame, key):
                return self._authentic(frame, key, now, is_heartbeat=is_heartbeat)
        if is_heartbeat and UNSIGNED in self._keys[1:] and not is_signed(frame):
            self.forget()
        if not self._keys[0]:
            return frame
        if is_heartbeat and self._system_id in (None, source(frame)[0]):
            self._wrong_at = now
        return None

    def _authentic(self, frame: bytes, key: bytes, now: float, *, is_heartbeat: bool) -> bytes | None:
        link, ticks = stamp_of(frame)
        sender = (link, *source(frame))
        if ticks <= self._newest.get(sender, -1):
            return None
        self._newest[sender] = ticks
        self._ticks = max(self._ticks, ticks)
        if is_heartbeat:
            self._fitting_at, self._system_id = now, source(frame)[0]
            if key != self._keys[0]:
                self._keys = (key,)
        return without_signature(frame)
