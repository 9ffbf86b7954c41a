"""Reads one flight log by MAVLink FTP in bursts, and compares its checksum with the autopilot's. No I/O but the file's;
takes `now`.

Rules, each tested:
- The file has no gaps: data is appended in order. What overtakes a lost piece waits for it, within a bound.
- A burst ends by its mark, at the end of the file, or after a silence. Then few lost pieces are read one by one, and
  many by another burst.
- A file of another size than the list says is not read. The checksum is asked for after the session was closed; an
  autopilot that cannot compute it is believed.
- A session that the autopilot has lost is opened again. One of ours that was left open is closed first.
"""

import zlib
from typing import Final, Protocol

from onboard_agent.transactions.answer_time import AnswerTime
from onboard_agent.transactions.file_frames import MAX_BLOCK_BYTES, FileAnswer, FileFrames, Nack, Op
from onboard_agent.transactions.log_download import SENDS_NO_MORE, LogFile, LogNotRead, LogRead
from onboard_agent.transactions.log_frames import LogPace

DAMAGED: Final = "its checksum is not that of the autopilot"
ANOTHER_SIZE: Final = "its file has another size than the list says"

MAX_PIECES: Final = 4096
"""Pieces that wait for a lost one: 1 MB. ArduPilot ends a burst after 2,000."""
MAX_SINGLE: Final = 64
"""More lost pieces than that are asked for by a burst."""
AT_ONCE: Final = 4
"""ArduPilot queues five requests."""
KEEP_BYTES: Final = 64 * 1024
_BURST_SEQUENCES: Final = 0x4000
_OPEN_TRIES: Final = 4
_REOPENINGS: Final = 3
_CHECK_TRIES: Final = 3
_CHECK_S: Final = 10.0
_CHECKED_BYTES_PER_S: Final = 100_000
"""An autopilot reads its card 64 bytes at a time for the checksum."""
_HASH_BYTES: Final = 1 << 20


class KeptLogFile(LogFile, Protocol):
    """Where the log goes, and what is there already."""

    def read(self, offset: int, count: int) -> bytes:
        """Raises OSError."""


