"""One flight of a controller, from its start to its end. No I/O; takes `now`.

Rules, each tested:
- Set-points go out every 50 ms, whatever the controller does; only what they say depends on its directions.
- Every direction passes `safe_commands`, and is acknowledged with the next telemetry.
- A controller that raises, ends, or gives no sign of life for HANGS_S ends the flight with a hold, said in a
  STATUSTEXT. Time in which it waited for a processor does not count, up to SILENT_S. So do moved sticks, a cancel,
  the end of its time, a lost position, and a hand-over of the controls.
- Once the hold began no set-point is sent. A hold or command of somebody else, or another mode, wins: then nothing at
  all is sent any more.
- Set-points are nobody's presence: they do not count as a person at the controls.
- A landing is the autopilot's: it goes on without the controller.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Final

from onboard_agent.autonomy.core.acknowledgement import Acknowledgement
from onboard_agent.autonomy.core.command_sequence import CommandSequence, SendFrame
from onboard_agent.autonomy.core.controller_port import ControllerPort
from onboard_agent.autonomy.core.course import EVERY_S, Course, Setpoint, Velocity
from onboard_agent.autonomy.core.directions import Direction, Drop, Finish, Hold, Land, TakeOff
from onboard_agent.autonomy.core.flight_end import FlightEnd
from onboard_agent.autonomy.core.flight_phase import STREAMS, Phase, profile_of, why_ended
from onboard_agent.autonomy.core.flight_reports import FlightReports
from onboard_agent.autonomy.core.lines import (
    Beat,
    Directed,
    DirectionState,
    Found,
    Gone,
    Note,
    Raised,
    Ready,
    Report,
    Seen,
)
from onboard_agent.autonomy.core.mode_entry import ModeEntry
from onboard_agent.autonomy.core.payload_release import USUAL, PayloadRelease, parse_release
from onboard_agent.autonomy.core.position import PositionTrack
from onboard_agent.autonomy.core.safe_commands import HoldGoal, Limits, judge
from onboard_agent.autonomy.core.setpoint_frames import setpoint_message
from onboard_agent.autonomy.core.take_off import AT_HEIGHT_M, CLIMBS_WITHIN_S, take_off_steps
from onboard_agent.autonomy.core.zone_guard import ZoneGuard
from onboard_agent.autopilot.own_frames import FrameMaker, agent_sender
from onboard_agent.transactions.command_handler import state_words
from onboard_agent.transactions.handler import Around
from wire.autopilots.profile import mode_step
from wire.controllers import ControllerWork
from wire.dialect import decode, mavlink
from wire.frames import message_id
from wire.transactions import CommandWork, Outcome, Transaction

HANGS_S: Final = 0.4
HOLDS_HANGS_S: Final = 2.0
"""The same where the drone holds, or is on the ground: nothing gets worse meanwhile."""
SILENT_S: Final = 2.0
HOLDS_SILENT_S: Final = 5.0
"""The time by the clock, however busy the computer is."""
STARTS_WITHIN_S: Final = 15.0
"""For a small computer that loads a controller's libraries from a memory card."""
POSITION_WITHIN_S: Final = 2.0
TELL_EVERY_S: Final = 0.1
LANDS_WITHIN_S: Final = 180.0
PAUSED_S: Final = 0.2
"""A longer time between two calls is a pause of this process, and no silence of the controller."""

_ACK: Final = mavlink.MAVLINK_MSG_ID_COMMAND_ACK
_BEAT: Final = mavlink.MAVLINK_MSG_ID_HEARTBEAT


