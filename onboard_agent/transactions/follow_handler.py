"""Handler for following: keeps a drone at its offset from a leader, using the positions from the tower. No I/O.

Its frames take the path of the holder's frames. A drone follows one leader at a time.

Rules, each tested:
- Following begins only in the air, in the mode that accepts targets, with both positions fresh; else nothing is sent.
- If following ends by itself (leader lost, too near, too far or on the ground; time over; cancelled; controls handed
  over), the drone is put into a hold, and a heartbeat must show that mode.
- Moved sticks also end it with a hold: the following mode ignores sticks, and the pilot who moves them wants control.
- Any other control input wins: a command, a hold, or a mode switch. Following then ends, and nothing more is sent.
- PX4 changes its mode to go to a target. It receives the next target only right after a heartbeat that shows the mode
  it was in.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import isnan
from typing import Any, Final

from onboard_agent.autopilot.mode_names import mode_name
from onboard_agent.autopilot.own_frames import AGENT_COMPONENT, FrameMaker, agent_sender, request_message
from onboard_agent.failsafe.mode_ladder import result_name
from onboard_agent.transactions.command_handler import Send, state_words
from onboard_agent.transactions.follow_course import Motion, gap, place, why_not_there, why_stop
from onboard_agent.transactions.follow_frames import go_there, standing, target
from onboard_agent.transactions.handler import Around
from onboard_agent.transactions.plan_pause import PlanPause
from wire.autopilots import registry
from wire.autopilots.profile import FlightMode
from wire.dialect import decode, mavlink
from wire.following import FollowWork, LeaderPosition
from wire.frames import message_id, source
from wire.places import place_of
from wire.transactions import Outcome, Transaction, TransactionProgress, TransactionResult, TransactionToTower

SEND_EVERY_S: Final = 0.2
GO_EVERY_S: Final = 1.0
"""For PX4, where each target is a command with an acknowledgement."""
FIRST_WITHIN_S: Final = 2.0
"""Timeout for the first positions, the leader's and the follower's own."""
REPORT_EVERY_S: Final = 1.0
MAX_REFUSALS: Final = 3
"""Consecutive refusals."""

_AUTOPILOT: Final = 1
_LED: Final = " or ".join(dict.fromkeys(f"{one.family.label}'s" for one in registry.PROFILES if one.roles.targets))
"""The families whose vehicles can follow."""
_POSITION: Final = mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT
_BEAT: Final = mavlink.MAVLINK_MSG_ID_HEARTBEAT
_ACK: Final = mavlink.MAVLINK_MSG_ID_COMMAND_ACK


@dataclass(slots=True)
class _End:
    """The outcome to report once the drone holds."""

    outcome: Outcome
    why: str
    stands: bool = False
    """A stop was sent."""
    pause: PlanPause | None = None


@dataclass(slots=True)
class _Following:
    transaction: Transaction
    work: FollowWork
    by_command: bool
    """Each target is a command, which is acknowledged and changes the mode."""
    began_at: float
    deadline: float
    commanded: int
    moved: int
    newest: int = -1
    leader: Motion | None = None
    leader_flies: bool = True
    own: Motion | None = None
    home_alt_m: float = 0.0
    begun: bool = False
    next_at: float = 0.0
    asked: bool = False
    """A heartbeat was requested, and its target is not sent yet."""
    shown: bool = False
    refusals: int = 0
    refusal: str = ""
    reported_at: float = float("-inf")
    end: _End | None = None


def _targets_mode(around: Around) -> FlightMode | None:
    """Returns the mode that accepts successive targets; None for a vehicle that is not known to support following."""
    profile = registry.of(around.autopilot_kind, around.vehicle_type)
    return None if profile is None else profile.roles.targets


class FollowHandler:
    """A TransactionHandler. `leader` takes the leader's position. `send`, `commanded`: as for CommandHandler.

    `moved`: how many times off-centre sticks have passed.
    """

    works = (FollowWork,)
    hears = frozenset({_POSITION, _BEAT, _ACK})

    def __init__(
        self, maker: FrameMaker, *, send: Send, commanded: Callable[[], int], moved: Callable[[], int]
    ) -> None:
        self._maker = maker
        self._send = send
        self._commanded = commanded
        self._moved = moved
        self._system: int | None = None
        self._one: _Following | None = None
        self._reports: list[TransactionToTower] = []

    def autopilot_came(self, around: Around, now: float) -> None:
        """The autopilot has lost what it was sent before it rebooted: ends the following."""
        if self._one is not None:
            self._over(Outcome.FAILED, "The autopilot was restarted. Nothing more was sent to it.")

    def begin(self, transaction: Transaction, around: Around | None, now: float) -> None:
        """Starts a request to follow."""
        work = transaction.work
        assert isinstance(work, FollowWork)
        why_not = self._why_not(work, around)
        if why_not is not None or around is None:
            self._report(transaction.id, Outcome.REFUSED, f"It does not follow {work.leader_name}: {why_not}.")
            return
        self._system = around.system_id
        self._one = _Following(
            transaction,
            work,
            by_command=registry.multicopter(around.autopilot_kind).family.targets_by_command,
            began_at=now,
            deadline=now + transaction.deadline_s,
            commanded=self._commanded(),
            moved=self._moved(),
        )

    def leader(self, position: LeaderPosition, late_s: float, now: float) -> None:
        """Takes the leader's position. `late_s`: the delay of the message on its way."""
        one = self._one
        if one is None or position.id != one.transaction.id or position.number <= one.newest:
            return
        one.newest, one.leader_flies = position.number, position.airborne
        one.leader = Motion(
            position.lat_e7,
            position.lon_e7,
            position.alt_amsl_mm / 1000,
            position.north_cm_s / 100,
            position.east_cm_s / 100,
            position.down_cm_s / 100,
            now - position.age_ms / 1000 - late_s,
        )

    def cancel(self, transaction_id: int, now: float) -> None:
        """The tower cancels the following."""
        if self._one is not None and self._one.transaction.id == transaction_id:
            self._stop(Outcome.CANCELLED, f"It was ordered to stop following {self._one.work.leader_name}")

    def epoch_changed(self, epoch: int, now: float) -> None:
        """The new holder did not ask for this: ends the following."""
        if self._one is not None and self._one.transaction.epoch != epoch:
            self._stop(
                Outcome.STALE_EPOCH, f"The controls changed hands while it followed {self._one.work.leader_name}"
            )

    def receive(self, frame: bytes, now: float) -> bool:
        """Takes a frame of a type in `hears`."""
        one = self._one
        if one is None or source(frame) != (self._system, _AUTOPILOT):
            return False
        message = decode(frame)
        if message is None:
            return False
        msgid = message_id(frame)
        if msgid == _BEAT:
            one.shown = one.asked
            if one.end is not None and one.end.pause is not None:
                one.end.pause.heartbeat(message.custom_mode)
            return False
        if msgid == _ACK:
            return self._acknowledged(one, message, now)
        if place_of(message.lat, message.lon) is not None:
            speed = (message.vx / 100, message.vy / 100, message.vz / 100)
            one.own = Motion(message.lat, message.lon, message.alt / 1000, *speed, now)
            one.home_alt_m = (message.alt - message.relative_alt) / 1000
        return False

    def due(self, around: Around, now: float) -> list[bytes]:
        """Frames to send to the autopilot now."""
        one = self._one
        if one is None:
            return []
        if one.end is None:
            why = self._why_leave_alone(one, around)
            if why is not None:
                self._over(Outcome.FAILED, f"It no longer follows {one.work.leader_name}: {why}. {state_words(around)}")
                return []
            self._check(one, now)
            if self._one is None:
                return []
        if one.end is not None:
            return self._holding(one, one.end, around, now)
        if not one.begun:
            return []
        self._report_progress(one, now)
        return self._on(one, around, now)

    def reports(self) -> list[TransactionToTower]:
        """Returns the messages for the tower once, in order."""
        reports, self._reports = self._reports, []
        return reports

    def resend(self) -> None:
        """Does nothing: following has no state to report."""

    # Conditions.

    def _why_not(self, work: FollowWork, around: Around | None) -> str | None:
        if around is None or not around.heard:
            return "no heartbeat from the autopilot"
        if self._one is not None:
            return f"it follows {self._one.work.leader_name}; stop that first"
        if _targets_mode(around) is None:
            return f"it is no multicopter of {_LED}"
        if any(isnan(value) for value in (work.north_m, work.east_m, work.up_m)):
            return "no place was told"
        return why_not_there(work) or self._why_not_flying(around)

    @staticmethod
    def _why_not_flying(around: Around) -> str | None:
        if not around.armed or not around.airborne:
            return "it is not in the air"
        if around.holding:
            return "it is being made to hold"
        mode = _targets_mode(around)
        if mode is not None and around.custom_mode != mode.custom_mode:
            shown = mode_name(around.autopilot_kind, around.vehicle_type, around.custom_mode)
            return f"it is in {shown}, not in {mode.name}"
        return None

    def _why_leave_alone(self, one: _Following, around: Around) -> str | None:
        """Why the follower is under other control, or out of reach."""
        if not around.heard:
            return "no heartbeat from the autopilot"
        if one.commanded != self._commanded() or around.holding:
            return "a hold or another command came"
        return self._why_not_flying(around)

    def _check(self, one: _Following, now: float) -> None:
        """Ends the following if it must, or begins it if it can."""
        name = one.work.leader_name
        if one.leader is None or one.own is None:
            if now - one.began_at > FIRST_WITHIN_S:
                which = f"where {name} is" if one.leader is None else "where it is itself"
                self._over(Outcome.REFUSED, f"It does not follow {name}: it did not receive {which}.")
            return
        why = why_stop(one.own, one.leader, one.work, now, home_alt_m=one.home_alt_m)
        if not one.leader_flies:
            why = f"{name} is not in the air"
        if one.moved != self._moved():
            why = "the sticks were moved"
        if not one.begun:
            one.begun = why is None
            if why is not None:
                self._over(Outcome.REFUSED, f"It does not follow {name}: {why}.")
        elif now >= one.deadline:
            self._stop(Outcome.TIMED_OUT, f"The time for which it was to follow {name} is over")
        elif why is not None:
            self._stop(Outcome.FAILED, f"It no longer follows {name}: {why}")
        elif one.refusals >= MAX_REFUSALS:
            self._stop(Outcome.FAILED, f"It no longer follows {name}: the autopilot refuses the place ({one.refusal})")

    # While following.

    def _on(self, one: _Following, around: Around, now: float) -> list[bytes]:
        if now < one.next_at:
            return []
        assert one.leader is not None
        sender = agent_sender(around.system_id)
        if not one.by_command:
            one.next_at = now + SEND_EVERY_S
            return self._through_gate(one, target(around.system_id, place(one.leader, one.work, now)), around, now)
        if not one.asked:
            one.asked, one.shown = True, False
            ask = request_message(around.system_id, _BEAT, confirmation=0)
            return [self._maker.make(ask, sender)]
        if not one.shown:
            return []
        one.asked = one.shown = False
        one.next_at = now + GO_EVERY_S
        return self._through_gate(one, go_there(around.system_id, place(one.leader, one.work, now)), around, now)

    def _through_gate(self, one: _Following, message: Any, around: Around, now: float) -> list[bytes]:
        frame = self._maker.make(message, agent_sender(around.system_id))
        why_not = self._send(frame, now)
        one.commanded = self._commanded()
        if why_not is None:
            return [frame]
        self._stop(Outcome.FAILED, f"It no longer follows {one.work.leader_name}: {why_not}")
        return []

    def _acknowledged(self, one: _Following, ack: Any, now: float) -> bool:
        """Returns whether the acknowledgement is addressed to the agent alone."""
        ours = ack.target_component == AGENT_COMPONENT and ack.target_system == self._system
        if ack.command == mavlink.MAV_CMD_DO_SET_MODE and (ours or ack.target_component == 0):
            if one.end is not None and one.end.pause is not None:
                one.end.pause.acknowledged(ack, now)
            return False
        if ack.command != mavlink.MAV_CMD_DO_REPOSITION or not ours:
            return False
        if ack.result in (mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_IN_PROGRESS):
            one.refusals = 0
        else:
            one.refusals += 1
            one.refusal = result_name(ack.result)
        return True

    def _report_progress(self, one: _Following, now: float) -> None:
        if one.own is None or one.leader is None or now - one.reported_at < REPORT_EVERY_S:
            return
        one.reported_at = now
        apart = gap(one.own.later(now), one.leader.later(now))
        phase = (
            f"following {one.work.leader_name}: {apart.over_ground_m:.0f} m away, {apart.in_height_m:.0f} m in height"
        )
        self._reports.append(
            TransactionProgress(
                id=one.transaction.id,
                phase=phase,
                done=round(now - one.began_at),
                total=round(one.transaction.deadline_s),
            )
        )

    # End of following.

    def _stop(self, outcome: Outcome, why: str) -> None:
        """Ends the following with a hold. The first reason counts."""
        one = self._one
        if one is None or one.end is not None:
            return
        if not one.begun:  # nothing was sent, so there is nothing to stop
            self._over(outcome, f"{why}, before it had begun.")
            return
        one.end = _End(outcome, why)

    def _holding(self, one: _Following, end: _End, around: Around, now: float) -> list[bytes]:
        out: list[bytes] = []
        if end.pause is None:
            why = self._why_leave_alone(one, around)
            if why is not None:
                self._over(end.outcome, f"{end.why}; nothing more was sent to it: {why}. {state_words(around)}")
                return []
            if not one.by_command and not end.stands:
                end.stands = True
                return self._stand_still(one, around, now)
            end.pause = PlanPause(self._maker, around, now)
            self._reports.append(
                TransactionProgress(id=one.transaction.id, phase="being made to hold", done=0, total=0)
            )
        out += end.pause.due(around, now)
        if end.pause.mode:
            self._over(end.outcome, f"{end.why}. It holds in {end.pause.mode}.")
        elif end.pause.why_not:
            words = f"{end.why}. It was not made to hold: {end.pause.why_not}. {state_words(around)}"
            self._over(end.outcome, words)
        return out

    def _stand_still(self, one: _Following, around: Around, now: float) -> list[bytes]:
        frame = self._maker.make(standing(around.system_id), agent_sender(around.system_id))
        if self._send(frame, now) is not None:
            return []
        one.commanded = self._commanded()
        return [frame]

    def _over(self, outcome: Outcome, words: str) -> None:
        if self._one is not None:
            self._report(self._one.transaction.id, outcome, words)
        self._one = None

    def _report(self, transaction_id: int, outcome: Outcome, words: str) -> None:
        self._reports.append(TransactionResult(id=transaction_id, outcome=outcome, words=words[:600]))
