"""Downloads one flight log in windows, and requests lost pieces again. No I/O but the file's; takes `now`.

Rules, each tested:
- The file has no gaps: data is appended one window at a time, when the window is complete.
- A gap is requested when the last request has been answered in full or the data stops; the first gap comes first.
- The autopilot knows where its log ends: a short or empty piece ends the log earlier than the list said.
"""

from dataclasses import dataclass
from typing import Any, Final, Protocol

from onboard_agent.transactions.log_frames import CHUNK, LogFrames, LogPace

SENDS_NO_MORE: Final = "the autopilot sends no more of it"


class LogFile(Protocol):
    """Destination of a log. One at a time."""

    def append(self, data: bytes) -> None:
        """Raises OSError."""


@dataclass(frozen=True, slots=True)
class LogRead:
    """The whole log is in the file."""

    size: int


@dataclass(frozen=True, slots=True)
class LogNotRead:
    """`why`: without a full stop. The data already in the file is valid."""

    why: str


class LogDownload:
    """Call `due` at each tick and after each `receive`, until `end` is set."""

    def __init__(self, talk: LogFrames, pace: LogPace, file: LogFile, *, log_id: int, size: int, have: int) -> None:
        """`size`: from the list. `have`: bytes already in the file, a multiple of CHUNK or the whole log."""
        self._talk = talk
        self._pace = pace
        self._file = file
        self._log_id = log_id
        self._size = size
        self._at = have
        self._pieces: dict[int, bytes] = {}
        """Pieces of the window that begins at `_at`, by offset."""
        self._asked: tuple[int, int] | None = None
        """The requested range: begin and end."""
        self._came = 0
        """Pieces of that range received."""
        self._in_vain = 0
        self._heard = False
        self._check_at = float("-inf")
        self.end: LogRead | LogNotRead | None = None

    @property
    def progress(self) -> tuple[int, int]:
        """Bytes received, and bytes in total."""
        return min(self._at + len(self._pieces) * CHUNK, self._size), self._size

    def receive(self, log_data: Any, now: float) -> bool:
        """Takes a LOG_DATA of the autopilot. Returns whether it was new."""
        if self.end is not None or log_data.id != self._log_id or self._asked is None:
            return False
        at, count = log_data.ofs, min(log_data.count, CHUNK)
        if not self._at <= at < self._window_end or (at - self._at) % CHUNK or at in self._pieces:
            return False
        if count < CHUNK and at + count < self._size:
            self._size = at + count
            self._pieces = {begin: piece for begin, piece in self._pieces.items() if begin < self._size}
        if count:
            self._pieces[at] = bytes(log_data.data[:count])
        self._heard, self._in_vain = True, 0
        begin, end = self._asked[0], min(self._asked[1], self._size)
        self._came += begin <= at < end
        if self._came * CHUNK >= end - begin:
            self._check_at = now
        else:
            self._check_at = now + (self._pace.settle_s if at + CHUNK >= end else self._pace.quiet_s)
        if len(self._pieces) * CHUNK >= self._window_end - self._at:
            self._window_read(now)
        return True

    def due(self, now: float) -> list[bytes]:
        """Frames to send now."""
        if self.end is None and self._at >= self._size:
            self.end = LogRead(self._size)
        if self.end is not None or now < self._check_at:
            return []
        if self._in_vain >= self._pace.tries:
            self.end = LogNotRead(SENDS_NO_MORE)
            return []
        self._in_vain += 1
        begin = self._at
        while begin in self._pieces:
            begin += CHUNK
        end = begin
        while end < self._window_end and end not in self._pieces:
            end += CHUNK
        end = min(end, self._window_end)
        self._asked, self._came = (begin, end), 0
        self._check_at = now + (self._pace.quiet_s if self._heard else self._pace.first_s)
        return [self._talk.ask_data(self._log_id, begin, end - begin)]

    @property
    def _window_end(self) -> int:
        return min(self._at + self._pace.window, self._size)

    def _window_read(self, now: float) -> None:
        data = b"".join(self._pieces[at] for at in sorted(self._pieces))
        try:
            self._file.append(data)
        except OSError as error:
            self.end = LogNotRead(f"it cannot be kept: {error.strerror or error}")
            return
        self._at += len(data)
        self._pieces.clear()
        self._asked = None
        self._check_at = now
