"""The lost action: what the agent does when the tower or the person stays lost while the drone is in the air. No I/O.

Rules, each tested:
- The countdown starts at the loss and is announced at ten-second steps, then at 5, 4, 3, 2, 1.
- When the time is up, the tables select the response. A refused return becomes a landing. Silence is not a refusal: the
  return is requested for RUNG_PATIENCE_S before a landing, because there may be water below.
- The request is repeated until COMMAND_ACK and HEARTBEAT confirm it, somebody flies, or the drone is down.
- "Stay" ends the countdown for a lost person, not for a lost tower. A battery needed for the way home overrides both
  after BATTERY_NOTICE_S.
- Where the autopilot acts first, because it hears no ground station any more, its action is counted and reported.
- The action runs once for each loss. When the tower returns, the agent changes nothing by itself.
"""

from dataclasses import dataclass, replace
from typing import Any, Final

from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.failsafe.lost_action_table import (
    NEXT,
    REPORTED_ACTION,
    RESPONSES,
    LossResponse,
    LostEvent,
    Situation,
)
from onboard_agent.failsafe.mode_ladder import LadderStep, ModeLadder
from wire.autopilots.profile import FailsafeModes, FlightMode
from wire.control_messages import SafetySettings
from wire.open_holds import Lost, LostAction, LostPhase

RUNG_PATIENCE_S: Final = 5.0
BATTERY_NOTICE_S: Final = 10.0
"""Advance notice, in which a person can still fly the drone home."""

OVERDUE_S: Final = 5.0
"""An autopilot that has not acted by then hears another ground station."""

_LAST_SECONDS: Final = 5
_WAITING: Final = frozenset({LostPhase.COUNTING, LostPhase.STAYED})
_BEFORE_ACTING: Final = frozenset({LostPhase.QUIET, LostPhase.COUNTING, LostPhase.STAYED})
_STAYING: Final = frozenset({LostAction.STAY, LostAction.CONTINUE})
_MODES_NEEDED: Final = frozenset({LossResponse.RETURN, LossResponse.LAND, LossResponse.RESUME_MISSION})


@dataclass(frozen=True)
class Loss:
    """Inputs of one tick."""

    tower_gone_s: float
    """0 while the tower is present."""
    person_gone_s: float | None = None
    """None while somebody flies, or nobody needs to."""
    stayed: bool = False
    """A person said "stay", which applies to the loss of the person."""
    ours: bool = True
    """Armed, in the air, and not flown by a radio pilot alone."""
    custom_mode: int = 0
    mission_is_over: bool = False
    """The autopilot is perhaps still in its mission mode, but has nothing left to fly."""
    mission_before_hold: bool = False
    """The drone holds because of the loss, and flew a mission before."""
    drifts: bool = False
    """The drone has no position."""
    battery_due: bool = False
    """The battery is at the level that the way home needs."""
    own: tuple[LostAction, float] | None = None
    """What the autopilot does by itself, because it hears no ground station, and in how many seconds."""


