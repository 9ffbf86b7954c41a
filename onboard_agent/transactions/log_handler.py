"""Handler for flight logs: lists them, reads one at a time and sends it to the tower. I/O only by file and sender.

Rules, each tested:
- Logs are read only while the drone is disarmed: autopilots send none in flight, and a log upload would delay sticks.
- Data already read is kept until the tower has the log: a new request for the same log resumes the reading.
- After a reboot the log is looked up again before the reading continues.
- The autopilot is always notified at the end, because it may write no logs until then.
- A log is read by MAVLink FTP where the autopilot announces it and its file is found, else by LOG_REQUEST_DATA. What
  FTP does not read to its end, LOG_REQUEST_DATA goes on with; what it read wrong is read again.
"""

from enum import StrEnum
from typing import Final

from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.transactions.file_frames import FileFrames, read_answer
from onboard_agent.transactions.file_sending import FileSender, NotSent, Sending
from onboard_agent.transactions.handler import Around
from onboard_agent.transactions.log_download import LogDownload, LogNotRead
from onboard_agent.transactions.log_file_read import DAMAGED, LogFileRead
from onboard_agent.transactions.log_file_search import LogFileSearch
from onboard_agent.transactions.log_frames import LOGS_FAST, LOGS_NARROW, LogFrames, LogPace
from onboard_agent.transactions.log_listing import LogListing, LogsListed, LogsNotListed
from onboard_agent.transactions.log_store import LogStore
from onboard_agent.transactions.transaction_run import TransactionRun
from wire.autopilots.registry import FAMILIES
from wire.dialect import decode, mavlink
from wire.frames import message_id, source
from wire.transactions import (
    MAX_LOGS,
    LogDownloadWork,
    LogEntry,
    LogListWork,
    Outcome,
    Transaction,
    TransactionToTower,
)

COMPONENT: Final = mavlink.MAV_COMP_ID_ONBOARD_COMPUTER3
"""Answers to it cannot be mistaken for those of parameters or metadata."""
SESSION: Final = 193

ARMED: Final = "The drone is armed. Logs are read on the ground only, when it is disarmed."


class Phase(StrEnum):
    """The current step. `done` and `total` of its progress count logs when listing, else bytes."""

    LISTING = "listing"
    READING = "reading"
    SENDING = "sending"


