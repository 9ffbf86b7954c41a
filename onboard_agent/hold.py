"""The hold: the machine keeps its height while the controls change hands, or when nobody has them. No I/O.

Laws, each with a test:
- From the order on, sticks from the tower pass only once the holder has centred them (`StickGate` holds the rule).
- Centred sticks are sent at 20 Hz until the new holder's sticks have come centred, or the holder flies by command,
  or the tower is gone (unless its being gone is why we hold), or BOUND_S has passed. Never for ever: they hide the loss
  of the pilot from the autopilot's own failsafe.
- The mode is asked for again until COMMAND_ACK says accepted *and* a heartbeat after the order shows it.
- What the holder of the new epoch commands wins over the hold at once.
- Each step is reported when it is done, not when it is planned.
"""

from enum import StrEnum
from typing import Any, Final

from onboard_agent.flight_modes import HoldMode
from onboard_agent.hold_table import NEXT, HoldEvent, HoldPhase
from onboard_agent.own_frames import FrameMaker, agent_sender, centred_sticks, ground_station_sender, set_mode
from wire.control_messages import HoldProgress, HoldStep
from wire.dialect import mavlink

STICKS_INTERVAL_S: Final = 0.05
MODE_RETRY_S: Final = 0.25
MODE_LATE_RETRY_S: Final = 1.0
"""After the deadline: still worth asking, no longer worth flooding a slow line."""

DEADLINE_S: Final = 3.0
"""By then the tower is told that the hold is unconfirmed."""

BOUND_S: Final = 30.0
TOWER_GONE_S: Final = 2.0
IN_PROGRESS_WAIT_S: Final = 1.0

_EARLY_S: Final = 0.005
"""How much before its time a stick frame may go, so that the ticks' jitter does not halve the rate."""


class HoldCause(StrEnum):
    """Who began it."""

    ORDER = "order"
    PILOT_LOST = "pilot lost"


