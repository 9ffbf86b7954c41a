"""Reads all parameters in the fastest way that the autopilot offers: its parameter file, else its list. No I/O.

Rules, each tested:
- The file is requested if the autopilot has files. The result is a complete table or nothing.
- If the file is not available, or twice invalid (it may change during the reading), the list is read instead, and a new
  reading starts with the file again.
- A value received while the file is read is newer than the file.
"""

from typing import Final

from onboard_agent.transactions.file_frames import FileAnswer, FileFrames
from onboard_agent.transactions.file_read import FileRead
from onboard_agent.transactions.parameter_encoding import ParamValue
from onboard_agent.transactions.parameter_file import FILE_NAME, BadParameterFile, read_count, read_parameter_file
from onboard_agent.transactions.parameter_frames import Pace, ParameterFrames
from onboard_agent.transactions.parameter_listing import Listed, ListingFailed, ParameterListing, Unchanged
from wire.parameters import Parameter, by_name

FILE_TRIES: Final = 2
USUAL_ENTRY_BYTES: Final = 12
"""Typical size of one parameter in the file, to estimate progress."""


class ParameterReading:
    """Call `due` at each tick and after each `receive` and `heard_file`, until `end` is set."""

    def __init__(
        self, talk: ParameterFrames, pace: Pace, *, files: FileFrames | None, known_hash: bytes | None
    ) -> None:
        """`files`: None if the autopilot has no files. `known_hash`: as for ParameterListing."""
        self._talk = talk
        self._pace = pace
        self._files = files
        self._file_tries = 0
        self._newer: dict[str, Parameter] = {}
        self._listing: ParameterListing | None = None
        self._file: FileRead | None = None
        self.end: Listed | Unchanged | ListingFailed | None = None
        if files is None:
            self._listing = ParameterListing(talk, pace, known_hash=known_hash)
        else:
            self._file = self._open(files)

    @property
    def progress(self) -> tuple[int, int]:
        """Parameters received, and in total (0: not known yet)."""
        if self._listing is not None:
            return self._listing.progress
        if self._file is None:
            return 0, 0
        total = read_count(self._file.head)
        return min(total, self._file.received_bytes // USUAL_ENTRY_BYTES), total

    def receive(self, received: ParamValue, now: float) -> bool:
        """Takes a PARAM_VALUE, whoever requested it. Returns whether it added to the list being read."""
        if self._listing is None:
            if received.parameter is not None:
                self._newer[received.name] = received.parameter
            return False
        before, _ = self._listing.progress
        self._listing.receive(received, now)
        return self._listing.progress[0] > before

    def heard_file(self, answer: FileAnswer, now: float) -> None:
        """Takes an answer about the file."""
        if self._file is not None:
            self._file.receive(answer, now)

    def due(self, now: float) -> list[bytes]:
        """Frames to send now."""
        out: list[bytes] = []
        if self._file is not None:
            out = self._file.due(now)
            if self._file.end is not None:
                self._unpack(self._file.end)
            elif self._file.why_not is not None:
                self._list()
        if self._listing is not None and self.end is None:
            out += self._listing.due(now)
            self.end = self._listing.end
        return out

    # Internals.

    def _open(self, files: FileFrames) -> FileRead:
        self._file_tries += 1
        self._newer.clear()
        return FileRead(files, FILE_NAME, at_once=self._pace.blocks_at_once, answer_s=self._pace.answer_s)

    def _unpack(self, data: bytes) -> None:
        try:
            read = read_parameter_file(data)
        except BadParameterFile:
            if self._file_tries < FILE_TRIES and self._files is not None:
                self._file = self._open(self._files)
            else:
                self._list()
            return
        self._file = None
        values = {one.name: one for one in read.parameters}
        values |= {name: one for name, one in self._newer.items() if name in values}
        self.end = Listed(by_name(values.values()), read.count)

    def _list(self) -> None:
        self._file = None
        self._listing = ParameterListing(self._talk, self._pace)