class LogHandler:
    """A TransactionHandler."""

    works = (LogListWork, LogDownloadWork)
    hears = frozenset(
        {
            mavlink.MAVLINK_MSG_ID_LOG_ENTRY,
            mavlink.MAVLINK_MSG_ID_LOG_DATA,
            mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION,
            mavlink.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL,
        }
    )

    def __init__(self, maker: FrameMaker, store: LogStore, sender: FileSender) -> None:
        self._maker = maker
        self._store = store
        self._sender = sender
        self._run: TransactionRun | None = None
        self._wanted: int | None = None
        """The log to read; None: only list the logs."""
        self._system = 0
        self._talk: LogFrames | None = None
        self._pace: LogPace = LOGS_FAST
        self._at: LogListing | LogFileSearch | LogFileRead | LogDownload | None = None
        """None while the file is sent to the tower."""
        self._sending_bytes = 0
        self._by_files = False
        """Whether the log was read by MAVLink FTP, and its checksum compared."""
        self._log: LogEntry | None = None
        """The log that is being read."""
        self._roots: tuple[bytes, ...] = ()
        self._has_files: bool | None = None
        """Whether this autopilot announces MAVLink FTP; None: not known."""
        self._sequence = 0
        """The next one for MAVLink FTP."""
        self._out: list[bytes] = []
        self._reports: list[TransactionToTower] = []

    # TransactionHandler.

    def autopilot_came(self, around: Around, now: float) -> None:
        """The autopilot may have rebooted and renumbered its logs: looks the log up again."""
        if self._system not in (0, around.system_id):
            self._has_files = None
        if self._talk is not None and self._at is not None:
            self._leave_file()
            self._at = LogListing(self._talk, self._pace, only=self._wanted)

    def begin(self, transaction: Transaction, around: Around | None, now: float) -> None:
        """Starts a listing or a download."""
        run = TransactionRun(transaction, now)
        if around is None or not around.heard:
            self._reports.append(run.result(Outcome.REFUSED, "No heartbeat from the autopilot."))
        elif self._run is not None:
            self._reports.append(run.result(Outcome.REFUSED, "Busy: a log is being read, or the list of them."))
        elif around.armed:
            self._reports.append(run.result(Outcome.REFUSED, ARMED))
        else:
            work = transaction.work
            self._run = run
            self._wanted = work.log_id if isinstance(work, LogDownloadWork) else None
            self._system = around.system_id
            self._talk = LogFrames(self._maker, vehicle_system_id=around.system_id)
            self._pace = LOGS_NARROW if around.narrow_line else LOGS_FAST
            family = FAMILIES.get(around.autopilot_kind)
            self._roots = family.log_folders if family is not None else ()
            self._by_files = False
            self._at = LogListing(self._talk, self._pace, only=self._wanted)

    def cancel(self, transaction_id: int, now: float) -> None:
        """Ends it at once."""
        if self._run is not None and self._run.id == transaction_id:
            self._end(Outcome.CANCELLED, f"It was cancelled. {self._what_is_left}")

    def epoch_changed(self, epoch: int, now: float) -> None:
        """Does nothing: logs do not depend on who has the controls."""

    def receive(self, frame: bytes, now: float) -> bool:
        """Returns True for a requested log entry or piece."""
        at, kind = self._at, message_id(frame)
        if kind == mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION:
            version = decode(frame)
            if version is not None and source(frame)[1] == 1:
                self._has_files = bool(version.capabilities & mavlink.MAV_PROTOCOL_CAPABILITY_FTP)
            return False
        if at is None or source(frame) != (self._system, 1):
            return False
        if kind == mavlink.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL:
            return self._heard_file(frame, now)
        if isinstance(at, LogFileSearch | LogFileRead):
            return False
        is_entry = kind == mavlink.MAVLINK_MSG_ID_LOG_ENTRY
        if is_entry is not isinstance(at, LogListing):
            return False
        message = decode(frame)
        return message is not None and at.receive(message, now)

    def due(self, around: Around, now: float) -> list[bytes]:
        """Frames to send to the autopilot now."""
        if self._run is not None:
            if around.armed:
                self._end(Outcome.FAILED, f"{ARMED} {self._what_is_left}")
            elif now >= self._run.deadline:
                self._end(Outcome.TIMED_OUT, f"It timed out. {self._what_is_left}")
            else:
                self._go_on(self._run, now)
        out, self._out = self._out, []
        return out

    def reports(self) -> list[TransactionToTower]:
        """Returns the messages for the tower once, in order."""
        reports, self._reports = self._reports, []
        return reports

    def resend(self) -> None:
        """Does nothing: logs have no state to report."""

    # Internals.

    def _go_on(self, run: TransactionRun, now: float) -> None:
        at = self._at
        if at is None:
            self._check_sending(run, now)
            return
        self._out += at.due(now)
        if isinstance(at, LogFileSearch):
            if at.ended:
                self._searched(at)
        elif at.end is None:
            phase = Phase.LISTING if isinstance(at, LogListing) else Phase.READING
            self._reports += run.progress(phase, *at.progress, now)
        elif isinstance(at.end, LogsNotListed):
            self._end(Outcome.FAILED, f"The logs cannot be listed: {at.end.why}.")
        elif isinstance(at.end, LogsListed):
            self._listed(at.end)
        elif isinstance(at.end, LogNotRead) and isinstance(at, LogFileRead):
            self._leave_file()
            if at.end.why == DAMAGED:
                self._store.remove()
            self._begin_by_messages()
        elif isinstance(at.end, LogNotRead):
            self._end(Outcome.FAILED, f"The log was not read to its end: {at.end.why}. {self._what_is_left}")
        else:
            self._read(run, at.end.size)

    def _listed(self, end: LogsListed) -> None:
        if self._wanted is not None:
            wanted = next((log for log in end.logs if log.log_id == self._wanted), None)
            self._begin_download(wanted)
            return
        count = len(end.logs)
        how_many = "is 1 log" if count == 1 else f"are {count or 'no'} logs"
        outcome, words = Outcome.DONE, f"There {how_many} on board."
        if end.missing:
            outcome = Outcome.FAILED
            words = f"The autopilot listed {len(end.logs)} of its {len(end.logs) + end.missing} logs."
        self._end(outcome, words, logs=end.logs[:MAX_LOGS])

    def _begin_download(self, log: LogEntry | None) -> None:
        assert self._talk is not None
        if log is None or not log.size_bytes:
            self._end(Outcome.FAILED, f"The autopilot has no log {self._wanted}, or an empty one.")
            return
        self._log = log
        if self._has_files and self._roots:
            self._at = LogFileSearch(
                self._files,
                self._pace,
                roots=self._roots,
                size=log.size_bytes,
                session=SESSION,
                sequence=self._sequence,
            )
        else:
            self._begin_by_messages()

    def _searched(self, search: LogFileSearch) -> None:
        assert self._log is not None
        self._sequence = search.sequence + 1 & 0xFFFF
        have = None if search.path is None else self._open(self._log)
        if self._run is None:
            return
        if search.path is None or have is None:
            self._begin_by_messages()
            return
        self._at = LogFileRead(
            self._files,
            self._pace,
            self._store,
            path=search.path,
            size=self._log.size_bytes,
            have=have,
            session=SESSION,
            sequence=self._sequence,
        )

    def _begin_by_messages(self) -> None:
        assert self._talk is not None and self._log is not None
        have, log = self._open(self._log), self._log
        if have is not None:
            self._at = LogDownload(
                self._talk, self._pace, self._store, log_id=log.log_id, size=log.size_bytes, have=have
            )

    def _open(self, log: LogEntry) -> int | None:
        """None: it cannot be kept, and that was the end."""
        try:
            return self._store.open(log)
        except OSError as error:
            self._end(Outcome.FAILED, f"The log cannot be kept beside the autopilot: {error.strerror or error}.")
            return None

    @property
    def _files(self) -> FileFrames:
        return FileFrames(self._maker, vehicle_system_id=self._system, component=COMPONENT)

    def _heard_file(self, frame: bytes, now: float) -> bool:
        message = decode(frame)
        answer = None if message is None else read_answer(message, self._system, COMPONENT)
        if answer is not None and isinstance(self._at, LogFileSearch | LogFileRead):
            self._at.receive(answer, now)
        return answer is not None

    def _leave_file(self) -> None:
        if isinstance(self._at, LogFileRead):
            self._out += self._at.leave()
        if isinstance(self._at, LogFileRead | LogFileSearch):
            self._sequence = self._at.sequence + 1 & 0xFFFF

    def _read(self, run: TransactionRun, size: int) -> None:
        assert self._talk is not None
        self._out.append(self._talk.enough())
        self._by_files = isinstance(self._at, LogFileRead) and self._at.is_checked
        self._leave_file()
        self._at = None
        self._sending_bytes = size
        self._sender.begin(run.id, self._store.path)

    def _check_sending(self, run: TransactionRun, now: float) -> None:
        state = self._sender.state
        if isinstance(state, Sending):
            self._reports += run.progress(Phase.SENDING, state.done, self._sending_bytes, now)
        elif isinstance(state, NotSent):
            words = f"The log was read, but the tower refuses it: {state.why}. {self._what_is_left}"
            self._end(Outcome.FAILED, words)
        else:
            self._store.remove()
            how = ", with the checksum that the autopilot has" if self._by_files else ""
            self._end(Outcome.DONE, f"The log was read and sent: {self._sending_bytes} bytes{how}.")

    @property
    def _what_is_left(self) -> str:
        if self._wanted is None or isinstance(self._at, LogListing | LogFileSearch):
            return "Nothing was read."
        return "The drone keeps what was read. Fetch the log again to continue from there."

    def _end(self, outcome: Outcome, words: str, *, logs: tuple[LogEntry, ...] | None = None) -> None:
        assert self._run is not None and self._talk is not None
        if self._at is None:
            self._sender.stop()
        else:
            self._leave_file()
            self._out.append(self._talk.enough())
        self._reports.append(self._run.result(outcome, words, logs=logs))
        self._run = self._at = None