class Hold:
    """One at a time. `begin`, then `tick`; feed it heartbeats, acknowledgements and what the holder commands."""

    def __init__(self, maker: FrameMaker) -> None:
        self._maker = maker
        self.phase = HoldPhase.IDLE
        self.sticks_on = False
        self._cause = HoldCause.ORDER
        self._order_id = 0
        self._epoch = 0
        self._mode: HoldMode | None = None
        self._began_at = 0.0
        self._next_sticks_at = 0.0
        self._next_request_at = 0.0
        self._requests = 0
        self._deadline_told = False
        self._mode_shown = False
        self._last_answer = "no answer from the autopilot"
        self._progress: list[HoldProgress] = []

    @property
    def active(self) -> bool:
        """Whether there is anything left to do."""
        return self.sticks_on or self.phase in (HoldPhase.REQUESTING, HoldPhase.ACKNOWLEDGED, HoldPhase.UNCONFIRMED)

    def begin(
        self, *, cause: HoldCause, order_id: int, epoch: int, mode: HoldMode | None, needed: bool, now: float
    ) -> None:
        """Holds now. `needed` is False for a machine known to be disarmed; `mode` is None if it has no such mode."""
        self._cause = cause
        self._order_id = order_id
        self._epoch = epoch
        self._mode = mode
        self._began_at = self._next_sticks_at = self._next_request_at = now
        self._requests = 0
        self._deadline_told = False
        self._mode_shown = False
        self._last_answer = "no answer from the autopilot"
        self.phase = HoldPhase.IDLE
        self.sticks_on = False
        if cause is HoldCause.PILOT_LOST:
            self._report(HoldStep.ORDERED, "the pilot was lost while flying by hand", now)
        if not needed:
            self._report(HoldStep.NOT_NEEDED, "the drone is disarmed", now)
            return
        self.phase = HoldPhase.REQUESTING
        self.sticks_on = True

    def tick(
        self, now: float, *, vehicle_system_id: int, ground_station_system_id: int, tower_silent_s: float
    ) -> list[bytes]:
        """Frames to send to the autopilot now."""
        if not self.active:
            return []
        frames: list[bytes] = []
        elapsed_s = now - self._began_at
        if elapsed_s >= BOUND_S:
            self.sticks_on = False
            self._fire(HoldEvent.BOUND_PASSED, now, self._why_unconfirmed())
            return []
        if self._cause is HoldCause.ORDER and tower_silent_s >= TOWER_GONE_S:
            self.sticks_on = False
        if self.sticks_on and now >= self._next_sticks_at - _EARLY_S:
            first = self._next_sticks_at == self._began_at
            self._next_sticks_at = max(self._next_sticks_at + STICKS_INTERVAL_S, now)
            sender = ground_station_sender(ground_station_system_id)
            frames.append(self._maker.make(centred_sticks(vehicle_system_id), sender))
            if first:
                self._report(HoldStep.STICKS_CENTRED, "", now)
        if self._asking_for_mode and now >= self._next_request_at:
            frames.extend(self._request_mode(vehicle_system_id, now))
        if elapsed_s >= DEADLINE_S and not self._deadline_told:
            self._deadline_told = True
            self._fire(HoldEvent.DEADLINE_PASSED, now, self._why_unconfirmed())
        return frames

    def acknowledged(self, ack: Any, now: float) -> None:
        """A COMMAND_ACK of the autopilot for MAV_CMD_DO_SET_MODE that is meant for us."""
        if not self._asking_for_mode or not self._requests:
            return
        if ack.result == mavlink.MAV_RESULT_ACCEPTED:
            self._fire(HoldEvent.ACCEPTED, now)
            if self._mode_shown:
                self._fire(HoldEvent.MODE_SHOWN, now, self._mode_name)
        elif ack.result == mavlink.MAV_RESULT_IN_PROGRESS:
            self._next_request_at = now + IN_PROGRESS_WAIT_S
        else:
            self._last_answer = f"the autopilot refuses {self._mode_name}: {_result_name(ack.result)}"

    def heartbeat(self, *, armed: bool, custom_mode: int, now: float) -> None:
        """A HEARTBEAT of the autopilot."""
        if not self.active:
            return
        if not armed:
            self.sticks_on = False
            self._fire(HoldEvent.DISARMED, now, "the drone is disarmed")
            return
        self._mode_shown = self._mode is not None and custom_mode == self._mode.custom_mode
        if self._mode_shown:
            self._fire(HoldEvent.MODE_SHOWN, now, self._mode_name)

    def sticks_taken_over(self) -> None:
        """The holder's own sticks have come, and were centred: ours stop. The mode is still wanted."""
        self.sticks_on = False

    def overruled(self, *, needs_sticks: bool, now: float) -> None:
        """The holder commands how to fly. Where that needs no sticks, ours stop too."""
        self._fire(HoldEvent.OVERRULED, now, "the holder has commanded otherwise")
        if not needs_sticks:
            self.sticks_on = False

    def take_progress(self) -> list[HoldProgress]:
        """The steps done since the last call, in order."""
        progress, self._progress = self._progress, []
        return progress

    @property
    def _asking_for_mode(self) -> bool:
        return self.phase in (HoldPhase.REQUESTING, HoldPhase.ACKNOWLEDGED, HoldPhase.UNCONFIRMED)

    @property
    def _mode_name(self) -> str:
        return self._mode.name if self._mode is not None else "altitude hold"

    def _request_mode(self, vehicle_system_id: int, now: float) -> list[bytes]:
        if self._mode is None:
            return []
        late = now - self._began_at >= DEADLINE_S
        self._next_request_at = now + (MODE_LATE_RETRY_S if late else MODE_RETRY_S)
        message = set_mode(vehicle_system_id, self._mode.command_parameters, confirmation=self._requests)
        self._requests += 1
        if self._requests == 1:
            self._report(HoldStep.MODE_REQUESTED, self._mode_name, now)
        return [self._maker.make(message, agent_sender(vehicle_system_id))]

    def _why_unconfirmed(self) -> str:
        if self._mode is None:
            return "no altitude-hold mode is known for this vehicle"
        if self.phase is HoldPhase.ACKNOWLEDGED:
            return f"{self._mode.name} was accepted, but the heartbeat does not show it"
        return self._last_answer

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
        self._progress.append(
            HoldProgress(order_id=self._order_id, epoch=self._epoch, step=step, detail=detail, elapsed_ms=elapsed_ms)
        )


def _result_name(result: int) -> str:
    entry = mavlink.enums["MAV_RESULT"].get(result)
    return str(entry.name).removeprefix("MAV_RESULT_") if entry is not None else f"result {result}"
