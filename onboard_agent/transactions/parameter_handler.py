"""Handler for the parameters of one autopilot: reads, tracks and writes them for the tower. I/O only by the store.

Rules, each tested:
- Parameters are read once the autopilot has come and flying has what it needs, and again when their number changes; on
  a narrow line not while the drone is flown by hand, and with a known table not while it is armed.
- The remembered table of this autopilot is reported at once, marked as such, until the autopilot has sent its own.
- Every PARAM_VALUE counts, whoever requested it.
- Only one write runs at a time; a second one is refused, not queued. Requests for the table share one reading.
- A tower that was sent this very table, or has it through changes since, is not sent it again for a read request: the
  hash is enough.
- The table is saved only while the drone is disarmed: a slow disk must not delay sticks.
"""

from typing import Final

from onboard_agent.autopilot.own_frames import AGENT_COMPONENT, FrameMaker
from onboard_agent.transactions.file_frames import FileFrames, read_answer
from onboard_agent.transactions.handler import Around
from onboard_agent.transactions.parameter_encoding import HASH_NAME, Encoding, ParamValue, encoding_of, read_param_value
from onboard_agent.transactions.parameter_frames import FAST, NARROW, Pace, ParameterFrames
from onboard_agent.transactions.parameter_listing import Listed, ListingFailed
from onboard_agent.transactions.parameter_memory import (
    ParameterStore,
    Remembered,
    chip_name,
    place_name,
    recall,
    remember,
)
from onboard_agent.transactions.parameter_reading import ParameterReading
from onboard_agent.transactions.parameter_reports import ParameterReports
from onboard_agent.transactions.parameter_write import ParameterWrite
from onboard_agent.transactions.transaction_run import TransactionRun
from wire.autopilots.registry import FAMILIES
from wire.dialect import decode, mavlink
from wire.frames import message_id, source
from wire.parameters import pack_table
from wire.transactions import (
    MAX_PACKED_TABLE_BYTES,
    Outcome,
    ParameterChanged,
    ParametersReadWork,
    ParametersWriteWork,
    ParameterTable,
    Transaction,
    TransactionToTower,
)

AGAIN_AFTER_S: Final = 30.0
"""Delay after a list that could not be read, or whose length has changed again."""
RELIST_AFTER_S: Final = 2.0
SAVE_AFTER_S: Final = 5.0
MAX_READERS: Final = 4
SOON_S: Final = 10.0
"""Other users of the autopilot's files begin nothing this shortly before the parameters are read."""

_NOT_HEARD: Final = "No heartbeat from the autopilot."


