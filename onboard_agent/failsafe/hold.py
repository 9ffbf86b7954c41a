"""The hold: the drone stays in the air and in place while nobody flies it. No I/O; takes `now`.

Rules, each tested:
- From the order on, sticks from the tower pass only once the holder has centred them (see `StickGate`).
- Stage one starts at once: centred sticks at 20 Hz, and requests for the modes of the drone's ladder in order until one
  is confirmed (see `ModeLadder`). Near the ground and sinking, the sticks climb first.
- Stage two follows as soon as possible: a mode that keeps its place without sticks (`StayStage`). The sticks stop only
  when it is confirmed and the autopilot keeps that mode without them. They never stop in a mode that uses them.
- A hold has no time limit. It ends when somebody flies, when the lost action is done, or when a heartbeat younger than
  the order shows the drone disarmed (`DisarmProof`). If it arms within some seconds after that, it is held at once.
- A command from the holder of the new epoch overrides the hold once the autopilot shows that it obeys.
- Each step is reported when it is done, not when it is planned.
"""

from collections.abc import Sequence
from typing import Any, Final

from onboard_agent.autopilot.disarm_proof import DisarmProof
from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.failsafe.flying import Flying
from onboard_agent.failsafe.foreign_mode import ForeignMode
from onboard_agent.failsafe.hold_report import HoldReport
from onboard_agent.failsafe.hold_table import NEXT, OPEN, WANTS_MODE, HoldEvent, HoldPhase
from onboard_agent.failsafe.mode_ladder import FAST_FOR_S, LadderStep, ModeLadder
from onboard_agent.failsafe.stay_stage import StayStage
from onboard_agent.sticks.held_sticks import HeldSticks
from wire.autopilots.profile import FlightMode
from wire.control_messages import HoldCause, HoldProgress, HoldStep
from wire.open_holds import AfterSticks, HoldStage

RUNG_PATIENCE_S: Final = 0.75
"""Time for three requests. The longest ladder reaches altitude hold before DEADLINE_S."""
DEADLINE_S: Final = FAST_FOR_S
"""After this time the hold is reported as unconfirmed."""

_EVENTS: Final = {LadderStep.ACCEPTED: HoldEvent.ACCEPTED, LadderStep.CONFIRMED: HoldEvent.MODE_SHOWN}


