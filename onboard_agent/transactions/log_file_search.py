"""Finds the file of a flight log in the autopilot's directories by MAVLink FTP. No I/O; takes `now`.

LOG_ENTRY has number, size and beginning of a log, but no name; a directory has name and size. So the file is the one of
that size, and none if there are several. Rules, each tested:
- The first directory that exists is searched, with those in it.
- Directories and files are bounded. What is lost is asked for again; a silence ends the search without a file.
"""

from collections import deque
from typing import Final

from onboard_agent.transactions.file_frames import FileAnswer, FileFrames, Nack, Op
from onboard_agent.transactions.log_frames import LogPace

_ENDINGS: Final = (b".bin", b".ulg")
MAX_DIRECTORIES: Final = 200
MAX_ENTRIES: Final = 5000
_TRIES: Final = 3
_MAX_PATH_BYTES: Final = 200


class LogFileSearch:
    """Call `due` at each tick and after each `receive`, until `ended`. Then `path` is the file, or None."""

    def __init__(
        self, talk: FileFrames, pace: LogPace, *, roots: tuple[bytes, ...], size: int, session: int, sequence: int
    ) -> None:
        """`size`: of the log. `sequence`: the first to use; later the last one used, or the next."""
        self._talk = talk
        self._pace = pace
        self._roots = deque(roots)
        self._size = size
        self._session = session
        self.sequence = sequence
        self._directories: deque[bytes] = deque()
        self._seen_directories = 0
        self._entries = 0
        self._here: bytes | None = None
        self._offset = 0
        self._in_root = True
        self._tries = 0
        self._again_at = float("-inf")
        self._found: list[bytes] = []
        self.ended = False

    @property
    def path(self) -> bytes | None:
        """The file, if exactly one has the size."""
        return self._found[0] if len(self._found) == 1 else None

    def receive(self, answer: FileAnswer, now: float) -> None:
        """Takes an answer of the autopilot."""
        if self.ended or self._here is None or not self._tries or answer.sequence != self.sequence + 1 & 0xFFFF:
            return
        self._next_request()
        if answer.code is None and answer.data.strip(b"\0"):
            self._in_root = False
            self._read(answer.data)
        elif answer.code is not None and answer.code != Nack.END_OF_FILE and self._in_root:
            self._here = None  # the next root
        else:
            self._roots.clear()
            self._here = None

    def due(self, now: float) -> list[bytes]:
        """Frames to send now."""
        if self.ended or now < self._again_at:
            return []
        if self._here is None and not self._go_on():
            self.ended = True
            return []
        if self._tries >= _TRIES:
            self._found.clear()
            self.ended = True
            return []
        self._tries += 1
        self._again_at = now + self._pace.first_s
        return [
            self._talk.ask(
                Op.LIST, sequence=self.sequence, session=self._session, offset=self._offset, data=self._here or b""
            )
        ]

    def _go_on(self) -> bool:
        if self._directories:
            self._here, self._in_root = self._directories.popleft(), False
        elif self._roots:
            self._here, self._in_root = self._roots.popleft(), True
        else:
            return False
        self._offset = 0
        return True

    def _next_request(self) -> None:
        self.sequence = self.sequence + 1 & 0xFFFF
        self._tries, self._again_at = 0, float("-inf")

    def _read(self, data: bytes) -> None:
        self._roots.clear()
        for entry in filter(None, data.split(b"\0")):  # ArduPilot writes two zeros after each
            self._offset += 1
            self._entries += 1
            name, _, size = entry[1:].partition(b"\t")
            path = (self._here or b"") + b"/" + name
            if len(path) > _MAX_PATH_BYTES or self._entries > MAX_ENTRIES:
                continue
            if entry[:1] == b"F" and size == b"%d" % self._size and name.lower().endswith(_ENDINGS):
                self._found.append(path)
            elif entry[:1] == b"D" and name.strip(b".") and self._seen_directories < MAX_DIRECTORIES:
                self._seen_directories += 1
                self._directories.append(path)
        if self._entries > MAX_ENTRIES:
            self._found.clear()
            self._directories.clear()
            self._here = None
