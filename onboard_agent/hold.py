"""The hold: the machine keeps its height while the controls change hands, or when nobody has them. No I/O.

Laws, each with a test:
- From the order on, sticks from the tower pass only once the holder has centred them (`StickGate` holds the rule).
- Centred sticks are sent at 20 Hz until the new holder's sticks have come centred, or the holder flies by command,
  or in an ordered hold the tower is gone, or the bound has passed, or the lost action begins. Never for ever: they hide
  the loss of the pilot from the autopilot's own failsafe.
- The modes of the ladder are asked for in order until one is confirmed (`ModeLadder` holds the rules).
- What the holder of the new epoch commands wins over the hold: no mode is asked for against it, and the hold ends when
  the autopilot shows that it obeys. Until then, and if it refuses, the sticks stay centred.
- Each step is reported when it is done, not when it is planned.
"""

from collections.abc import Sequence
from typing import Any, Final

from onboard_agent.flight_modes import FlightMode
from onboard_agent.hold_table import NEXT, HoldEvent, HoldPhase
from onboard_agent.mode_ladder import FAST_FOR_S, LadderStep, ModeLadder
from onboard_agent.own_frames import FrameMaker, centred_sticks, ground_station_sender
from wire.control_messages import HoldCause, HoldProgress, HoldStep, SafetySettings

STICKS_INTERVAL_S: Final = 0.05
RUNG_PATIENCE_S: Final = 0.75
"""Three requests. The longest ladder (three position holds) has come to altitude hold before DEADLINE_S."""

DEADLINE_S: Final = FAST_FOR_S
"""By then the tower is told that the hold is unconfirmed."""

_EARLY_S: Final = 0.005
"""How much before its time a stick frame may go, so that the ticks' jitter does not halve the rate."""

_EVENTS: Final = {LadderStep.ACCEPTED: HoldEvent.ACCEPTED, LadderStep.CONFIRMED: HoldEvent.MODE_SHOWN}


