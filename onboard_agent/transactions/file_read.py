"""Reads a file from the autopilot over MAVLink FTP, several blocks at a time. No I/O; takes `now`.

Rules, each tested:
- Blocks are requested one by one, not as a burst: ArduPilot sends bursts at a third of the line's nominal speed.
- All blocks have the same size: ArduPilot pads a parameter file so that no value spans two blocks.
- A lost block is requested again after about a round trip; a block that is lost too often ends the reading.
- The file ends with a block that is not full, or with the autopilot's end-of-file error.
- If our own session was left open, it is closed and opened again; sessions of others are left alone.
"""

from typing import Final

from onboard_agent.transactions.answer_time import AnswerTime
from onboard_agent.transactions.file_frames import MAX_BLOCK_BYTES, FileAnswer, FileFrames, Nack, Op

SESSION: Final = 191
"""Our session. Ground stations do not begin with this number, so their reset does not end our reading."""
OPEN_TRIES: Final = 3
BLOCK_TRIES: Final = 8
MAX_FILE_BYTES: Final = 1 << 18


class FileRead:
    """Call `due` at each tick and after each `receive`, until `end` or `why_not` is set."""

    def __init__(self, talk: FileFrames, name: bytes, *, at_once: int, answer_s: float) -> None:
        """`at_once`: blocks requested at the same time. `answer_s`: the longest wait for one answer."""
        self._talk = talk
        self._name = name
        self._at_once = at_once
        self._answers = AnswerTime(answer_s)
        self._sequence = 0
        self._session = SESSION
        self._is_open = False
        self._close_first = self._was_left_open = False
        self._open_asked = 0
        self._again_at = float("-inf")
        self._asked: dict[int, tuple[int, float]] = {}
        """By sequence of the answer: the requested offset, and when it was requested."""
        self._waiting: dict[int, tuple[int, float]] = {}
        """By offset: the number of requests, and the time until which to wait for an answer."""
        self._blocks: dict[int, bytes] = {}
        self._next_offset = 0
        self._size = MAX_FILE_BYTES
        self._said_goodbye = False
        self.end: bytes | None = None
        """The complete file."""
        self.why_not: str | None = None

    @property
    def received_bytes(self) -> int:
        """Bytes received so far."""
        return sum(map(len, self._blocks.values()))

    @property
    def head(self) -> bytes:
        """The first block, empty until it arrives."""
        return self._blocks.get(0, b"")

    def receive(self, answer: FileAnswer, now: float) -> None:
        """Takes an answer of the autopilot."""
        if self._over or answer.sequence not in self._asked:
            return
        offset, asked_at = self._asked.pop(answer.sequence)
        if not self._is_open:
            self._opened(answer, now - asked_at)
        elif offset in self._waiting:
            self._answers.measured(now - asked_at)
            self._block(offset, answer)

    def due(self, now: float) -> list[bytes]:
        """Frames to send now."""
        if self._over:
            return self._goodbye()
        if not self._is_open:
            return self._open(now)
        out: list[bytes] = []
        for offset, (tries, until) in list(self._waiting.items()):
            if now < until:
                continue
            if tries >= BLOCK_TRIES:
                self.why_not = "a block of the file is lost each time"
                return self._goodbye()
            out.append(self._ask_block(offset, tries, now))
        while len(self._waiting) < self._at_once and self._next_offset < self._size:
            out.append(self._ask_block(self._next_offset, 0, now))
            self._next_offset += MAX_BLOCK_BYTES
        return out

    def give_up(self) -> None:
        """Abandons the reading: the next `due` closes the session."""
        if not self._over:
            self.why_not = "it was given up"

    # Internals.

    @property
    def _over(self) -> bool:
        return self.end is not None or self.why_not is not None

    def _open(self, now: float) -> list[bytes]:
        if now < self._again_at:
            return []
        if self._open_asked >= OPEN_TRIES:
            self.why_not = "the autopilot does not answer"
            return []
        self._open_asked += 1
        self._again_at = now + self._answers.wait_s(self._open_asked)
        out: list[bytes] = []
        if self._close_first:
            self._close_first = False
            out.append(self._talk.ask(Op.TERMINATE, sequence=self._sequence, session=self._session))
            self._sequence += 1
        # The sequence stays the same on each try: an autopilot that has opened the session repeats its answer.
        self._asked = {self._sequence + 1: (0, now)}
        out.append(self._talk.ask(Op.OPEN_TO_READ, sequence=self._sequence, session=self._session, data=self._name))
        return out

    def _opened(self, answer: FileAnswer, took_s: float) -> None:
        if answer.code is None:
            if self._open_asked == 1:
                self._answers.measured(took_s)
            self._is_open, self._session = True, answer.session
        elif answer.code == Nack.FAIL and not self._was_left_open:
            self._close_first = self._was_left_open = True
            self._open_asked, self._again_at = 0, float("-inf")
            self._sequence += 1
        else:
            self.why_not = f"the autopilot refuses (MAVLink FTP error {answer.code})"

    def _ask_block(self, offset: int, tries: int, now: float) -> bytes:
        self._waiting[offset] = (tries + 1, now + self._answers.wait_s(tries + 1))
        self._sequence = self._sequence + 1 & 0xFFFF
        self._asked[self._sequence + 1 & 0xFFFF] = (offset, now)
        return self._talk.ask(
            Op.READ, sequence=self._sequence, session=self._session, offset=offset, size=MAX_BLOCK_BYTES
        )

    def _block(self, offset: int, answer: FileAnswer) -> None:
        if answer.code is not None and answer.code != Nack.END_OF_FILE:
            self.why_not = f"the autopilot cannot read it (MAVLink FTP error {answer.code})"
            return
        del self._waiting[offset]
        if answer.code is None:
            self._blocks[offset] = answer.data
        if answer.code is not None or len(answer.data) < MAX_BLOCK_BYTES:
            self._size = min(self._size, offset + (0 if answer.code is not None else len(answer.data)))
            self._waiting = {one: asked for one, asked in self._waiting.items() if one < self._size}
        if self._size < MAX_FILE_BYTES and not self._waiting and self._next_offset >= self._size:
            whole = b"".join(self._blocks[one] for one in sorted(self._blocks))[: self._size]
            if len(whole) == self._size:
                self.end = whole
            else:
                self.why_not = "the file is shorter than one of its blocks says"
        elif self._next_offset >= MAX_FILE_BYTES and not self._waiting:
            self.why_not = "the file is too large"

    def _goodbye(self) -> list[bytes]:
        """Closes the session, once. If the request is lost, the autopilot closes the session after a silence."""
        if self._said_goodbye or not self._is_open:
            return []
        self._said_goodbye = True
        return [self._talk.ask(Op.TERMINATE, sequence=self._sequence + 1, session=self._session)]