class ControllerFlight:
    """Call `due` at each tick and after each `receive`, until `result` is set."""

    def __init__(
        self,
        maker: FrameMaker,
        transaction: Transaction,
        around: Around,
        now: float,
        *,
        port: ControllerPort,
        send: SendFrame,
        commanded: Callable[[], int],
        moved: Callable[[], int],
        release: CommandWork | None = None,
    ) -> None:
        """`send`, `commanded`, `moved`: as for FollowHandler. The controller was started at `port`."""
        work = transaction.work
        assert isinstance(work, ControllerWork)
        self.id = transaction.id
        self.epoch = transaction.epoch
        self.result: tuple[Outcome, str] | None = None
        self._deadline = now + transaction.deadline_s
        self.told = FlightReports(self.id, work.name, now, self._deadline)
        self._maker = maker
        self._work = work
        self._limits = Limits(work.max_speed_m_s, work.min_height_m, work.max_height_m, work.max_distance_m)
        self._port, self._send_frame = port, send
        self._commanded_now, self._moved_now = commanded, moved
        self._commanded, self._moved = commanded(), moved()
        self._began_at = self._due_at = self._heard_at = self._phase_at = now
        self._waited_s = 0.0
        """Of the controller for a processor, at its last sign of life."""
        self._profile = profile_of(around)
        self._phase = Phase.STARTING
        self._position = PositionTrack()
        self.zones = ZoneGuard(self._position)
        self._course: Course | None = None
        self._sequence: CommandSequence | None = None
        self._release_work = release or parse_release(USUAL)
        self._release: PayloadRelease | None = None
        self._has_commanded = False
        self._climbs_to_m = 0.0
        self._next_at = self._tell_at = now
        self._ack = Acknowledgement()
        self._end: FlightEnd | None = None

    # What comes in.

    def cancel(self, now: float) -> None:
        """The tower stops it."""
        self._stop(Outcome.CANCELLED, f"The controller {self._work.name} was stopped")

    def epoch_changed(self, epoch: int) -> None:
        """Somebody else has the controls."""
        if epoch != self.epoch:
            self._stop(Outcome.STALE_EPOCH, "The controls changed hands", stands=False)

    def rebooted(self) -> None:
        """The autopilot has lost what it was sent."""
        self._over(Outcome.FAILED, "The autopilot was restarted. Nothing more was sent to it.")

    def receive(self, frame: bytes, around_id: int, now: float) -> None:
        """Takes a frame of the autopilot."""
        message = decode(frame)
        if message is None:
            return
        msgid = message_id(frame)
        if msgid == _ACK:
            if self._end is not None:
                self._end.acknowledged(message, around_id, now)
            for sequence in (self._sequence, self._release):
                if sequence is not None and self._end is None:
                    sequence.acknowledged(message, around_id, now)
        elif msgid == _BEAT:
            if self._end is not None:
                self._end.heartbeat(message.custom_mode)
        else:
            self._position.receive(message, now)

    # What goes out.

    def due(self, around: Around, now: float) -> list[bytes]:
        """Frames to send to the autopilot now."""
        if now - self._due_at > PAUSED_S:
            self._heard_at += now - self._due_at
            self._waited_s = self._port.waited_s()
        self._due_at = now
        if self._end is None:
            is_overruled = self._commanded != self._commanded_now()
            why = "a hold or another command came" if is_overruled else why_ended(self._phase, around)
            if why is not None:
                words = f"The controller {self._work.name} flies no more: {why}. {state_words(around)}"
                self.told.warnings.append(words)
                self._over(Outcome.FAILED, words)
                return []
            reports = self._port.reports()
            if reports:
                self._waited_s = self._port.waited_s()
            for at, report in reports:
                self._reported(report, at, around, now)
            if self.result is None and self._end is None:
                self._check(around, now)
        if self.result is not None:
            return []
        if self._end is not None:
            return self._holding(self._end, around, now)
        self._tell(around, now)
        self.told.tick(self._phase, now)
        return self._fly(around, now)

    # The controller's reports.

    def _reported(self, report: Report, at: float, around: Around, now: float) -> None:
        if self._end is not None or self.result is not None or self._phase is Phase.LANDING:
            return
        self._heard_at = max(self._heard_at, at)
        name = self._work.name
        match report:
            case Ready():
                self._ready(around, now)
            case Beat() | Note() | Found():
                self.told.said(report, now)
            case Raised(words=words):
                self._fault(f"The controller {name} failed: {words}")
            case Gone(words=words):
                self._fault(f"The controller {name} {words}")
            case Directed(number=number, direction=direction):
                if self._phase is Phase.STARTING:
                    self._fault(f"The controller {name} gave a direction before it was ready")
                    return
                self.told.meter.directed += 1
                self._ack.came(number)
                self._direct(direction, around, now)

    def _ready(self, around: Around, now: float) -> None:
        if self._phase is Phase.STARTING:
            self._enter(Phase.ENTERING if around.airborne else Phase.ON_GROUND, now)
            self._heard_at = now

    def _direct(self, direction: Direction, around: Around, now: float) -> None:
        motion, plane = self._position.motion, self._position.plane
        if isinstance(direction, Finish):
            self._stop(Outcome.DONE, f"The controller {self._work.name} has finished")
        elif isinstance(direction, TakeOff):
            self._take_off(direction, around, now)
        elif isinstance(direction, Hold) and self._phase is Phase.ON_GROUND:
            self._ack.judged(DirectionState.FLYING)
        elif self._phase is not Phase.FLYING or self._course is None or motion is None or plane is None:
            self._ack.judged(DirectionState.REFUSED, f"not while {self._phase}")
        elif isinstance(direction, Drop):
            self._course.fly(HoldGoal())
            self._release = PayloadRelease(self._maker, self._release_work, self._send)
            self._ack.judged(DirectionState.FLYING)
        elif isinstance(direction, Land):
            land = None if self._profile is None else self._profile.roles.land
            if land is None:
                self._ack.judged(DirectionState.REFUSED, "this vehicle has no mode that lands")
                return
            self._sequence = CommandSequence(self._maker, [mode_step(land)], self._send)
            self._ack.judged(DirectionState.FLYING)
            self._enter(Phase.LANDING, now)
        else:
            judged = judge(direction, replace(motion, heading_deg=self._course.heading_deg), plane, self._limits, now)
            judged = self.zones.judged(judged, self._course.heading_deg, now)
            if judged.goal is None:
                self._ack.judged(DirectionState.REFUSED, judged.words)
                self._course.fly(HoldGoal())
                return
            self._course.fly(judged.goal)
            self._ack.judged(DirectionState.FLYING, judged.words, bounded=judged.bounded)

    def _take_off(self, direction: TakeOff, around: Around, now: float) -> None:
        if self._phase is not Phase.ON_GROUND or self._profile is None:
            self._ack.judged(DirectionState.REFUSED, f"not while {self._phase}")
            return
        state = self._position.vehicle_state(around)
        steps = take_off_steps(direction.height_m, self._work, self._limits, self._profile, state)
        steps = self.zones.why_not_up(direction.height_m, now) or steps
        if isinstance(steps, str):
            self._ack.judged(DirectionState.REFUSED, steps)
            return
        self._sequence, self._climbs_to_m = CommandSequence(self._maker, steps, self._send), direction.height_m
        self._ack.judged(DirectionState.FLYING)
        self._enter(Phase.TAKING_OFF, now)

    # Conditions.

    def _check(self, around: Around, now: float) -> None:
        """Ends the flight if it must."""
        name, silent_s = self._work.name, now - self._heard_at
        if self._phase is Phase.LANDING:
            if self._sequence is not None and self._sequence.why_not:
                self._stop(Outcome.FAILED, f"The controller {name} could not land it: {self._sequence.why_not}")
            elif not around.armed:
                self._over(Outcome.DONE, f"The controller {name} has landed it. {self.told.meter.words(now)}")
            elif now - self._phase_at > LANDS_WITHIN_S:
                self._over(Outcome.TIMED_OUT, f"It did not land in time. {state_words(around)}")
        elif self._phase is Phase.STARTING:
            if now - self._began_at > STARTS_WITHIN_S:
                self._fault(f"The controller {name} did not start in time")
        elif self._hangs(silent_s):
            self._fault(f"The controller {name} hangs: no sign of life for {silent_s:.1f} s")
        elif now - max(self._position.at, self._phase_at) > POSITION_WITHIN_S:
            self._fault("The position of the drone is not known any more")
        elif self._moved != self._moved_now():
            self._fault("The sticks were moved")
        elif now >= self._deadline:
            self._stop(Outcome.TIMED_OUT, f"The time of the controller {name} is over")

    def _hangs(self, silent_s: float) -> bool:
        """Whether a controller that was silent so long does nothing any more."""
        if silent_s < HANGS_S:
            return False
        holds = self._phase not in STREAMS or self._course is None or isinstance(self._course.goal, HoldGoal)
        longest_s, hangs_s = (HOLDS_SILENT_S, HOLDS_HANGS_S) if holds else (SILENT_S, HANGS_S)
        waited_s = max(0.0, self._port.waited_s() - self._waited_s)
        return silent_s >= longest_s or silent_s - waited_s >= hangs_s

    # While it flies.

    def _fly(self, around: Around, now: float) -> list[bytes]:
        if self._phase in (Phase.TAKING_OFF, Phase.LANDING):
            assert self._sequence is not None
            out = self._sequence.due(around, now)
            if self._phase is Phase.TAKING_OFF:
                self._climbing(self._sequence, around, now)
            return out
        if self._phase not in STREAMS or self._position.motion is None:
            return []
        if self._course is None:
            self._course = Course(self._limits, self._position.motion.heading_deg)
        out = []
        if now >= self._next_at:
            self._next_at = max(self._next_at + EVERY_S, now - EVERY_S)
            out.append(self._setpoint(self._course, around, now))
        if self._phase is Phase.ENTERING:
            out += self._entering(around, now)
        if self._release is not None:
            out += self._release.due(around, now)
            if self._release.settle(self._ack):
                self._release = None
        return out

    def _setpoint(self, course: Course, around: Around, now: float) -> bytes:
        motion, plane = self._position.motion, self._position.plane
        assert motion is not None and plane is not None
        if self._phase is Phase.ENTERING:
            setpoint: Setpoint = Velocity(0.0, 0.0, 0.0, course.heading_deg)
        else:
            if course.reached(motion):
                self._ack.ended(DirectionState.DONE)
            elif course.expired(now):
                course.fly(HoldGoal())
                self._ack.ended(DirectionState.EXPIRED, "its time is over")
            elif why := self.zones.why_not_goal(course.goal, now):
                course.fly(HoldGoal())
                self._ack.ended(DirectionState.REFUSED, why)
            setpoint = self.zones.bounded(course.setpoint(motion, now), now)
        self.told.meter.sent += 1
        message = setpoint_message(around.system_id, setpoint, plane, home_alt_m=self._position.home_alt_m)
        return self._maker.make(message, agent_sender(around.system_id))

    def _entering(self, around: Around, now: float) -> list[bytes]:
        if ModeEntry.entered(around):
            self._sequence = None
            self._enter(Phase.FLYING, now)
            self._ack.ended(DirectionState.DONE)  # the take-off
            return []
        if self._sequence is None:
            mode = None if self._profile is None else self._profile.roles.setpoints
            assert mode is not None
            self._sequence = ModeEntry(self._maker, mode, self._send, now)
        if self._sequence.why_not:
            self._fault(f"The controller {self._work.name} does not get the controls: {self._sequence.why_not}")
            return []
        return self._sequence.due(around, now)

    def _climbing(self, sequence: CommandSequence, around: Around, now: float) -> None:
        motion = self._position.motion
        if sequence.why_not:
            if around.airborne:
                self._fault(f"The take-off failed: {sequence.why_not}")
                return
            self._ack.judged(DirectionState.REFUSED, sequence.why_not)
            self._enter(Phase.ON_GROUND, now)
            return
        if sequence.over and around.airborne and motion and motion.height_m >= self._climbs_to_m - AT_HEIGHT_M:
            self._sequence, self._course = None, Course(self._limits, motion.heading_deg)
            self._enter(Phase.ENTERING, now)
        if self._phase is Phase.TAKING_OFF and now - self._phase_at > CLIMBS_WITHIN_S:
            self._fault("The take-off took too long")

    def _send(self, frame: bytes, now: float) -> str | None:
        """Sends a command as the holder's."""
        why_not = self._send_frame(frame, now)
        self._commanded, self._has_commanded = self._commanded_now(), True
        return why_not

    def _enter(self, phase: Phase, now: float) -> None:
        self._phase, self._phase_at, self._next_at = phase, now, now

    def _tell(self, around: Around, now: float) -> None:
        """Telemetry and the acknowledgement for the controller, while a direction of it can be carried out."""
        if (
            self._phase in (Phase.STARTING, Phase.ENTERING, Phase.LANDING)
            or now < self._tell_at
            or not self._position.known
        ):
            return
        self._tell_at = max(self._tell_at + TELL_EVERY_S, now)
        drone = (*self._position.told(), around.armed, around.airborne)
        self._port.say(Seen(now, *drone, *self._ack.told(), *self._position.pose()))

    # The end.

    def _fault(self, why: str) -> None:
        if self._end is None and self.result is None:
            self.told.warnings.append(why)
            self._stop(Outcome.FAILED, why)

    def _stop(self, outcome: Outcome, why: str, *, stands: bool = True) -> None:
        """Ends the flight with a hold. The first reason counts."""
        if self._end is not None or self.result is not None:
            return
        if self._phase in (Phase.STARTING, Phase.ON_GROUND):
            ended = Outcome.REFUSED if outcome is Outcome.FAILED and self._phase is Phase.STARTING else outcome
            sent = "It stays on the ground." if self._has_commanded else "Nothing was sent to the drone."
            self._over(ended, f"{why}. {sent}")
            return
        self._port.stop()
        self._end = FlightEnd(self._maker, outcome, why, stands=stands and self._phase is not Phase.TAKING_OFF)

    def _holding(self, end: FlightEnd, around: Around, now: float) -> list[bytes]:
        if not end.began and (self._commanded != self._commanded_now() or around.holding or not around.heard):
            self._over(end.outcome, f"{end.why}; nothing more was sent to it. {state_words(around)}")
            return []
        out = end.due(around, now)
        words = end.words(around)
        if words:
            self._over(end.outcome, f"{words} {self.told.meter.words(now)}")
            self.told.warnings.append(words)
        return out

    def _over(self, outcome: Outcome, words: str) -> None:
        if self.result is None:
            self._port.stop()
            self.result = (outcome, words[:600])
