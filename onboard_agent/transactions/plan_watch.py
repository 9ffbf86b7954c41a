"""Handler for plans: reports the plans on board from the start, and detects changes by others.

Wraps `PlanHandler`, which runs one transaction at a time. I/O only by the journal; takes `now`.

Rules, each tested:
- When an autopilot comes or has rebooted, its plans are read; on a narrow line not while the drone is flown by hand.
- A plan that another client may have changed is unknown from that moment. It is read again once all other plan
  transfers with the autopilot are over, and never during one.
- No plan is written while the drone flies its mission or was ordered to, unless the tower requests it; the drone is
  then put on hold first. If the mission starts before the first frame of a write, nothing is written.
- While a plan is being written, is about to be, or may be incomplete, no mission can be started through the tower.
- An incomplete mission that is started by other means is put on hold.
"""

from typing import Any, Final

import msgspec

from onboard_agent.autopilot.mode_names import mission_modes, mode_name
from onboard_agent.autopilot.own_frames import AGENT_COMPONENT, FrameMaker
from onboard_agent.transactions.handler import Around
from onboard_agent.transactions.journal import JournalStore
from onboard_agent.transactions.plan_changes import TALK, PlanChanges
from onboard_agent.transactions.plan_handler import PlanHandler
from onboard_agent.transactions.plan_messages import HEARD
from onboard_agent.transactions.plan_pause import PATIENCE_S, PlanPause
from onboard_agent.transactions.retry_policy import RetryPolicy
from wire.autopilots.registry import FAMILIES
from wire.dialect import decode, mavlink
from wire.frames import message_id, source
from wire.plan_keeping import keeping_of
from wire.plans import Plan, PlanKind, unpack_plan
from wire.transactions import (
    Outcome,
    PlanClearWork,
    PlanDownloadWork,
    PlanOnBoard,
    PlanUploadWork,
    PlanVerifyWork,
    Transaction,
    TransactionResult,
    TransactionToTower,
)

READ_AGAIN_S: Final = 15.0
"""Delay after a failed reading; doubled after each further failure."""
MAX_READ_AGAIN_S: Final = 300.0
STOP_AGAIN_S: Final = 2.0
"""Delay after a mission in doubt could not be stopped, or another command came: that mode has priority."""

_AUTOPILOT: Final = 1
_ACK: Final = mavlink.MAVLINK_MSG_ID_COMMAND_ACK
_BEAT: Final = mavlink.MAVLINK_MSG_ID_HEARTBEAT
_CURRENT: Final = mavlink.MAVLINK_MSG_ID_MISSION_CURRENT
_NOT_THERE: Final = "MAV_MISSION_UNSUPPORTED"


