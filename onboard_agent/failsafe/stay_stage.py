"""Stage two of a hold: a mode that keeps its place without sticks. No I/O; takes `now`.

Rules, each tested:
- The mode is requested once the drone is in the air, level, no longer sinking and has a position. If the autopilot does
  not report this, after UNKNOWN_WAIT_S. Altitude hold stops a descent within 2.2 m; braking needs 3.8 m.
- The mode is confirmed when COMMAND_ACK and HEARTBEAT agree, like every mode (`ModeLadder`).
- If all modes are refused, the agent retries every TRY_AGAIN_S, and stage one continues.
- A mode that the autopilot keeps when sticks stop is preferred, once the drone is still.
"""

from collections.abc import Sequence
from typing import Any, Final

from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.failsafe.flying import Flying
from onboard_agent.failsafe.mode_ladder import LadderStep, ModeLadder
from wire.autopilots.profile import FlightMode
from wire.open_holds import AfterSticks

RUNG_PATIENCE_S: Final = 0.75
UNKNOWN_WAIT_S: Final = 2.0
"""Altitude hold levels the drone from full tilt within 0.4 s (docs/control.md)."""
SLOW_DOWN_S: Final = 1.6
"""Altitude hold alone loses 2 m/s in this time; a mode that brakes then stops within 8 m from 8 m/s (measured)."""
TRY_AGAIN_S: Final = 5.0


class StayStage:
    """Call `start`, then `due` at each tick; feed it acknowledgements and heartbeats."""

    def __init__(self, maker: FrameMaker) -> None:
        self.mode: FlightMode | None = None
        """The confirmed mode."""
        self.waiting_for = ""
        self._ladder = ModeLadder(maker)
        self._modes: tuple[FlightMode, ...] = ()
        self._ready_since = 0.0
        self._try_at = 0.0
        self._refusal = ""

    def start(self, modes: Sequence[FlightMode], now: float) -> None:
        """Starts after stage one. `modes`: in order of preference; empty if the vehicle has no such mode."""
        self.end()
        self._modes = tuple(modes)
        self._ready_since = self._try_at = now
        self._refusal = ""

    def is_in(self, mode: FlightMode, modes: Sequence[FlightMode], now: float) -> None:
        """Stage one has ended in a mode that keeps its place."""
        self.start(modes, now)
        self.mode = mode

    def end(self) -> None:
        """Stops requesting."""
        self._ladder.stop()
        self._modes = ()
        self.mode = None
        self.waiting_for = ""

    @property
    def asking(self) -> bool:
        """Whether a mode is requested and not yet confirmed."""
        return self._ladder.asking

    @property
    def wanted(self) -> bool:
        """Whether stage two has started and not ended."""
        return bool(self._modes)

    def due(self, now: float, flying: Flying) -> list[bytes]:
        """Requests to send now."""
        if not self._modes:
            return []
        if not self._ladder.asking and now >= self._try_at:
            self._check(now, flying)
        frames = self._ladder.due(now, vehicle_system_id=flying.vehicle_system_id)
        self._follow(now)
        return frames

    def acknowledged(self, ack: Any, now: float) -> None:
        """Handles a COMMAND_ACK for MAV_CMD_DO_SET_MODE that is addressed to the agent."""
        self._ladder.acknowledged(ack, now)
        self._follow(now)

    def heartbeat(self, custom_mode: int, now: float) -> None:
        """A HEARTBEAT of the autopilot, armed."""
        self._ladder.heartbeat(custom_mode)
        self._follow(now)

    def _check(self, now: float, flying: Flying) -> None:
        if self.mode is not None:
            better = self._better(flying)
            if better is not None and flying.still:
                self._ladder.climb((better,), patience_s=RUNG_PATIENCE_S, now=now)
            return
        self.waiting_for = self._why_wait(now, flying)
        if not self.waiting_for:
            # Modes that continue without sticks come first.
            order = sorted(self._modes, key=lambda mode: flying.after_sticks(mode.custom_mode) != AfterSticks.STAYS)
            self._ladder.climb(order, patience_s=RUNG_PATIENCE_S, now=now)

    def _better(self, flying: Flying) -> FlightMode | None:
        """Returns a mode that continues without sticks, if the current one does not."""
        assert self.mode is not None
        if flying.after_sticks(self.mode.custom_mode) is AfterSticks.STAYS:
            return None
        stays = [mode for mode in self._modes if flying.after_sticks(mode.custom_mode) is AfterSticks.STAYS]
        return stays[0] if stays else None

    def _why_wait(self, now: float, flying: Flying) -> str:
        patient = now - self._ready_since < UNKNOWN_WAIT_S
        if not flying.airborne:
            return "it is on the ground"
        if flying.has_position is False:
            return "no position"
        if flying.sinking:
            return "still sinking"
        if flying.level is False or (flying.level is None and patient):
            return "not level yet"
        if flying.fast and now - self._ready_since < SLOW_DOWN_S:
            return "not slow enough yet"
        return ""

    def _follow(self, now: float) -> None:
        for step, _ in self._ladder.pop_reached():
            if step is LadderStep.CONFIRMED:
                self.mode = self._ladder.confirmed
                self.waiting_for = ""
                return
        if self._ladder.asking and self._ladder.all_refuse:
            self._ladder.stop()
            self._try_at = now + TRY_AGAIN_S
            if self.mode is None:
                self.waiting_for = self._ladder.why_not()
