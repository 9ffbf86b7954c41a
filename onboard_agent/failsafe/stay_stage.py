"""Stage two of a hold: a mode that keeps its place without sticks. No I/O; takes `now`.

Rules, each tested:
- The mode is requested once the drone is in the air, level, no longer sinking and has a position. If the autopilot does
  not report this, after UNKNOWN_WAIT_S. Altitude hold stops a descent within 2.2 m; braking needs 3.8 m. A descent that
  centred sticks have not stopped after SINKING_WAIT_S is none that they stop.
- PX4 takes the agent's own jump to centred sticks for a pilot's and leaves the mode again, so the sticks must not have
  moved for a time (`Flying.sticks_settle_s`).
- The mode is confirmed when COMMAND_ACK and HEARTBEAT agree, like every mode (`ModeLadder`).
- If all modes are refused, the agent retries every TRY_AGAIN_S, and stage one continues.
- A mode that the autopilot keeps when sticks stop is preferred, once the drone is still.
"""

from collections.abc import Sequence
from typing import Any, Final

from onboard_agent.autopilot.own_frames import FrameMaker, agent_sender, request_message
from onboard_agent.failsafe.flying import Flying
from onboard_agent.failsafe.mode_ladder import LadderStep, ModeLadder
from wire.autopilots.profile import FlightMode
from wire.dialect import mavlink
from wire.open_holds import AfterSticks

RUNG_PATIENCE_S: Final = 0.75
UNKNOWN_WAIT_S: Final = 2.0
"""Altitude hold levels the drone from full tilt within 0.4 s (docs/control.md)."""
SLOW_DOWN_S: Final = 1.6
"""Altitude hold alone loses 2 m/s in this time; a mode that brakes then stops within 8 m from 8 m/s (measured)."""
SINKING_WAIT_S: Final = 4.0
TRY_AGAIN_S: Final = 5.0
LEFT_WITHIN_S: Final = 8.0
"""A mode that was confirmed, and left this soon for one that needs sticks, was left because of sticks."""
LOOK_EVERY_S: Final = 0.25
LOOK_FOR_S: Final = 4.0
"""After the confirmation heartbeats are requested: PX4 sends only one a second, and needs 0.5 s to miss sticks."""


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
        self._maker = maker
        self._confirmed_at = 0.0
        self._look_at = 0.0

    def start(self, modes: Sequence[FlightMode], now: float) -> None:
        """Starts after stage one. `modes`: in order of preference; empty if the vehicle has no such mode."""
        self.end()
        self._modes = tuple(modes)
        self._ready_since = self._try_at = now
        self._refusal = ""

    def is_in(self, mode: FlightMode, modes: Sequence[FlightMode], now: float) -> None:
        """Stage one has ended in a mode that keeps its place."""
        self.start(modes, now)
        self._confirm(mode, now)

    def _confirm(self, mode: FlightMode, now: float) -> None:
        self.mode = mode
        self.waiting_for = ""
        self._confirmed_at = self._look_at = now

    def left(self, now: float, flying: Flying) -> bool:
        """Whether the autopilot has left the confirmed mode by itself, because sticks moved, or because it misses them.

        Its failsafe may show the same mode. Where a transmitter's sticks count, a person moves them.
        """
        if self.mode is None or self._ladder.asking:
            return False
        minds_motion = flying.sticks_settle_s > 0.0 and not flying.ignores_sticks
        return flying.by_failsafe or (flying.by_hand and minds_motion and now - self._confirmed_at < LEFT_WITHIN_S)

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

    def due(self, now: float, flying: Flying, still_s: float = float("inf")) -> list[bytes]:
        """Requests to send now. `still_s`: how long the agent's own sticks have not moved; infinite without them."""
        if not self._modes:
            return []
        if not self._ladder.asking and now >= self._try_at:
            self._check(now, flying, still_s)
        frames = self._ladder.due(now, vehicle_system_id=flying.vehicle_system_id)
        self._follow(now)
        return frames + self._look(now, flying)

    def _look(self, now: float, flying: Flying) -> list[bytes]:
        """Asks whether the autopilot still is in the mode, where it may leave it because of sticks."""
        seen = self.mode is not None and flying.sticks_settle_s > 0.0 and now - self._confirmed_at < LOOK_FOR_S
        if not seen or now < self._look_at:
            return []
        self._look_at = now + LOOK_EVERY_S
        ask = request_message(flying.vehicle_system_id, mavlink.MAVLINK_MSG_ID_HEARTBEAT, confirmation=0)
        return [self._maker.make(ask, agent_sender(flying.vehicle_system_id))]

    def acknowledged(self, ack: Any, now: float) -> None:
        """Handles a COMMAND_ACK for MAV_CMD_DO_SET_MODE that is addressed to the agent."""
        self._ladder.acknowledged(ack, now)
        self._follow(now)

    def heartbeat(self, custom_mode: int, now: float, *, by_failsafe: bool = False) -> None:
        """A HEARTBEAT of the autopilot, armed."""
        self._ladder.heartbeat(custom_mode, by_failsafe=by_failsafe)
        self._follow(now)

    def _check(self, now: float, flying: Flying, still_s: float) -> None:
        if self.mode is not None:
            better = self._better(flying)
            if better is not None and flying.still:
                self._ladder.climb((better,), patience_s=RUNG_PATIENCE_S, now=now)
            return
        self.waiting_for = self._why_wait(now, flying, still_s)
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

    def _why_wait(self, now: float, flying: Flying, still_s: float) -> str:
        waited_s = now - self._ready_since
        patient = waited_s < UNKNOWN_WAIT_S
        if not flying.airborne:
            return "it is on the ground"
        if flying.has_position is False:
            return "no position"
        if flying.ignores_sticks:
            return ""  # waiting for what sticks do would be in vain
        if still_s < flying.sticks_settle_s:
            return "the autopilot still sees the sticks move"
        if flying.sinking and waited_s < SINKING_WAIT_S and not flying.by_failsafe:
            return "still sinking"
        if flying.level is False or (flying.level is None and patient):
            return "not level yet"
        if flying.fast and waited_s < SLOW_DOWN_S:
            return "not slow enough yet"
        return ""

    def _follow(self, now: float) -> None:
        for step, _ in self._ladder.pop_reached():
            if step is LadderStep.CONFIRMED and self._ladder.confirmed is not None:
                self._confirm(self._ladder.confirmed, now)
                return
        if self._ladder.asking and self._ladder.all_refuse:
            self._ladder.stop()
            self._try_at = now + TRY_AGAIN_S
            if self.mode is None:
                self.waiting_for = self._ladder.why_not()
