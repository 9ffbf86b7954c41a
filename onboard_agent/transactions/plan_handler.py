"""Handles the plans of one vehicle: runs the tower's plan transactions one at a time and reports their results.

I/O only by the journal; takes `now`. It owns the known state of the plans on board, and whether one may be flown.

Rules, each tested:
- One transaction at a time for all kinds, because PX4 has one transfer for all kinds. A second is refused, not queued.
- A write of an older epoch than the newest known is refused; a running write is rolled back when a newer epoch comes.
- While the journal has an intent, a mission start is refused; the intent is recovered before anything else begins.
"""

from dataclasses import dataclass
from typing import Any, Final

from onboard_agent.autopilot.own_frames import AGENT_COMPONENT, FrameMaker
from onboard_agent.transactions.journal import UNREADABLE, Intent, JournalStore, read_intent
from onboard_agent.transactions.plan_download import Downloaded, PlanDownload
from onboard_agent.transactions.plan_frames import PlanFrames
from onboard_agent.transactions.plan_messages import HEARD, KEPT_OUT
from onboard_agent.transactions.plan_replacement import PlanReplacement, ReplacementEnd
from onboard_agent.transactions.plan_words import PLAN_NAMES, compared
from onboard_agent.transactions.retry_policy import RetryPolicy
from wire.dialect import decode
from wire.frames import message_id, source
from wire.plan_fields import KeptFields
from wire.plan_verbatim import Verbatim
from wire.plans import Plan, PlanKind, pack_plan, plan_hash
from wire.transactions import (
    Outcome,
    PlanClearWork,
    PlanDownloadWork,
    PlanOnBoard,
    PlanUploadWork,
    PlanVerifyWork,
    Transaction,
    TransactionProgress,
    TransactionResult,
    TransactionToTower,
)

PROGRESS_EVERY_S: Final = 0.2
RECOVER_AGAIN_S: Final = 10.0
READ_WITHIN_S: Final = 120.0
"""Deadline for a background reading: 700 items on a narrow line."""

PlanWork = PlanDownloadWork | PlanUploadWork | PlanClearWork | PlanVerifyWork
_WRITES: Final = (PlanUploadWork, PlanClearWork)


@dataclass(slots=True)
class _Running:
    machine: PlanReplacement | PlanDownload
    kind: PlanKind
    transaction: Transaction | None
    """None: a recovery, or a background reading."""
    deadline: float
    reported_at: float = -PROGRESS_EVERY_S

    @property
    def writes(self) -> bool:
        return isinstance(self.machine, PlanReplacement)