class Hold:
    """One at a time. `begin`, then `tick`; feed it heartbeats, acknowledgements and what the holder commands.

    `steps_told`: where the numbers of the steps begin; each process wants another beginning (HoldProgress).
    """

    def __init__(self, maker: FrameMaker, steps_told: int = 0) -> None:
        self._maker = maker
        self.phase = HoldPhase.IDLE
        self.sticks_on = False
        self.cause = HoldCause.ORDER
        self.outside_fence = False
        """The autopilot says that it is beyond its fence: ArduCopter then leaves its mode for no other."""
        self._ladder = ModeLadder(maker)
        self._settings = SafetySettings()
        self._order_id = 0
        self._epoch = 0
        self._began_at = 0.0
        self._next_sticks_at = 0.0
        self._modes_known = False
        self._waits = False
        self._deadline_told = False
        self._progress: list[HoldProgress] = []
        self._steps_told = steps_told

    @property
    def active(self) -> bool:
        """Whether there is anything left to do."""
        return self.sticks_on or self._wants_mode

    def begin(
        self,
        *,
        cause: HoldCause,
        order_id: int,
        epoch: int,
        rungs: Sequence[FlightMode],
        settings: SafetySettings,
        needed: bool,
        now: float,
        why: str = "",
    ) -> None:
        """Holds now. `needed` is False for a machine known to be disarmed; no rungs if it has no such mode.

        `why`: the reason for a person, of a hold that nobody ordered.
        """
        self.cause = cause
        self._order_id = order_id
        self._epoch = epoch
        self._settings = settings
        self._began_at = self._next_sticks_at = now
        self._modes_known = bool(rungs)
        self._waits = False
        self._deadline_told = False
        self.phase = HoldPhase.IDLE
        self.sticks_on = False
        self._ladder.stop()
        if cause is not HoldCause.ORDER:
            self._report(HoldStep.ORDERED, why, now)
        if not needed:
            self._report(HoldStep.NOT_NEEDED, "the drone is disarmed", now)
            return
        self.phase = HoldPhase.REQUESTING
        self.sticks_on = True
        self._ladder.climb(rungs, patience_s=RUNG_PATIENCE_S, now=now)

    def modes_became_known(self, rungs: Sequence[FlightMode], now: float) -> None:
        """The autopilot was found only after the hold had begun."""
        if self._wants_mode and not self._modes_known and rungs:
            self._modes_known = True
            self._ladder.climb(rungs, patience_s=RUNG_PATIENCE_S, now=now)

    def tick(
        self,
        now: float,
        *,
        vehicle_system_id: int,
        ground_station_system_id: int,
        tower_silent_s: float,
    ) -> list[bytes]:
        """Frames to send to the autopilot now."""
        if not self.active:
            return []
        frames: list[bytes] = []
        elapsed_s = now - self._began_at
        if elapsed_s >= self._settings.hold_bound_s:
            self.sticks_on = False
            self._fire(HoldEvent.BOUND_PASSED, now, self._why_unconfirmed())
            return []
        if self.cause is HoldCause.ORDER and tower_silent_s >= self._settings.lost_hold_s:
            self.sticks_on = False
        if self.sticks_on and now >= self._next_sticks_at - _EARLY_S:
            first = self._next_sticks_at == self._began_at
            self._next_sticks_at = max(self._next_sticks_at + STICKS_INTERVAL_S, now)
            sender = ground_station_sender(ground_station_system_id)
            frames.append(self._maker.make(centred_sticks(vehicle_system_id), sender))
            if first:
                self._report(HoldStep.STICKS_CENTRED, "", now)
        if self._wants_mode and not self._waits:
            frames += self._ladder.due(now, vehicle_system_id=vehicle_system_id)
            self._follow_ladder(now)
        if elapsed_s >= DEADLINE_S and not self._deadline_told:
            self._deadline_told = True
            self._fire(HoldEvent.DEADLINE_PASSED, now, self._why_unconfirmed())
        return frames

    def acknowledged(self, ack: Any, now: float) -> None:
        """A COMMAND_ACK of the autopilot for MAV_CMD_DO_SET_MODE that is meant for us."""
        if self._wants_mode:
            self._ladder.acknowledged(ack, now)
            self._follow_ladder(now)

    def heartbeat(self, *, armed: bool, custom_mode: int, now: float) -> None:
        """A HEARTBEAT of the autopilot."""
        if not self.active:
            return
        if not armed:
            self.sticks_on = False
            self._fire(HoldEvent.DISARMED, now, "the drone is disarmed")
        elif self._wants_mode:
            self._ladder.heartbeat(custom_mode)
            self._follow_ladder(now)

    def stop_sticks(self) -> None:
        """The holder's own sticks have come, and were centred: ours stop. The mode is still wanted."""
        self.sticks_on = False

    def wait(self) -> None:
        """The holder has commanded to fly without sticks: until it is seen what comes of it, no mode is asked for."""
        self._waits = True

    def go_on(self) -> None:
        """Nothing came of it."""
        self._waits = False

    def overruled(self, *, needs_sticks: bool, now: float, why: str = "the holder has commanded otherwise") -> None:
        """Somebody says how to fly instead. Where that needs no sticks, ours stop too."""
        self._fire(HoldEvent.OVERRULED, now, why)
        if not needs_sticks:
            self.sticks_on = False

    def take_progress(self) -> list[HoldProgress]:
        """The steps done since the last call, in order."""
        progress, self._progress = self._progress, []
        return progress

    @property
    def _wants_mode(self) -> bool:
        return self.phase in (HoldPhase.REQUESTING, HoldPhase.ACKNOWLEDGED, HoldPhase.UNCONFIRMED)

    def _follow_ladder(self, now: float) -> None:
        for step, detail in self._ladder.take_reached():
            if step is LadderStep.REQUESTED:
                self._report(HoldStep.MODE_REQUESTED, detail, now)
            else:
                self._fire(_EVENTS[step], now, detail)

    def _why_unconfirmed(self) -> str:
        if not self._modes_known:
            return "no altitude-hold mode is known for this vehicle"
        fence = "; it is outside its fence and may keep its mode until it is inside again" if self.outside_fence else ""
        return self._ladder.why_not() + fence

    def _fire(self, event: HoldEvent, now: float, detail: str = "") -> None:
        """Takes the transition that the table has for this event; where it has none, the event means nothing here."""
        transition = NEXT.get((self.phase, event))
        if transition is None:
            return
        self.phase, step = transition
        if step is not None:
            self._report(step, detail, now)

    def _report(self, step: HoldStep, detail: str, now: float) -> None:
        elapsed_ms = round((now - self._began_at) * 1000.0, 1)
        self._steps_told += 1
        self._progress.append(
            HoldProgress(
                number=self._steps_told,
                order_id=self._order_id,
                epoch=self._epoch,
                step=step,
                detail=detail,
                elapsed_ms=elapsed_ms,
                cause=self.cause,
            )
        )