class PlanWatch:
    """A TransactionHandler. Code that forwards frames to the autopilot uses `keeps_out` and `why_no_start`."""

    works = (PlanDownloadWork, PlanUploadWork, PlanClearWork, PlanVerifyWork)
    hears = HEARD | TALK | {_ACK, _BEAT, _CURRENT}

    def __init__(self, maker: FrameMaker, journal: JournalStore, patience: RetryPolicy | None = None) -> None:
        self._maker = maker
        self._handler = PlanHandler(maker, journal, patience)
        self._changes = PlanChanges()
        self._system: int | None = None
        self._firmware = 0
        self._pause: tuple[Transaction, PlanPause] | None = None
        self._stop: PlanPause | None = None
        """Stops a mission that is in doubt."""
        self._stop_again_at = float("-inf")
        self._warnings: list[str] = []
        self._paused: tuple[int, str] | None = None
        """The transaction for which a mission was stopped, and the mode in which the drone holds."""
        self._known: dict[PlanKind, PlanOnBoard] = {}
        self._before: dict[PlanKind, PlanOnBoard] = {}
        """Last known plans, before another client may have changed them."""
        self._to_read: set[PlanKind] = set()
        self._read_at: dict[PlanKind, float] = {}
        self._failures: dict[PlanKind, int] = {}
        self._start_stopped = False
        """The pending start came before a pause, which has ended its effect."""
        self._reports: list[TransactionToTower] = []

    # For forwarding of frames.

    @property
    def why_no_start(self) -> str | None:
        """A sentence if no mission may be started now, else None."""
        if self._pause is not None:
            return "The plan on board is about to be written. No mission can start now."
        return self._handler.why_no_start

    def keeps_out(self, frame: bytes, now: float) -> bool:
        """Whether a ground station's frame must not pass to the autopilot."""
        msgid = message_id(frame)
        if msgid not in TALK:
            return False
        if self._handler.keeps_out(msgid):
            return True
        self._changes.from_ground_station(frame, now)
        return False

    @property
    def busy(self) -> bool:
        """Whether a plan is being read or written."""
        return self._pause is not None or self._handler.busy or bool(self._handler.is_reading)

    @property
    def mission(self) -> Plan:
        """The mission on board; empty if it is not known."""
        known = self._known.get(PlanKind.MISSION)
        return () if known is None or known.plan is None else unpack_plan(known.plan)[1]

    def pop_warnings(self) -> list[str]:
        """Returns warnings for all viewers of the drone, once."""
        warnings, self._warnings = self._warnings, []
        return warnings

    # TransactionHandler.

    def autopilot_came(self, around: Around, now: float) -> None:
        """Marks all plans as unknown and reads them."""
        self._system = around.system_id
        family = FAMILIES.get(around.autopilot_kind)
        home_slot = family is not None and family.has_home_slot
        self._firmware = around.firmware
        keeping = keeping_of(around.autopilot_kind, around.vehicle_type, around.firmware)
        self._handler.autopilot_came(vehicle_system_id=around.system_id, home_slot=home_slot, keeping=keeping, now=now)
        for kind in PlanKind:
            self._changes.checked(kind)
            self._not_known(kind, now)

    def begin(self, transaction: Transaction, around: Around | None, now: float) -> None:
        """Starts a transaction with work of `works`."""
        work = transaction.work
        if around is None or not around.heard:
            self._refuse(transaction, "No heartbeat from the autopilot.")
        elif self._pause is not None:
            self._refuse(transaction, "Busy: the mission is being stopped, so that another plan can be written.")
        elif (
            isinstance(work, PlanUploadWork | PlanClearWork) and self._flies_mission(around) and not self._handler.busy
        ):
            mode = mode_name(around.autopilot_kind, around.vehicle_type, around.custom_mode)
            if work.while_flying:
                patience_s = min(PATIENCE_S, transaction.deadline_s)
                self._pause = transaction, PlanPause(self._maker, around, now, patience_s=patience_s)
            elif _shows_mission(around):
                self._refuse(
                    transaction, f"The drone is flying its mission ({mode}): no plan is written during a mission."
                )
            else:
                words = (
                    "The drone has just been ordered to fly its mission. No plan is written until it shows its mode."
                )
                self._refuse(transaction, words)
        else:
            self._handler.begin(transaction, now)

    def cancel(self, transaction_id: int, now: float) -> None:
        """The tower cancels a transaction."""
        if self._pause is not None and self._pause[0].id == transaction_id:
            self._no_pause(Outcome.CANCELLED, "It was cancelled")
        self._handler.cancel(transaction_id, now)

    def epoch_changed(self, epoch: int, now: float) -> None:
        """Rolls back a write of the previous holder."""
        if self._pause is not None and self._pause[0].epoch != epoch:
            self._no_pause(Outcome.STALE_EPOCH, "The controls changed hands meanwhile")
        self._handler.epoch_changed(epoch, now)

    def receive(self, frame: bytes, now: float) -> bool:
        """Takes a frame of a type in `hears`."""
        if source(frame) != (self._system, _AUTOPILOT):
            return False
        if self._handler.receive(frame, now):
            return True
        msgid = message_id(frame)
        if msgid in TALK or msgid == _CURRENT:
            if not self._handler.writes:
                self._changes.from_autopilot(frame, now)
        else:
            for pause in (self._stop, None if self._pause is None else self._pause[1]):
                if pause is not None:
                    self._heard_in_pause(pause, decode(frame), now)
        return False

    def due(self, around: Around, now: float) -> list[bytes]:
        """Frames to send to the autopilot now."""
        if around.firmware != self._firmware:
            self._firmware = around.firmware
            self._handler.keeping = keeping_of(around.autopilot_kind, around.vehicle_type, around.firmware)
        out = [] if self._pause is None else self._go_on_pausing(*self._pause, around, now)
        if self._flies_mission(around):
            self._handler.mission_flown(now)
        out += self._stop_what_is_in_doubt(around, now)
        out += self._handler.due(now)
        self._hear_handler()
        for kind in self._changes.pop():
            self._not_known(kind, now)
        self._read_next(around, now)
        return out

    def reports(self) -> list[TransactionToTower]:
        """Returns the messages for the tower once, in order."""
        self._hear_handler()
        reports, self._reports = self._reports, []
        return reports

    def resend(self) -> None:
        """The tower may know nothing of the plans: queues them again."""
        reported = [one for one in self._reports if not isinstance(one, PlanOnBoard)]
        self._reports = [*self._known.values(), *reported]

    # Internals.

    def _hear_handler(self) -> None:
        for one in self._handler.reports():
            if isinstance(one, PlanOnBoard):
                self._learnt(one)
            elif isinstance(one, TransactionResult):
                self._reports.append(self._with_pause(one))
            else:
                self._reports.append(one)

    def _not_known(self, kind: PlanKind, now: float) -> None:
        self._to_read.add(kind)
        self._read_at[kind] = now
        self._failures[kind] = 0
        known = self._known.get(kind)
        if known is not None and known.hash is None:
            return
        if known is not None:
            self._before[kind] = known
        self._know(PlanOnBoard(kind=kind, hash=None, fit_to_fly=known is None or known.fit_to_fly))

    def _know(self, reported: PlanOnBoard) -> None:
        if self._known.get(reported.kind) != reported:
            self._known[reported.kind] = reported
            self._reports.append(reported)

    def _learnt(self, reported: PlanOnBoard) -> None:
        if reported.hash is not None:
            self._to_read.discard(reported.kind)
            self._changes.checked(reported.kind)
            before = self._before.pop(reported.kind, None) or self._known.get(reported.kind)
            if reported.sent_hash is None and before is not None and before.hash == reported.hash:
                reported = msgspec.structs.replace(reported, sent_hash=before.sent_hash)
        self._know(reported)

    def _read_next(self, around: Around, now: float) -> None:
        for kind, code in self._handler.read_failed.items():
            if kind in self._to_read:
                self._could_not_read(kind, code, now)
        self._handler.read_failed.clear()
        if around.narrow_line and around.flown_by_hand:
            self._handler.cancel_reads()
            return
        if (
            not self._to_read
            or self._handler.busy
            or self._handler.is_reading
            or self._pause is not None
            or not around.heard
        ):
            return
        if not self._changes.quiet(now):
            return
        kind = min(self._to_read, key=lambda one: (self._read_at[one], list(PlanKind).index(one)))
        if now >= self._read_at[kind]:
            self._handler.read(kind, now)

    def _could_not_read(self, kind: PlanKind, code: str, now: float) -> None:
        if code == _NOT_THERE:
            self._to_read.discard(kind)
            return
        self._failures[kind] += 1
        self._read_at[kind] = now + min(READ_AGAIN_S * 2 ** (self._failures[kind] - 1), MAX_READ_AGAIN_S)

    def _stop_what_is_in_doubt(self, around: Around, now: float) -> list[bytes]:
        in_doubt = _shows_mission(around) and self._handler.mission_in_doubt and not around.holding
        if in_doubt and self._pause is None and self._stop is None and now >= self._stop_again_at:
            self._stop = PlanPause(self._maker, around, now)
            self._warnings.append(
                "The mission was started although it may be incomplete. The drone is ordered to hold."
            )
        if self._stop is None:
            return []
        out = self._stop.due(around, now)
        if self._stop.mode or self._stop.why_not:
            if self._stop.why_not:
                self._warnings.append(f"The mission in doubt was not stopped: {self._stop.why_not}.")
            self._stop = None
            self._stop_again_at = now + STOP_AGAIN_S
        return out

    def _go_on_pausing(self, transaction: Transaction, pause: PlanPause, around: Around, now: float) -> list[bytes]:
        out = pause.due(around, now)
        if pause.why_not:
            self._no_pause(Outcome.REFUSED, f"The drone could not be put on hold: {pause.why_not}")
        elif pause.mode:
            self._pause = None
            self._start_stopped = True
            self._paused = (transaction.id, pause.mode)
            left_s = max(transaction.deadline_s - (now - pause.began_at), 0.0)
            self._handler.begin(msgspec.structs.replace(transaction, deadline_s=left_s), now)
        return out

    def _no_pause(self, outcome: Outcome, why: str) -> None:
        assert self._pause is not None
        words = f"{why}. Nothing was written."
        self._reports.append(TransactionResult(id=self._pause[0].id, outcome=outcome, words=words[:600]))
        self._pause = None

    def _heard_in_pause(self, pause: PlanPause, message: Any, now: float) -> None:
        if message is None:
            return
        if message.get_type() == "HEARTBEAT":
            pause.heartbeat(message.custom_mode)
        elif message.command == mavlink.MAV_CMD_DO_SET_MODE and self._for_us(message):
            pause.acknowledged(message, now)

    def _for_us(self, ack: Any) -> bool:
        return ack.target_system in (0, self._system) and ack.target_component in (0, AGENT_COMPONENT)

    def _with_pause(self, result: TransactionResult) -> TransactionResult:
        if self._paused is None or self._paused[0] != result.id:
            return result
        words = f"{result.words} The drone holds in {self._paused[1]}; its mission does not go on by itself."
        self._paused = None
        return msgspec.structs.replace(result, words=words[:600])

    def _flies_mission(self, around: Around) -> bool:
        """Whether the drone flies its mission, or may start to at any moment."""
        self._start_stopped = self._start_stopped and around.starting
        return _shows_mission(around) or (around.starting and not self._start_stopped)

    def _refuse(self, transaction: Transaction, words: str) -> None:
        self._reports.append(TransactionResult(id=transaction.id, outcome=Outcome.REFUSED, words=words))


def _shows_mission(around: Around) -> bool:
    return around.armed and around.custom_mode in mission_modes(around.autopilot_kind, around.vehicle_type)