class Hold:
    """One hold at a time. Call `begin`, then `tick`; feed it heartbeats, acknowledgements and the holder's commands.

    `steps_reported`: where the step numbers start; each process needs a different start (HoldProgress).
    """

    def __init__(self, maker: FrameMaker, steps_reported: int = 0) -> None:
        self.phase = HoldPhase.IDLE
        self.why = ""
        self.outside_fence = False
        """The autopilot reports that it is outside its fence. ArduCopter then keeps its mode and refuses others."""
        self._sticks = HeldSticks(maker)
        self._sticks_reported = False
        self._ladder = ModeLadder(maker)
        self._stay = StayStage(maker)
        self._rungs: tuple[FlightMode, ...] = ()
        self._stays: tuple[FlightMode, ...] = ()
        self._began_at = 0.0
        self._modes_known = False
        self._waits = False
        self._flown = False
        self._flown_at = 0.0
        self._hand_over_failed = False
        self._deadline_reported = False
        self._foreign = ForeignMode()
        self._proof = DisarmProof(maker)
        self._report = HoldReport(steps_reported)

    @property
    def sticks_on(self) -> bool:
        """Whether the agent's sticks go to the autopilot."""
        return self._sticks.on

    @property
    def active(self) -> bool:
        """Whether there is anything left to send."""
        return self._sticks.on or self.phase in WANTS_MODE or self._stay.wanted

    @property
    def acting(self) -> bool:
        """Whether a mode is being requested, or a hold keeps the sticks centred."""
        return self.phase in WANTS_MODE or self._stay.asking or (self._sticks.on and self.phase in OPEN)

    @property
    def open(self) -> bool:
        """Whether the drone is held, and nobody flies it."""
        return not self._flown and (self._sticks.on or self.phase in OPEN)

    def open_s(self, now: float) -> float:
        """Seconds since the hold began, or since `keep_centred`."""
        return now - self._began_at

    @property
    def holds(self) -> bool:
        """Whether a hold has begun and not ended, with or without sticks."""
        return self.phase in OPEN

    @property
    def stage(self) -> HoldStage:
        """The stage that the hold has reached."""
        if self._stay.mode is not None:
            return HoldStage.STAY
        return HoldStage.ALTITUDE if self.phase is HoldPhase.CONFIRMED else HoldStage.NONE

    @property
    def waiting_for(self) -> str:
        """Why stage two is not reached; empty if it is reached or not due."""
        return "" if self.stage is HoldStage.STAY else self._stay.waiting_for

    def begin(
        self,
        *,
        cause: HoldCause,
        order_id: int,
        epoch: int,
        rungs: Sequence[FlightMode],
        stays: Sequence[FlightMode],
        first: Sequence[FlightMode] | None = None,
        armed: bool,
        now: float,
        why: str = "",
        sticks: bool = True,
    ) -> None:
        """Starts a hold. Empty `rungs`, `stays`: the vehicle has no such modes. `armed`: or not known to be disarmed.

        `sticks`: False if the drone flies without sticks. Then the modes `first`, or else `stays`, are tried first.
        `why`: the reason for a person, if nobody ordered the hold.
        """
        self._name(cause, order_id, epoch, now, why)
        self._rungs, self._stays = tuple(rungs), tuple(stays)
        self._modes_known = bool(rungs or first)
        self._sticks.on = False
        if armed:
            self._stage_one(now, first=() if sticks else stays if first is None else first)
        else:
            self.phase = HoldPhase.WATCHING

    @property
    def settled(self) -> bool:
        """Whether a hold is open and its mode is confirmed."""
        return self.open and self.phase is HoldPhase.CONFIRMED and not self._waits

    def confirm_again(self, *, order_id: int, epoch: int, now: float) -> None:
        """Reports an order as confirmed, because the drone already holds."""
        mode = self._stay.mode or self._ladder.confirmed
        self._report.begin(cause=HoldCause.ORDER, order_id=order_id, epoch=epoch, now=now)
        self._report.add(HoldStep.CONFIRMED, mode.name if mode is not None else "", now)

    def stand_aside(
        self, *, order_id: int, epoch: int, now: float, why: str, step: HoldStep = HoldStep.NOT_NEEDED
    ) -> None:
        """Ends an order with this step: it must not interrupt the present flight, or the agent cannot carry it out."""
        self._name(HoldCause.ORDER, order_id, epoch, now, why)
        self.phase = HoldPhase.IDLE
        self._sticks.on = False
        self._report.add(step, why, now)

    def _name(self, cause: HoldCause, order_id: int, epoch: int, now: float, why: str) -> None:
        self.why = why
        self._report.begin(cause=cause, order_id=order_id, epoch=epoch, now=now)
        self._began_at = now
        self._waits = self._flown = self._deadline_reported = self._sticks_reported = False
        self._foreign.forget()
        self._proof.begin(now)
        self._ladder.stop()
        self._stay.end()
        if cause is not HoldCause.ORDER:
            self._report.add(HoldStep.ORDERED, why, now)

    def _stage_one(self, now: float, first: Sequence[FlightMode] = ()) -> None:
        self.phase = HoldPhase.REQUESTING
        self._sticks.on = False
        if not first:
            self._sticks.begin(now)
        self._climb((*first, *self._rungs), now)

    def _climb(self, rungs: Sequence[FlightMode], now: float) -> None:
        self._ladder.climb(rungs, patience_s=RUNG_PATIENCE_S, now=now)

    def modes_became_known(self, rungs: Sequence[FlightMode], stays: Sequence[FlightMode], now: float) -> None:
        """Handles an autopilot that was found only after the hold had begun."""
        if self.phase in WANTS_MODE and not self._modes_known and rungs:
            self._modes_known = True
            self._rungs, self._stays = tuple(rungs), tuple(stays)
            self._climb(rungs, now)

    def tick(self, now: float, flying: Flying) -> list[bytes]:
        """Frames to send to the autopilot now."""
        if self.phase is HoldPhase.WATCHING:
            return self._prove(now, flying)
        if not self.active:
            return []
        if self._flown and self.phase in WANTS_MODE and self._gives_up(now, flying):
            return []
        self._check_stage_two(now, flying)
        frames = self._sticks_due(now, flying)
        if not self._waits:
            if self._stay.asking or self.phase not in WANTS_MODE:
                frames += self._stay_due(now, flying)
                self._stage_two_reached(now)
            else:
                frames += self._ladder.due(now, vehicle_system_id=flying.vehicle_system_id)
                self._follow_ladder(now)
                frames += self._stay_due(now, flying)
        if now - self._began_at >= DEADLINE_S and not self._deadline_reported:
            self._deadline_reported = True
            self._fire(HoldEvent.DEADLINE_PASSED, now, self._why_unconfirmed())
            if self.phase is HoldPhase.UNCONFIRMED and not self._flown:
                self._stay.start(self._stays, now)
        return frames

    def _gives_up(self, now: float, flying: Flying) -> bool:
        """Stops a hand-over to the pilot's sticks that takes too long or has lost them. Returns whether it did."""
        stopped = self.phase is HoldPhase.HANDING and not flying.pilot_fresh
        if not stopped and now - self._flown_at < DEADLINE_S:
            return False
        self._hand_over_failed = self.phase is HoldPhase.HANDING
        self._ladder.stop()
        self._fire(HoldEvent.OVERRULED, now, "the sticks were taken up")
        return True

    def pop_failed_hand_over(self) -> bool:
        """True once, if a pilot's sticks stopped before a mode obeyed them, or if no mode does."""
        failed, self._hand_over_failed = self._hand_over_failed, False
        return failed

    def _prove(self, now: float, flying: Flying) -> list[bytes]:
        if self._proof.over(now):
            self._fire(HoldEvent.WATCHED, now)
            return []
        if self._proof.failed(now):
            self._fire(HoldEvent.ARMED, now)
            self._stage_one(now)
            return self._sticks_due(now, flying)
        return self._proof.due(now, vehicle_system_id=flying.vehicle_system_id)

    def _stay_due(self, now: float, flying: Flying) -> list[bytes]:
        return self._stay.due(now, flying, self._sticks.still_s(now) if self._sticks.on else float("inf"))

    def _check_stage_two(self, now: float, flying: Flying) -> None:
        stay = self._stay
        if not self._waits and not self._flown and stay.left(now, flying):
            # Sticks never stop in a mode that uses them, and a mode of the autopilot's failsafe is no hold.
            stay.start(self._stays, now)
            if flying.by_hand and not self._sticks.on:
                self._sticks.begin(now)
        may_let_go = stay.mode is not None and flying.after_sticks(stay.mode.custom_mode) is AfterSticks.STAYS
        if may_let_go and not stay.asking:
            self._sticks.on = False
        asked = self._ladder.current
        if asked is not None and asked in self._rungs and asked not in self._stays and not self._flown:
            self._sticks.on = True  # stage two was tried first, and refused

    def back_to_altitude(self, altitude_hold: FlightMode, now: float) -> None:
        """Returns to stage one in altitude hold, because the position is lost in a mode that needs it."""
        if self._waits or self._ladder.current == altitude_hold:
            return
        self._stay.end()
        self.phase = HoldPhase.REQUESTING
        self._sticks.begin(now)
        self._climb((altitude_hold,), now)

    def _sticks_due(self, now: float, flying: Flying) -> list[bytes]:
        frames = self._sticks.due(now, flying)
        if frames and not self._sticks_reported and self.phase in OPEN:
            self._sticks_reported = True
            self._report.add(HoldStep.STICKS_CENTRED, "", now)
        return frames

    def acknowledged(self, ack: Any, now: float) -> None:
        """Handles a COMMAND_ACK for MAV_CMD_DO_SET_MODE that is addressed to the agent."""
        if self._stay.asking:
            self._stay.acknowledged(ack, now)
            self._stage_two_reached(now)
        elif self.phase in WANTS_MODE:
            self._ladder.acknowledged(ack, now)
            self._follow_ladder(now)

    def heartbeat(self, *, armed: bool, custom_mode: int, now: float, by_failsafe: bool = False) -> None:
        """A HEARTBEAT of the autopilot. `by_failsafe`: its own failsafe has chosen the mode."""
        if self.phase is HoldPhase.WATCHING:
            if armed:
                self._fire(HoldEvent.ARMED, now)
                self._stage_one(now)
            elif not self._proof.proved:
                self._proof.proved = True
                self._report.add(HoldStep.NOT_NEEDED, "the drone is disarmed", now)
        elif not armed:
            self._disarmed(now)
        elif self.active:
            if self._stay.asking:
                self._stay.heartbeat(custom_mode, now, by_failsafe=by_failsafe)
                self._stage_two_reached(now)
            elif self.phase in WANTS_MODE:
                self._ladder.heartbeat(custom_mode, by_failsafe=by_failsafe)
                self._follow_ladder(now)
        self._check_foreign(custom_mode, now)

    def _disarmed(self, now: float) -> None:
        self._sticks.on = False
        self._stay.end()
        self._ladder.stop()
        self._proof.proved = True
        self._fire(HoldEvent.DISARMED, now, "the drone is disarmed")

    def foreign_mode(self, now: float) -> int | None:
        """Returns a lasting autopilot mode that neither tower nor agent requested, or None."""
        return self._foreign.mode(now)

    def _check_foreign(self, custom_mode: int, now: float) -> None:
        settled = self.phase is HoldPhase.CONFIRMED and not (self._stay.asking or self._waits or self._flown)
        ours = self._stay.mode or self._ladder.confirmed
        self._foreign.shown(custom_mode, ours=ours.custom_mode if settled and ours else None, now=now)

    def sticks_come(self, modes: Sequence[FlightMode], now: float) -> None:
        """The holder's own sticks arrived and were centred: the agent's stop. `modes`: candidates that obey sticks."""
        self._sticks.on = False
        if self._flown:
            return
        self._flown = True
        self._flown_at = now
        obeys = self._stay.mode is None and not self._stay.asking and self._ladder.current not in self._stays
        hand_over = not obeys
        self._stay.end()
        if hand_over and modes:
            self._fire(HoldEvent.OVERRULED, now, "the sticks were taken up")
            self.phase = HoldPhase.HANDING
            self._climb(modes, now)
        elif self.phase is HoldPhase.CONFIRMED:
            self.phase = HoldPhase.IDLE

    def wait(self) -> None:
        """Pauses mode requests until the outcome of the holder's command to fly without sticks is known."""
        self._waits = True

    def go_on(self) -> None:
        """Resumes mode requests."""
        self._waits = False

    def overruled(self, *, needs_sticks: bool, now: float, why: str = "the holder has commanded otherwise") -> None:
        """Ends the hold in favour of another command. If that needs sticks, ours stay centred until theirs arrive."""
        was_open = self.open
        self._foreign.forget()
        self._fire(HoldEvent.OVERRULED, now, why)
        self._stay.end()
        self._ladder.stop()
        if not needs_sticks:
            self._sticks.on = False
            self._flown = True
        elif was_open:
            self.keep_centred(now)

    def keep_centred(self, now: float) -> None:
        """Sends centred sticks until the holder's arrive, because the mode needs sticks and none arrive."""
        self.why = "the mode needs sticks, and nobody's come"
        self._flown = self._waits = False
        self._began_at = now
        if not self._sticks.on:
            self._sticks.begin(now)

    def yield_mode(self) -> None:
        """Stops the hold's mode requests, because another mode is being requested. Sticks stay as they are."""
        self._ladder.stop()
        self._stay.end()
        if self.phase is not HoldPhase.IDLE:
            self.phase = HoldPhase.CONFIRMED

    def pop_progress(self) -> list[HoldProgress]:
        """The steps done since the last call, in order."""
        return self._report.pop()

    def _follow_ladder(self, now: float) -> None:
        for step, detail in self._ladder.pop_reached():
            if step is LadderStep.REQUESTED:
                if self.phase is not HoldPhase.HANDING:
                    self._report.add(HoldStep.MODE_REQUESTED, detail, now)
                continue
            self._fire(_EVENTS[step], now, detail)
            mode = self._ladder.confirmed
            if self.phase is HoldPhase.CONFIRMED and mode is not None:
                self._stage_one_confirmed(mode, now)

    def _stage_one_confirmed(self, mode: FlightMode, now: float) -> None:
        if self._flown:
            self.phase = HoldPhase.IDLE
        elif mode in self._stays:
            self._stay.is_in(mode, self._stays, now)
        else:
            self._stay.start(self._stays, now)

    def _stage_two_reached(self, now: float) -> None:
        """Confirms the hold if stage two is confirmed although stage one was not."""
        mode = self._stay.mode
        if mode is not None and self.phase in WANTS_MODE and not self._stay.asking:
            self._ladder.stop()
            self._fire(HoldEvent.ACCEPTED, now, mode.name)
            self._fire(HoldEvent.MODE_SHOWN, now, mode.name)

    def _why_unconfirmed(self) -> str:
        if not self._modes_known:
            return "no altitude-hold mode is known for this vehicle"
        fence = "; it is outside its fence and may keep its mode until it is inside again" if self.outside_fence else ""
        return self._ladder.why_not() + fence

    def _fire(self, event: HoldEvent, now: float, detail: str = "") -> None:
        """Takes the table's transition for this event. Ignores the event if the table has none."""
        transition = NEXT.get((self.phase, event))
        if transition is None:
            return
        self.phase, step = transition
        if step is not None:
            self._report.add(step, detail, now)