class LogFileRead:
    """Call `due` at each tick and after each `receive`, until `end` is set."""

    def __init__(
        self,
        talk: FileFrames,
        pace: LogPace,
        file: KeptLogFile,
        *,
        path: bytes,
        size: int,
        have: int,
        session: int,
        sequence: int,
    ) -> None:
        """`have`: bytes already in the file. `sequence`: the first to use; later the last one used, or the next."""
        self._talk = talk
        self._pace = pace
        self._file = file
        self._path = path
        self._size = size
        self._at = have
        self._have = have
        self._hashed = 0
        self._crc = 0
        self._session = session
        self.sequence = sequence
        self._answers = AnswerTime(pace.first_s)
        self._buffer = bytearray()
        self._pieces: dict[int, bytes] = {}
        self._is_open = False
        self._close_first = self._was_left_open = False
        self._reopened = 0
        self._tries = 0
        self._again_at = float("-inf")
        self._burst: int | None = None
        """The sequence of its request, while it goes on."""
        self._in_vain = 0
        self._single: dict[int, tuple[int, int, float]] = {}
        """By offset: sequence of the latest request, tries, and the time of that request."""
        self._checks = False
        self.is_checked = False
        """The autopilot's checksum is the same."""
        self.end: LogRead | LogNotRead | None = None

    @property
    def progress(self) -> tuple[int, int]:
        """Bytes received, and bytes in total."""
        return min(self._at + sum(map(len, self._pieces.values())), self._size), self._size

    def receive(self, answer: FileAnswer, now: float) -> bool:
        """Takes an answer of the autopilot. Returns whether it was new."""
        if self.end is not None:
            return False
        if self._checks:
            return self._checked(answer)
        if not self._is_open:
            return answer.sequence == self.sequence + 1 & 0xFFFF and self._opened(answer)
        single = next((offset for offset, one in self._single.items() if one[0] + 1 & 0xFFFF == answer.sequence), None)
        in_burst = self._burst is not None and 0 < (answer.sequence - self._burst & 0xFFFF) < _BURST_SEQUENCES
        if answer.session != self._session or (single is None and not in_burst):
            return False
        if single is not None:
            _, tries, asked_at = self._single.pop(single)
            if tries == 1:
                self._answers.measured(now - asked_at)
        if answer.code is not None:
            self._refused(answer.code, in_burst=in_burst)
            return True
        is_new = self._take(answer.offset, answer.data)
        if in_burst:
            self._again_at = now + 2 * self._pace.quiet_s
            if answer.is_last:
                self._burst_over()
        if self._at >= self._size:
            self._complete()
        return is_new

    def due(self, now: float) -> list[bytes]:
        """Frames to send now."""
        if self.end is not None:
            return []
        if self._hashed < self._have:
            self._hash_what_is_there()
            return []
        if self._checks:
            return self._ask_checksum(now)
        if self._at >= self._size:
            self._complete()  # all of it was there
            return self._ask_checksum(now)
        if not self._is_open:
            return self._open(now)
        if self._burst is not None:
            if now < self._again_at:
                return []
            self._burst_over()
        lost = self._lost()
        if not self._pieces or len(lost) > MAX_SINGLE:
            return self._ask_burst(now)
        return self._ask_single(lost, now)

    def leave(self) -> list[bytes]:
        """Abandons it: appends what it has in order, and returns the frames that close the session."""
        self._keep(0)
        if not self._is_open:
            return []
        self._is_open = False
        if self._burst is not None:
            self._burst_over()
        return [self._talk.ask(Op.TERMINATE, sequence=self._next(), session=self._session)]

    # Opening.

    def _open(self, now: float) -> list[bytes]:
        if now < self._again_at:
            return []
        if self._tries >= _OPEN_TRIES:
            self.end = LogNotRead("the autopilot does not open it")
            return []
        out: list[bytes] = []
        if self._close_first:
            self._close_first = False
            out.append(self._talk.ask(Op.TERMINATE, sequence=self._next(), session=self._session))
            self._next()
        self._tries += 1
        self._again_at = now + self._pace.first_s
        # The sequence stays the same on each try: an autopilot that has opened it repeats its answer.
        out.append(self._talk.ask(Op.OPEN_TO_READ, sequence=self.sequence, session=self._session, data=self._path))
        return out

    def _opened(self, answer: FileAnswer) -> bool:
        self._tries, self._again_at = 0, float("-inf")
        if answer.code == Nack.FAIL and not self._was_left_open:
            self._close_first = self._was_left_open = True
        elif answer.code is not None:
            self.end = LogNotRead(f"the autopilot refuses (MAVLink FTP error {answer.code})")
        else:
            self._is_open, self._session = True, answer.session
            if int.from_bytes(answer.data[:4], "little") != self._size:
                self.end = LogNotRead(ANOTHER_SIZE)
        self._next()
        return True

    # Reading.

    def _ask_burst(self, now: float) -> list[bytes]:
        if self._in_vain >= self._pace.tries:
            self.end = LogNotRead(SENDS_NO_MORE)
            return []
        self._in_vain += 1
        self._burst = self._next()
        self._again_at = now + self._pace.first_s
        return [self._ask(Op.BURST, self._burst, self._at)]

    def _burst_over(self) -> None:
        assert self._burst is not None
        self.sequence = self._burst + _BURST_SEQUENCES & 0xFFFF
        self._burst = None

    def _lost(self) -> list[int]:
        """Offsets of the lost blocks before the last piece, at most one more than `MAX_SINGLE`."""
        lost: list[int] = []
        at = self._at
        for begin in sorted(self._pieces):
            while at < begin and len(lost) <= MAX_SINGLE:
                lost.append(at)
                at += MAX_BLOCK_BYTES
            at = max(at, begin + len(self._pieces[begin]))
        return lost

    def _ask_single(self, lost: list[int], now: float) -> list[bytes]:
        self._single = {offset: one for offset, one in self._single.items() if offset in lost}
        out: list[bytes] = []
        for offset in lost:
            _, tries, asked_at = self._single.get(offset, (0, 0, float("-inf")))
            if now < asked_at + self._answers.wait_s(tries) or (not tries and len(self._single) >= AT_ONCE):
                continue
            if tries >= self._pace.tries:
                self.end = LogNotRead(SENDS_NO_MORE)
                return []
            sequence = self._next()
            self._single[offset] = sequence, tries + 1, now
            out.append(self._ask(Op.READ, sequence, offset))
        return out

    def _refused(self, code: int, *, in_burst: bool) -> None:
        if in_burst:
            self._burst_over()
        if code == Nack.END_OF_FILE:
            return  # what is lacking before it is asked for again
        if self._reopened >= _REOPENINGS:
            self.end = LogNotRead(f"the autopilot cannot read it (MAVLink FTP error {code})")
            return
        self._reopened += 1
        self._is_open = False
        self._again_at = float("-inf")
        self._single.clear()

    def _take(self, offset: int, data: bytes) -> bool:
        data = data[: max(self._size - offset, 0)]
        end = offset + len(data)
        if end <= self._at or offset in self._pieces or (offset > self._at and len(self._pieces) >= MAX_PIECES):
            return False
        self._in_vain = 0
        self._pieces[offset] = data
        if offset <= self._at:
            for begin in sorted(self._pieces):
                if begin > self._at:
                    break
                piece = self._pieces.pop(begin)
                if begin + len(piece) > self._at:
                    self._buffer += piece[self._at - begin :]
                    self._at = begin + len(piece)
            self._keep(KEEP_BYTES)
        return True

    def _keep(self, least: int) -> None:
        if len(self._buffer) < max(least, 1):
            return
        data, self._buffer = bytes(self._buffer), bytearray()
        try:
            self._file.append(data)
        except OSError as error:
            self.end = LogNotRead(f"it cannot be kept: {error.strerror or error}")
            return
        self._crc = _crc(data, self._crc)

    # The checksum.

    def _hash_what_is_there(self) -> None:
        """A part in each call, because the agent flies meanwhile."""
        try:
            data = self._file.read(self._hashed, min(_HASH_BYTES, self._have - self._hashed))
        except OSError as error:
            self.end = LogNotRead(f"what was kept cannot be read: {error.strerror or error}")
            return
        if not data:
            self.end = LogNotRead("what was kept is gone")
            return
        self._crc = _crc(data, self._crc)
        self._hashed += len(data)

    def _complete(self) -> None:
        self._keep(0)
        if self.end is None:
            self._checks, self._tries, self._again_at = True, 0, float("-inf")

    def _ask_checksum(self, now: float) -> list[bytes]:
        if self.end is not None or now < self._again_at:
            return []
        if self._tries >= _CHECK_TRIES:
            self.end = LogRead(self._size)
            return []
        out = self.leave()
        if not self._tries:
            self._next()
        self._tries += 1
        self._again_at = now + _CHECK_S + self._size / _CHECKED_BYTES_PER_S
        out.append(self._talk.ask(Op.CHECKSUM, sequence=self.sequence, session=self._session, data=self._path))
        return out

    def _checked(self, answer: FileAnswer) -> bool:
        if not self._tries or answer.sequence != self.sequence + 1 & 0xFFFF:
            return False
        self._next()
        if answer.code is None and len(answer.data) >= 4:
            self.is_checked = int.from_bytes(answer.data[:4], "little") == self._crc
            if not self.is_checked:
                self.end = LogNotRead(DAMAGED)
                return True
        self.end = LogRead(self._size)
        return True

    def _ask(self, op: Op, sequence: int, offset: int) -> bytes:
        return self._talk.ask(op, sequence=sequence, session=self._session, offset=offset, size=MAX_BLOCK_BYTES)

    def _next(self) -> int:
        self.sequence = self.sequence + 1 & 0xFFFF
        return self.sequence


def _crc(data: bytes, begin: int) -> int:
    """CRC-32 as MAVLink FTP has it: it starts with 0, and is not inverted at the end."""
    return zlib.crc32(data, begin ^ 0xFFFFFFFF) ^ 0xFFFFFFFF