class LostActionRunner:
    """Call `tick`, which returns a response once, when it begins. Then `due` returns the mode requests."""

    def __init__(self, maker: FrameMaker) -> None:
        self.phase = LostPhase.QUIET
        self.lost: Lost | None = None
        self.due_in_s: float | None = None
        """Seconds until the action, during the countdown."""
        self.action: LostAction | None = None
        """What will be done, is being done, or was done."""
        self.detail = ""
        """The last notice."""
        self._ladder = ModeLadder(maker)
        self._announced_s = 0
        self._left_alone = False
        self._battery_at: float | None = None
        self._counts_own = False
        """The countdown is that of the autopilot's own failsafe."""
        self._notices: list[str] = []

    def tick(
        self, now: float, *, loss: Loss, settings: SafetySettings, modes: FailsafeModes | None
    ) -> LossResponse | None:
        """Advances time. Returns the response in the call in which it begins."""
        tower = loss.tower_gone_s >= settings.lost_hold_s
        person = loss.person_gone_s is not None
        if self._counts_own and loss.ours and situation(loss, modes) is Situation.GOING_HOME:
            if self.phase is LostPhase.COUNTING and self.action is not None:
                self.done_by_autopilot(self.action, f"the autopilot hears no ground station: {self.action}")
            return None
        counted_own, self._counts_own = self._counts_own, False
        if loss.own is not None and loss.ours and loss.own[1] > -OVERDUE_S and self.phase in _BEFORE_ACTING:
            ours_in_s = self._ours_in_s(now, loss, settings, modes, tower=tower, person=person)
            if ours_in_s is None or loss.own[1] < ours_in_s:
                self._count_own(*loss.own)
                return None
        if counted_own:
            self._end(LostEvent.BACK, "the autopilot hears a ground station")
        if not (tower or person):
            # A silence of the tower shorter than `lost_hold_s` has not started the countdown.
            self._left_alone = False
            self._end(LostEvent.BACK, "somebody is there")
        elif not loss.ours:
            self._end(LostEvent.CALLED_OFF, "the drone is on the ground, or not ours to bring home")
        else:
            return self._lost_now(now, loss, settings, modes, tower=tower)
        return None

    def _ours_in_s(
        self,
        now: float,
        loss: Loss,
        settings: SafetySettings,
        modes: FailsafeModes | None,
        *,
        tower: bool,
        person: bool,
    ) -> float | None:
        """When the agent would act; None: it would not."""
        if not (tower or person):
            return None
        response = RESPONSES[settings.lost_action, situation(loss, modes)]
        acts = response not in (LossResponse.LEAVE, LossResponse.STAY)
        return self._remaining_s(now, loss, settings) if acts else None

    def _count_own(self, action: LostAction, in_s: float) -> None:
        """Announces what the autopilot is about to do."""
        if self.phase is LostPhase.QUIET:
            self._announced_s = round(in_s)
            self._say(f"the autopilot hears no ground station: {action} in {in_s:.0f} s")
        self._counts_own = True
        self.phase, self.lost, self.action, self.due_in_s = LostPhase.COUNTING, Lost.PERSON, action, max(in_s, 0.0)

    def _lost_now(
        self, now: float, loss: Loss, settings: SafetySettings, modes: FailsafeModes | None, *, tower: bool
    ) -> LossResponse | None:
        self.lost = Lost.TOWER if tower else Lost.PERSON
        if not tower and settings.lost_action in _STAYING:
            loss = replace(loss, drifts=False)  # the tower still sees the drone, and a person may help
        response = self._battery(now, loss, RESPONSES[settings.lost_action, situation(loss, modes)])
        remaining_s = self._remaining_s(now, loss, settings)
        if self.phase is LostPhase.QUIET:
            if response is LossResponse.LEAVE:
                if situation(loss, modes) is Situation.ON_MISSION:
                    self._leave_alone()
                return None
            self._left_alone = False
            self._fire(LostEvent.GONE)
            self._announced_s = round(remaining_s)
            self._say(f"the {self.lost} is lost: {response} in {remaining_s:.0f} s")
        if self.phase not in _WAITING:
            return None
        self.action = REPORTED_ACTION[response]
        self._count_or_stay(response, said=loss.stayed and not tower and self._battery_at is None)
        self.due_in_s = max(remaining_s, 0.0) if self.phase is LostPhase.COUNTING else None
        if self.phase is LostPhase.STAYED:
            return None
        if remaining_s > 0.0:
            self._count(remaining_s, response)
            return None
        if response is LossResponse.STAY:
            self._fire(LostEvent.STAY)
            self._say("it stays until the battery is needed for the way home")
            self.due_in_s = None
            return None
        return self._begin(response, now, modes)

    def _battery(self, now: float, loss: Loss, response: LossResponse) -> LossResponse:
        """Returns the response, changed if the battery is needed for the way home. Records since when it is."""
        if not loss.battery_due or response is LossResponse.LEAVE or self.phase not in _WAITING:
            self._battery_at = None
            return response
        if self._battery_at is None:
            self._battery_at = now
            self._say("the battery is needed for the way home")
        return LossResponse.LAND if loss.drifts or response is LossResponse.LAND else LossResponse.RETURN

    def _leave_alone(self) -> None:
        """Lets the mission continue without a countdown. A countdown may start after the mission."""
        if not self._left_alone:
            self._left_alone = True
            self._say(f"the {self.lost} is lost: {LossResponse.LEAVE}")

    def _begin(self, response: LossResponse, now: float, modes: FailsafeModes | None) -> LossResponse:
        wanted = _wanted(response, modes)
        self.due_in_s = None
        self.action = REPORTED_ACTION[response]
        if wanted:
            self._ladder.climb(wanted, patience_s=RUNG_PATIENCE_S, now=now, keeps_shown=True)
        self._fire(LostEvent.DUE_MODE if wanted else LostEvent.DUE_NOTHING)
        none_known = response in _MODES_NEEDED and not wanted
        words = ", but no such mode is known for this vehicle" if none_known else ""
        self._say(f"the {self.lost} stays lost: {response}{words}")
        return LossResponse.STOP_STICKS if none_known else response

    def _count_or_stay(self, response: LossResponse, *, said: bool) -> None:
        if self.phase is LostPhase.COUNTING and said:
            self._fire(LostEvent.STAY)
            self._say("it stays for ten minutes, as somebody said, or until the battery is needed for the way home")
        elif self.phase is LostPhase.STAYED and not said and response is not LossResponse.STAY:
            self._fire(LostEvent.COUNT)

    def _remaining_s(self, now: float, loss: Loss, settings: SafetySettings) -> float:
        """Seconds left, from the older loss that counts; fewer if the battery is needed earlier."""
        gone = [loss.tower_gone_s] if loss.tower_gone_s >= settings.lost_hold_s else []
        if loss.person_gone_s is not None and not loss.stayed:
            gone.append(loss.person_gone_s)
        remaining_s = settings.lost_action_s - max(gone, default=0.0)
        if self._battery_at is None:
            return remaining_s
        return min(remaining_s, BATTERY_NOTICE_S - (now - self._battery_at))

    def done_by_autopilot(self, action: LostAction, words: str) -> None:
        """The autopilot goes home by itself while a person is lost."""
        self._ladder.stop()
        self.phase, self.lost, self.action, self.due_in_s = LostPhase.DONE, Lost.PERSON, action, None
        self._say(words)

    def restart(self) -> None:
        """Ends the response to an earlier loss, because a hold begins."""
        self._ladder.stop()
        self.phase = LostPhase.QUIET
        self.lost = self.action = self.due_in_s = None

    def due(self, now: float, *, vehicle_system_id: int) -> list[bytes]:
        """Requests to send now."""
        if self.phase is not LostPhase.ASKING:
            return []
        frames = self._ladder.due(now, vehicle_system_id=vehicle_system_id)
        self._follow_ladder()
        return frames

    def acknowledged(self, ack: Any, now: float) -> None:
        """Handles a COMMAND_ACK for MAV_CMD_DO_SET_MODE that is addressed to the agent."""
        if self.phase is LostPhase.ASKING:
            self._ladder.acknowledged(ack, now)
            self._follow_ladder()

    def heartbeat(self, custom_mode: int) -> None:
        """A HEARTBEAT of the autopilot."""
        if self.phase is LostPhase.ASKING:
            self._ladder.heartbeat(custom_mode)
            self._follow_ladder()

    def pop_notices(self) -> list[str]:
        """Lines for the log since the last call."""
        notices, self._notices = self._notices, []
        return notices

    def _follow_ladder(self) -> None:
        for step, detail in self._ladder.pop_reached():
            self._say(f"{detail} {step}")
            if step is LadderStep.CONFIRMED:
                self._fire(LostEvent.CONFIRMED)

    def _count(self, remaining_s: float, response: LossResponse) -> None:
        whole_s = int(remaining_s) + 1
        if whole_s < self._announced_s and (whole_s <= _LAST_SECONDS or whole_s % 10 == 0):
            self._say(f"the {self.lost} is lost: {response} in {whole_s} s")
        self._announced_s = min(self._announced_s, whole_s)

    def _end(self, event: LostEvent, why: str) -> None:
        if self.phase is LostPhase.QUIET:
            return
        self._say(f"{why}; it was {self.phase}")
        self._fire(event)
        self._ladder.stop()
        self.lost = self.action = self.due_in_s = None

    def _fire(self, event: LostEvent) -> None:
        self.phase = NEXT.get((self.phase, event), self.phase)

    def _say(self, line: str) -> None:
        self.detail = line
        self._notices.append(line)


def situation(loss: Loss, modes: FailsafeModes | None) -> Situation:
    """Classifies what the drone is doing."""
    if modes is None:
        return Situation.OTHERWISE
    if any(loss.custom_mode == mode.custom_mode for mode in modes.going_home):
        return Situation.GOING_HOME
    if loss.drifts:
        return Situation.NO_POSITION
    if loss.custom_mode == modes.mission.custom_mode and not loss.mission_is_over:
        return Situation.ON_MISSION
    return Situation.HELD_ON_MISSION if loss.mission_before_hold else Situation.OTHERWISE


def _wanted(response: LossResponse, modes: FailsafeModes | None) -> tuple[FlightMode, ...]:
    if modes is None:
        return ()
    if response is LossResponse.RETURN:
        return (modes.return_, modes.land)
    if response is LossResponse.LAND:
        return (modes.land,)
    if response is LossResponse.RESUME_MISSION:
        return (modes.mission,)
    return ()