class ParameterHandler:
    """A TransactionHandler."""

    works = (ParametersReadWork, ParametersWriteWork)
    hears = frozenset(
        {
            mavlink.MAVLINK_MSG_ID_PARAM_VALUE,
            mavlink.MAVLINK_MSG_ID_PARAM_ERROR,
            mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION,
            mavlink.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL,
        }
    )

    def __init__(self, maker: FrameMaker, store: ParameterStore) -> None:
        self._maker = maker
        self._store = store
        self._system: int | None = None
        self._kind = 0
        self._encoding = Encoding.CAST
        self._name = ""
        """Key of the remembered table."""
        self._recall_at: float | None = None
        self._pace: Pace = FAST
        self._table = ParameterReports()
        self._count = 0
        self._autopilot_hash: bytes | None = None
        self._list_at: float | None = None
        self._listed_at = float("-inf")
        self._listing: ParameterReading | None = None
        self._has_files = False
        """Whether the autopilot announces FTP, and is a kind whose parameter file we know."""
        self._readers: list[TransactionRun] = []
        self._write: ParameterWrite | None = None
        self._writer: TransactionRun | None = None
        self._sent_hash: str | None = None
        """Hash of the table last sent to this tower, as a whole or through changes."""
        self._save_at: float | None = None
        self._now = 0.0
        self._reports: list[TransactionToTower] = []

    # TransactionHandler.

    def autopilot_came(self, around: Around, now: float) -> None:
        """The autopilot is heard for the first time, or again, or has rebooted."""
        self._pace = NARROW if around.narrow_line else FAST
        if (self._system, self._kind) != (around.system_id, around.autopilot_kind):
            is_same = self._kind == around.autopilot_kind
            follows = is_same and self._write is not None and self._write.moves_to(around.system_id)
            if not follows:
                self._stop_write(Outcome.FAILED, "another autopilot is there now", at_once=True)
            self._table.forget()
            self._autopilot_hash = None
            self._count = 0
            self._has_files = False
            self._system, self._kind = around.system_id, around.autopilot_kind
            self._encoding = encoding_of(self._kind, 0)
            self._name = place_name(system_id=around.system_id, autopilot_kind=self._kind)
            self._recall_at = now + self._pace.recall_after_s
            if follows and self._write is not None:
                self._write.moved(self._talk())
        self._table.doubt()
        self._listing = None
        self._list_at = now + self._pace.list_after_s

    def begin(self, transaction: Transaction, around: Around | None, now: float) -> None:
        """Starts a read or a write."""
        run = TransactionRun(transaction, now)
        work = transaction.work
        if around is None or self._system is None:
            self._report(run, Outcome.REFUSED, _NOT_HEARD)
        elif isinstance(work, ParametersWriteWork):
            self._begin_write(run, work, around)
        elif isinstance(work, ParametersReadWork):
            self._begin_read(run, work, around, now)

    def cancel(self, transaction_id: int, now: float) -> None:
        """A write ends before its next parameter; a reading continues without the request."""
        if self._writer is not None and self._writer.id == transaction_id:
            self._stop_write(Outcome.CANCELLED, "it was cancelled")
        for run in self._readers:
            if run.id == transaction_id:
                self._report(run, Outcome.CANCELLED, "It was cancelled.")
        self._readers = [run for run in self._readers if run.id != transaction_id]

    def epoch_changed(self, epoch: int, now: float) -> None:
        """A write of the previous holder ends before its next parameter."""
        if self._writer is not None and self._writer.epoch != epoch:
            self._stop_write(Outcome.STALE_EPOCH, "the controls changed hands meanwhile")

    def receive(self, frame: bytes, now: float) -> bool:
        """Returns True for a value of the list being read."""
        if self._system is None or source(frame) != (self._system, 1):
            return False
        if message_id(frame) == mavlink.MAVLINK_MSG_ID_PARAM_VALUE:
            return self._value(read_param_value(frame, self._encoding), now)
        message = decode(frame)
        if message is None:
            return False
        if message_id(frame) == mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION:
            self._version(message, now)
        elif message_id(frame) == mavlink.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL:
            answer = read_answer(message, self._system)
            if answer is not None and self._listing is not None:
                self._listing.heard_file(answer, now)
            return answer is not None
        elif self._write is not None and (message.target_system, message.target_component) == (
            self._system,
            AGENT_COMPONENT,
        ):
            self._write.refused(message)
        return False

    def due(self, around: Around, now: float) -> list[bytes]:
        """Frames to send to the autopilot now."""
        self._now = now
        if self._recall_at is not None and now >= self._recall_at:
            self._recall(now)
        out = self._write_on(now)
        if not self._held_back(around):
            out += self._list_on(around, now)
        self._check_readers(now)
        if self._save_at is not None and now >= self._save_at and not around.armed:
            self._save()
        return out

    def reports(self) -> list[TransactionToTower]:
        """Holds changes back during a write, so that a tower that knows the table receives them together."""
        if self._write is None or not self._table.is_sent:
            self._send_reports(self._now)
        reports, self._reports = self._reports, []
        return reports

    def resend(self) -> None:
        """The tower may know nothing: sends the state again."""
        self._sent_hash = None
        self._table.resend()

    def busy(self, now: float) -> bool:
        """Whether parameters are being read or written, or will be in a moment."""
        soon = self._list_at is not None and now >= self._list_at - SOON_S
        return self._listing is not None or self._write is not None or soon

    # Messages from the autopilot.

    def _value(self, received: ParamValue, now: float) -> bool:
        listed = False
        reading = self._listing is not None
        if self._listing is not None:
            listed = self._listing.receive(received, now)
        if self._write is not None:
            self._write.receive(received, now)
        if received.name == HASH_NAME:
            return reading
        if not listed and received.parameter is not None and self._table.put(received.parameter):
            self._autopilot_hash = None
            self._save_at = now + SAVE_AFTER_S
        moved = self._table.verified and 0 < received.count != self._count
        if moved and self._listing is None and self._list_at is None:
            self._list_at = max(now + RELIST_AFTER_S, self._listed_at + AGAIN_AFTER_S)
        return listed

    def _version(self, version: object, now: float) -> None:
        capabilities = int(getattr(version, "capabilities", 0))
        files = bool(capabilities & mavlink.MAV_PROTOCOL_CAPABILITY_FTP)
        family = FAMILIES.get(self._kind)
        self._has_files = files and family is not None and family.packs_parameters
        encoding = encoding_of(self._kind, capabilities)
        if encoding is not self._encoding:
            self._encoding = encoding
            self._table.forget()
            self._listing, self._list_at = None, now
        chip = chip_name(version)
        if chip is not None and chip != self._name:
            if not self._table.verified:
                self._table.forget()
            self._name, self._recall_at = chip, now
        if self._recall_at is not None:
            self._recall(now)

    def _recall(self, now: float) -> None:
        self._recall_at = None
        if self._table.values:
            self._save_at = now
            return
        remembered = recall(self._store, self._name)
        if remembered is not None:
            self._table.learnt(remembered.table, verified=False)
            self._count, self._autopilot_hash = remembered.count, remembered.autopilot_hash

    def _save(self) -> None:
        self._save_at = None
        if self._table.verified:
            remember(self._store, self._name, Remembered(self._table.table, self._count, self._autopilot_hash))

    # Reading.

    def _begin_read(self, run: TransactionRun, work: ParametersReadWork, around: Around, now: float) -> None:
        if self._table.values and not work.again:
            self._sent_hash = None
            self._send_table(run)
        elif not around.heard:
            self._report(run, Outcome.REFUSED, _NOT_HEARD)
        elif self._held_back(around):
            words = "The line to the autopilot is narrow and it is flown by hand: parameters are read after that."
            self._report(run, Outcome.REFUSED, words)
        elif work.again and self._write is not None:
            self._report(run, Outcome.REFUSED, "Busy: parameters are being written.")
        elif len(self._readers) >= MAX_READERS:
            self._report(run, Outcome.REFUSED, "Busy: the parameters are being read.")
        else:
            self._readers.append(run)
            if self._listing is None:
                self._list_at = now
            if work.again:
                self._autopilot_hash = None

    def _held_back(self, around: Around) -> bool:
        return around.narrow_line and around.flown_by_hand

    def _list_on(self, around: Around, now: float) -> list[bytes]:
        if self._listing is None:
            wanted = self._list_at is not None and now >= self._list_at
            can_wait = around.narrow_line and around.armed and bool(self._table.values) and not self._readers
            if not wanted or can_wait or not around.heard or self._write is not None:
                return []
            self._list_at = None
            self._listing = ParameterReading(
                self._talk(),
                self._pace,
                files=FileFrames(self._maker, vehicle_system_id=around.system_id) if self._has_files else None,
                known_hash=self._autopilot_hash if self._table.values else None,
            )
        out = self._listing.due(now)
        if self._listing.end is None:
            self._table.reading(*self._listing.progress)
        else:
            self._listing_ended(now)
        return out

    def _listing_ended(self, now: float) -> None:
        assert self._listing is not None
        end, self._listing = self._listing.end, None
        self._listed_at = now
        readers, self._readers = self._readers, []
        if isinstance(end, ListingFailed):
            self._list_at = now + AGAIN_AFTER_S
            for run in readers:
                self._report(run, Outcome.FAILED, f"The parameters could not be read: {end.why}.")
            return
        if isinstance(end, Listed):
            self._table.learnt(end.table, verified=True)
            self._count, self._autopilot_hash = end.count, end.autopilot_hash
            self._save_at = now
        else:
            self._table.learnt(self._table.table, verified=True)
        self._send_reports(now, at_once=True)
        for run in readers:
            self._send_table(run)

    def _check_readers(self, now: float) -> None:
        for run in self._readers:
            if now >= run.deadline:
                self._report(run, Outcome.TIMED_OUT, "Reading all parameters timed out.")
            elif self._listing is not None:
                self._reports += run.progress("reading", *self._listing.progress, now)
        self._readers = [run for run in self._readers if now < run.deadline]

    def _send_table(self, run: TransactionRun) -> None:
        table, received = self._table.table, self._table.hash
        if received is None or received != self._sent_hash:
            packed = pack_table(table)
            if received is None or len(packed) > MAX_PACKED_TABLE_BYTES:
                self._report(run, Outcome.FAILED, "There are more parameters than can be sent.")
                return
            self._sent_hash = received
            self._reports.append(ParameterTable(hash=received, packed=packed))
        how = "known" if self._table.verified else "remembered from the last time"
        self._report(run, Outcome.DONE, f"{len(table)} parameters are {how}.")

    # Writing.

    def _begin_write(self, run: TransactionRun, work: ParametersWriteWork, around: Around) -> None:
        if self._write is not None:
            self._report(run, Outcome.REFUSED, "Busy: parameters are being written.")
        elif not around.heard:
            self._report(run, Outcome.REFUSED, _NOT_HEARD)
        else:
            self._writer = run
            self._write = ParameterWrite(self._talk(), work.values, self._table.values, self._pace, around)

    def _stop_write(self, outcome: Outcome, why: str, *, at_once: bool = False) -> None:
        if self._write is not None:
            self._write.stop(outcome, why, at_once=at_once)

    def _write_on(self, now: float) -> list[bytes]:
        if self._write is None or self._writer is None:
            return []
        if now >= self._writer.deadline:
            self._stop_write(Outcome.TIMED_OUT, "it timed out", at_once=True)
        out = self._write.due(now)
        end = self._write.end
        if end is None:
            self._reports += self._writer.progress("writing", *self._write.progress, now)
            return out
        run, self._write, self._writer = self._writer, None, None
        self._send_reports(now, at_once=True)
        self._reports.append(run.result(end.outcome, end.words, refusals=end.refusals, refused=end.refused))
        return out

    # Reports.

    def _talk(self) -> ParameterFrames:
        assert self._system is not None
        return ParameterFrames(self._maker, vehicle_system_id=self._system, encoding=self._encoding)

    def _send_reports(self, now: float, *, at_once: bool = False) -> None:
        """Sends the changes. A tower that had the table before a change has the one after it too."""
        reports = self._table.due(now, at_once=at_once)
        for one in reports:
            if isinstance(one, ParameterChanged) and one.before == self._sent_hash:
                self._sent_hash = one.hash
        self._reports += reports

    def _report(self, run: TransactionRun, outcome: Outcome, words: str) -> None:
        self._reports.append(run.result(outcome, words))
