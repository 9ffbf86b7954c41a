"""What the agent does when the tower stays lost while the drone is in the air. No I/O.

Laws, each with a test:
- It counts from the loss of the tower, aloud: at ten-second steps, then 5, 4, 3, 2, 1.
- When the time is up, the tables say what to do. Return that is refused becomes land. Silence is no refusal: return is
  asked for RUNG_PATIENCE_S before landing is, because where it is there may be water.
- It is asked for until COMMAND_ACK and HEARTBEAT confirm it, or the tower is back, or the drone is down.
- Once for each loss. When the tower is back nothing is changed by itself.
"""

from dataclasses import dataclass
from typing import Any, Final

from onboard_agent.flight_modes import FlightMode, Modes
from onboard_agent.lost_action_table import DEEDS, NEXT, Deed, LostEvent, LostPhase, Situation
from onboard_agent.mode_ladder import LadderStep, ModeLadder
from onboard_agent.own_frames import FrameMaker
from wire.control_messages import SafetySettings

RUNG_PATIENCE_S: Final = 5.0

_LAST_SECONDS: Final = 5


@dataclass(frozen=True)
class Loss:
    """What there is to know at a tick."""

    tower_gone_s: float
    """0 while the tower is there."""
    ours: bool
    """Armed, in the air, and not flown by a radio pilot alone."""
    custom_mode: int
    mission_before_hold: bool
    """We hold because of the loss, and a mission was flown before."""


class LostActing:
    """`tick` it; it says once which deed begins. Then `due` hands out the requests for the mode."""

    def __init__(self, maker: FrameMaker) -> None:
        self.phase = LostPhase.QUIET
        self._ladder = ModeLadder(maker)
        self._told_s = 0
        self._notices: list[str] = []

    def tick(self, now: float, *, loss: Loss, settings: SafetySettings, modes: Modes | None) -> Deed | None:
        """Time has passed. Returns the deed in the very call in which it begins."""
        if loss.tower_gone_s <= 0.0:
            self._end(LostEvent.BACK, "the tower is back")
        elif not loss.ours:
            self._end(LostEvent.CALLED_OFF, "the drone is on the ground, or not ours to bring home")
        elif self.phase is LostPhase.QUIET and loss.tower_gone_s >= settings.lost_hold_s:
            self._fire(LostEvent.GONE)
            self._told_s = int(settings.lost_action_s) + 1
            self._say(
                f"the tower is lost: {settings.lost_action} in {settings.lost_action_s - loss.tower_gone_s:.0f} s"
            )
        if self.phase is not LostPhase.COUNTING:
            return None
        remaining_s = settings.lost_action_s - loss.tower_gone_s
        if remaining_s > 0.0:
            self._count(remaining_s, settings)
            return None
        deed = DEEDS[settings.lost_action, situation(loss, modes)]
        wanted = _wanted(deed, modes)
        if wanted:
            self._ladder.climb(wanted, patience_s=RUNG_PATIENCE_S, now=now)
        self._fire(LostEvent.DUE_MODE if wanted else LostEvent.DUE_NOTHING)
        none_known = deed in (Deed.RETURN, Deed.LAND, Deed.RESUME_MISSION) and not wanted
        self._say(f"the tower stays lost: {deed}" + (", but no such mode is known for this vehicle" * none_known))
        return Deed.STOP_STICKS if none_known else deed

    def due(self, now: float, *, vehicle_system_id: int) -> list[bytes]:
        """Requests to send now."""
        if self.phase is not LostPhase.ASKING:
            return []
        frames = self._ladder.due(now, vehicle_system_id=vehicle_system_id)
        self._follow_ladder()
        return frames

    def acknowledged(self, ack: Any, now: float) -> None:
        """A COMMAND_ACK for MAV_CMD_DO_SET_MODE that is meant for us."""
        if self.phase is LostPhase.ASKING:
            self._ladder.acknowledged(ack, now)
            self._follow_ladder()

    def heartbeat(self, custom_mode: int) -> None:
        """A HEARTBEAT of the autopilot."""
        if self.phase is LostPhase.ASKING:
            self._ladder.heartbeat(custom_mode)
            self._follow_ladder()

    def take_notices(self) -> list[str]:
        """Lines for the log since the last call."""
        notices, self._notices = self._notices, []
        return notices

    def _follow_ladder(self) -> None:
        for step, detail in self._ladder.take_reached():
            self._say(f"{detail} {step}")
            if step is LadderStep.CONFIRMED:
                self._fire(LostEvent.CONFIRMED)

    def _count(self, remaining_s: float, settings: SafetySettings) -> None:
        whole_s = int(remaining_s) + 1
        if whole_s < self._told_s and (whole_s <= _LAST_SECONDS or whole_s % 10 == 0):
            self._say(f"the tower is lost: {settings.lost_action} in {whole_s} s")
        self._told_s = min(self._told_s, whole_s)

    def _end(self, event: LostEvent, why: str) -> None:
        if self.phase is LostPhase.QUIET:
            return
        self._say(f"{why}; it was {self.phase}")
        self._fire(event)
        self._ladder.stop()

    def _fire(self, event: LostEvent) -> None:
        self.phase = NEXT.get((self.phase, event), self.phase)

    def _say(self, line: str) -> None:
        self._notices.append(line)


def situation(loss: Loss, modes: Modes | None) -> Situation:
    """What the drone is doing."""
    if modes is None:
        return Situation.OTHERWISE
    if any(loss.custom_mode == mode.custom_mode for mode in modes.going_home):
        return Situation.GOING_HOME
    if loss.custom_mode == modes.mission.custom_mode:
        return Situation.ON_MISSION
    return Situation.HELD_ON_MISSION if loss.mission_before_hold else Situation.OTHERWISE


def _wanted(deed: Deed, modes: Modes | None) -> tuple[FlightMode, ...]:
    if modes is None:
        return ()
    if deed is Deed.RETURN:
        return (modes.return_, modes.land)
    if deed is Deed.LAND:
        return (modes.land,)
    if deed is Deed.RESUME_MISSION:
        return (modes.mission,)
    return ()