class PlanHandler:
    """Call `autopilot_came` first; `due` at each tick and after each `receive`; forward the messages of `reports`."""

    def __init__(self, maker: FrameMaker, journal: JournalStore, patience: RetryPolicy | None = None) -> None:
        self._maker = maker
        self._journal = journal
        self._patience = patience or RetryPolicy()
        self._system: int | None = None
        self._home_slot = False
        self.keeping: KeptFields = Verbatim()
        """The autopilot's table. A running work keeps the one with which it began."""
        self._epoch = 0
        self._running: _Running | None = None
        self._reports: list[TransactionToTower] = []
        self._open: dict[PlanKind, Intent] = {}
        self.read_failed: dict[PlanKind, str] = {}
        """Kinds that `read` could not read, with the name of the MAV_MISSION_RESULT or an empty string."""
        self._recover_at: float | None = None
        for kind in PlanKind:
            intent = read_intent(journal, kind)
            if intent is not None:
                self._open[kind] = intent

    # Queries.

    @property
    def why_no_start(self) -> str | None:
        """A sentence if no mission may be started now, else None."""
        if self._running is not None and self.writes:
            return f"The {PLAN_NAMES[self._running.kind]} is being written. No mission can start now."
        for kind in self._open:
            return f"The {PLAN_NAMES[kind]} on board is unknown. Upload it again before you start a mission."
        return None

    @property
    def busy(self) -> bool:
        """Whether a write is running, or a reading that a client waits for."""
        return self._running is not None and not self._only_reads(self._running)

    @property
    def is_reading(self) -> bool:
        """Whether a background reading is running."""
        return self._running is not None and self._only_reads(self._running)

    @property
    def writes(self) -> bool:
        """Whether a plan is being written."""
        return self._running is not None and self._running.writes

    @property
    def mission_in_doubt(self) -> bool:
        """Whether the mission on board may be incomplete at this moment."""
        running = self._running
        if running is not None and running.kind is PlanKind.MISSION and isinstance(running.machine, PlanReplacement):
            return running.machine.has_written
        return PlanKind.MISSION in self._open

    def keeps_out(self, ground_station_message_id: int) -> bool:
        """Whether a ground station's message would write a plan during our own write."""
        return self.writes and ground_station_message_id in KEPT_OUT

    def reports(self) -> list[TransactionToTower]:
        """Returns the messages for the tower once."""
        reports, self._reports = self._reports, []
        return reports

    # Events.

    def autopilot_came(self, *, vehicle_system_id: int, home_slot: bool, keeping: KeptFields, now: float) -> None:
        """The autopilot is heard for the first time, or again after a silence. `home_slot`: it is an ArduPilot."""
        self._system, self._home_slot, self.keeping = vehicle_system_id, home_slot, keeping
        self._recover_at = now if self._open else None

    def begin(self, transaction: Transaction, now: float) -> None:
        """Starts a transaction of the tower (a PlanWork)."""
        work = transaction.work
        assert isinstance(work, PlanWork)
        refusal = self._refusal(transaction, work)
        if refusal is not None:
            self._report(transaction.id, *refusal)
            return
        talk = self._talk(work.kind)
        machine: PlanReplacement | PlanDownload
        if isinstance(work, PlanUploadWork | PlanClearWork):
            items = work.items if isinstance(work, PlanUploadWork) else ()
            left_open = self._open.get(work.kind)
            machine = PlanReplacement(talk, items, self._journal, self._patience, left_open=left_open)
        else:
            machine = PlanDownload(talk, self._patience)
        self._running = _Running(machine, work.kind, transaction, now + transaction.deadline_s)

    def read(self, kind: PlanKind, now: float) -> None:
        """Starts a background reading, if nothing else is running. The tower's transactions take precedence."""
        if self._running is None and self._system is not None:
            self.read_failed.pop(kind, None)
            self._running = _Running(PlanDownload(self._talk(kind), self._patience), kind, None, now + READ_WITHIN_S)

    def cancel_reads(self) -> None:
        """Cancels a background reading."""
        if self.is_reading:
            self._running = None

    def cancel(self, transaction_id: int, now: float) -> None:
        """The tower cancels a transaction. Ignores ended transactions and recoveries."""
        if self._is_running(transaction_id):
            self._stop(Outcome.CANCELLED, "it was cancelled")
            self._settle(now)

    def epoch_changed(self, epoch: int, now: float) -> None:
        """The holder changed, or there is none: rolls back a write of the previous holder."""
        if epoch == self._epoch:
            return
        self._epoch = epoch
        running = self._running
        if running is not None and running.writes and running.transaction is not None:
            if running.transaction.epoch != epoch:
                self._stop(Outcome.STALE_EPOCH, "the controls changed hands meanwhile")
            self._settle(now)

    def mission_flown(self, now: float) -> None:
        """The mission is being flown, whoever started it: cancels a write that has not sent its first frame."""
        machine = None if self._running is None or self._running.transaction is None else self._running.machine
        if isinstance(machine, PlanReplacement) and not machine.has_written:
            self._stop(Outcome.REFUSED, "the drone started its mission")
            self._settle(now)

    def receive(self, frame: bytes, now: float) -> bool:
        """Takes a whole frame of a type in HEARD, with a valid checksum.

        Returns whether it is from the autopilot and addressed to the agent; other frames change nothing.
        """
        if message_id(frame) not in HEARD or source(frame) != (self._system, 1):
            return False
        message = decode(frame)
        if message is None or not self._for_us(message):
            return False
        if self._running is not None:
            self._running.machine.receive(message, now)
        return True

    def due(self, now: float) -> list[bytes]:
        """Frames to send to the autopilot now."""
        if self._running is None:
            self._begin_recovery(now)
        running = self._running
        if running is None:
            return []
        if now >= running.deadline:
            self._stop(Outcome.TIMED_OUT, "it timed out")
        if self._running is None:
            return []
        out = running.machine.due(now)
        self._settle(now)
        return out

    # Internals.

    def _refusal(self, transaction: Transaction, work: PlanWork) -> tuple[Outcome, str] | None:
        self.cancel_reads()
        if isinstance(work, _WRITES):
            if transaction.epoch < self._epoch:
                return Outcome.STALE_EPOCH, "The controls have changed hands since this request."
            self._epoch = transaction.epoch
        if self._running is not None:
            doing = "written" if self._running.writes else "read"
            return Outcome.REFUSED, f"Busy: the {PLAN_NAMES[self._running.kind]} is being {doing}."
        if self._system is None:
            return Outcome.REFUSED, "No heartbeat from the autopilot."
        return None

    def _begin_recovery(self, now: float) -> None:
        if self._recover_at is None or now < self._recover_at or self._system is None:
            return
        self._recover_at = now + RECOVER_AGAIN_S
        for kind, intent in self._open.items():
            if intent is not UNREADABLE:
                machine = PlanReplacement.recovery(self._talk(kind), intent, self._journal, self._patience)
                self._running = _Running(machine, kind, None, float("inf"))
                return

    def _stop(self, outcome: Outcome, why: str) -> None:
        running = self._running
        assert running is not None
        if isinstance(running.machine, PlanReplacement):
            running.machine.stop(outcome, why)
        else:
            self._running = None
            if running.transaction is None:
                self.read_failed[running.kind] = ""
            else:
                self._report(running.transaction.id, outcome, f"{why[0].upper()}{why[1:]}. Nothing was changed.")

    def _settle(self, now: float) -> None:
        running = self._running
        if running is None:
            return
        end = running.machine.end
        if end is None:
            self._report_progress(running, now)
            return
        self._running = None
        if isinstance(end, ReplacementEnd):
            self._replaced(running, end, now)
        elif isinstance(end, Downloaded):
            self._downloaded(running, end.plan)
        elif running.transaction is None:
            self.read_failed[running.kind] = end.code
        else:
            words = f"The {PLAN_NAMES[running.kind]} could not be read: {end.why}."
            self._report(running.transaction.id, Outcome.FAILED, words, code=end.code, item=end.item)

    def _replaced(self, running: _Running, end: ReplacementEnd, now: float) -> None:
        intent = read_intent(self._journal, running.kind)
        if intent is None:
            self._open.pop(running.kind, None)
        else:
            self._open[running.kind] = intent
            self._recover_at = now + RECOVER_AGAIN_S
        if end.on_board is not None:
            sent = end.is_new and running.transaction is not None
            self._know(running.kind, end.on_board, self._plan_sent(running) if sent else None)
        elif intent is not None:
            self._reports.append(PlanOnBoard(kind=running.kind, hash=None, fit_to_fly=False))
        if running.transaction is not None:
            self._report(running.transaction.id, end.outcome, end.words, code=end.code, item=end.item)

    def _downloaded(self, running: _Running, plan: Plan) -> None:
        self._know(running.kind, plan, None)
        if running.transaction is None:
            return
        work, the = running.transaction.work, PLAN_NAMES[running.kind]
        if not isinstance(work, PlanVerifyWork):
            self._report(
                running.transaction.id,
                Outcome.DONE,
                f"The {the} was read: {len(plan)} items.",
                plan=pack_plan(running.kind, plan),
            )
            return
        outcome, words, item = compared(self.keeping, running.kind, work.items, plan)
        self._report(running.transaction.id, outcome, words, item=item)

    def _know(self, kind: PlanKind, plan: Plan, sent: Plan | None) -> None:
        self._reports.append(
            PlanOnBoard(
                kind=kind,
                hash=plan_hash(kind, plan),
                count=len(plan),
                plan=pack_plan(kind, plan),
                sent_hash=None if sent is None else plan_hash(kind, sent),
                fit_to_fly=kind not in self._open,
            )
        )

    def _report_progress(self, running: _Running, now: float) -> None:
        if running.transaction is None or now - running.reported_at < PROGRESS_EVERY_S:
            return
        running.reported_at = now
        machine = running.machine
        phase, done, total = (
            machine.progress if isinstance(machine, PlanReplacement) else ("reading", *machine.progress)
        )
        self._reports.append(TransactionProgress(id=running.transaction.id, phase=str(phase), done=done, total=total))

    def _report(
        self,
        transaction_id: int,
        outcome: Outcome,
        words: str,
        *,
        code: str = "",
        item: int | None = None,
        plan: bytes | None = None,
    ) -> None:
        self._reports.append(
            TransactionResult(id=transaction_id, outcome=outcome, words=words, item=item, code=code, plan=plan)
        )

    @staticmethod
    def _only_reads(running: _Running) -> bool:
        return running.transaction is None and not running.writes

    def _is_running(self, transaction_id: int) -> bool:
        running = self._running
        return running is not None and running.transaction is not None and running.transaction.id == transaction_id

    def _plan_sent(self, running: _Running) -> Plan:
        work = running.transaction.work if running.transaction is not None else None
        return work.items if isinstance(work, PlanUploadWork) else ()

    def _for_us(self, message: Any) -> bool:
        return (message.target_system, message.target_component) == (self._system, AGENT_COMPONENT)

    def _talk(self, kind: PlanKind) -> PlanFrames:
        assert self._system is not None
        return PlanFrames(
            kind,
            self._maker,
            vehicle_system_id=self._system,
            home_slot=self._home_slot,
            keeping=self.keeping,
        )
