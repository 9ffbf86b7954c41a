"""The flight code: one vehicle's body, senses and modes, advanced tick by tick. Independent of MAVLink.

`tick` is called every TICK_S of simulated time. The order within a tick is fixed: sense, decide (failsafes, mode
switch), fly the mode, move the body, detect ground contact.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping
from enum import IntEnum
from typing import Protocol

from simulator.airframe import WEIGHT_N
from simulator.auto import Auto
from simulator.behaviours import Behaviour
from simulator.failure_modes import Failure
from simulator.fence import Fence, FenceLimits
from simulator.firmware.states import SystemState
from simulator.flight_commander import FlightCommander
from simulator.flight_constants import TICK_S
from simulator.flight_state import STOPPED, FailsafeFlags, FlightSettings, FlightState
from simulator.mission_plan import Plans
from simulator.modes import ModeRules, mode_of
from simulator.notices import Severity
from simulator.parameters import Parameters
from simulator.pilot_input import PilotInput
from simulator.receiver import Receiver
from simulator.wind import NO_GUST

LANDED_AFTER_S = 1.8
SWITCH_DEBOUNCE_S = 0.2
HARD_IMPACT_MPS = 5.0
SAG_OHM = 0.2
GUST_MPS = (8.5, 8.5, 0.0)


class OwnFailsafes(FailsafeFlags, ABC):
    """What the autopilot does by itself on a loss."""

    @abstractmethod
    def update(self, flight: Flight) -> None: ...

    def mode_commanded(self) -> None:
        """A pilot's command of a mode was accepted."""


class Autopilot(Protocol):
    """The flight code's interface to its autopilot; `flavour.Flavour` implements it."""

    @property
    def first_mode(self) -> IntEnum: ...
    @property
    def land_mode(self) -> IntEnum: ...
    @property
    def rules(self) -> Mapping[IntEnum, ModeRules]: ...
    @property
    def home_slot(self) -> bool: ...
    @property
    def lands_with_throttle_up(self) -> bool: ...
    @property
    def make_behaviours(self) -> Callable[[FlightState], dict[IntEnum, Behaviour]]: ...
    @property
    def make_sticks(self) -> Callable[[Parameters, Receiver], PilotInput]: ...
    @property
    def make_failsafes(self) -> Callable[[], OwnFailsafes]: ...
    @property
    def why_not_ready(self) -> Callable[[Flight], str | None]: ...
    @property
    def why_not_arm(self) -> Callable[[Flight], str | None]: ...
    @property
    def fence_limits(self) -> Callable[[FlightState], FenceLimits]: ...
    @property
    def on_fence_breach(self) -> Callable[[FlightState], IntEnum | None]: ...
    @property
    def disarm_delay_s(self) -> Callable[[Flight], float]: ...


class Flight(FlightState):
    """One vehicle with its flight modes, failsafes and fence."""

    failsafes: OwnFailsafes

    def __init__(
        self, settings: FlightSettings, parameters: Parameters, failures: set[Failure], autopilot: Autopilot
    ) -> None:
        super().__init__(
            settings,
            parameters,
            failures,
            sticks=autopilot.make_sticks(parameters, settings.receiver),
            failsafes=autopilot.make_failsafes(),
            plans=Plans(autopilot.home_slot),
            mode=autopilot.first_mode,
        )
        self._autopilot = autopilot
        self.fence = Fence(autopilot.fence_limits, autopilot.on_fence_breach)
        self._behaviours = autopilot.make_behaviours(self)
        self._contradictions: tuple[str, ...] = ()
        self._suffers = False
        """Failures were at work in the last tick."""
        self.commander = FlightCommander() if settings.commander else None
        self._throttle_zero_since_s: float | None = None
        self._switch_seen: int | None = None
        self._switch_since_s = 0.0
        self._switch_settled: int | None = None

    # Requests from outside.

    def behaviour(self, mode: IntEnum) -> Behaviour:
        return self._behaviours[mode]

    def behaviours(self) -> Iterable[Behaviour]:
        return self._behaviours.values()

    @property
    def flying(self) -> Behaviour:
        """The behaviour of the present mode."""
        return self._behaviours[self.mode]

    @property
    def disarms_on_landing(self) -> bool:
        return self.flying.disarms_on_landing

    def why_not_ready(self) -> str | None:
        """Returns the first failed check before an attempt to arm."""
        return self._autopilot.why_not_ready(self)

    def rules(self, mode: IntEnum) -> ModeRules:
        return self._autopilot.rules[mode]

    def set_mode(self, mode: IntEnum) -> bool:
        """Selecting the present mode succeeds and changes nothing. A refusal gives its reason in a notice."""
        if mode is self.mode:
            return True
        refusal: str | None = None
        if self.armed and self.rules(mode).needs_position and not self.estimator.position_ok:
            refusal = "requires position"
        elif self.armed and self.fence.kept_mode is self.mode:
            refusal = "in fence recovery"
        else:
            refusal = self._behaviours[mode].why_not()
        if not refusal and self.armed and self.commander is not None and mode is not self._autopilot.land_mode:
            refusal = self.commander.change(manual=self.rules(mode).pilot_controlled)
        if refusal:
            self.notify(Severity.WARNING, f"Mode change to {mode.name} failed: {refusal}")
            return False
        self.mode = mode
        self.speed_override_mps = self.yaw_override_rad = self.roi = None
        self.restart_controllers()
        self._behaviours[mode].enter()
        self.on_mode_change()
        return True

    def arm(self, *, force: bool = False) -> bool:
        if self.armed:
            return True
        reason = None if force else self._autopilot.why_not_arm(self)
        if reason is None and self.commander is not None:
            reason = self.commander.arm(self, manual=self.rules(self.mode).pilot_controlled)
        if reason:
            self.notify(Severity.CRITICAL, reason)
            return False
        self.notify(Severity.INFO, "Arming motors")
        if self.estimator.position_ok and not self.home_is_chosen:
            self.set_home(self.place())
        self.armed = True
        self.has_flown = False
        self._throttle_zero_since_s = None
        self.restart_controllers()
        self.flying.enter()
        return True

    def disarm(self) -> None:
        if not self.armed:
            return
        self.armed = False
        if self.commander is not None:
            self.commander.stop()
        self.notify(Severity.INFO, "Disarming motors")
        if not isinstance(self.flying, Auto):
            self.speed_override_mps = None

    # Time.

    def tick(self, now_s: float) -> None:
        self.now_s = now_s
        self._apply_failures()
        self.estimator.update(
            now_s,
            gps_lost=Failure.GPS_LOST in self.failures,
            never_ready=Failure.NEVER_READY in self.failures,
        )
        self._notice_ready()
        self._notice_contradictions()
        lost = self.transmitter_lost or Failure.RADIO_LOST in self.failures
        self.sticks.update(now_s, transmitter_lost=lost)
        self._read_mode_switch()
        if text := self.outputs.due(now_s):
            self.notify(Severity.INFO, text)
        self.precision.update(self)
        self.failsafes.update(self)
        self.fence.update(self)
        self._obey_commander()
        if self.armed:
            self.flying.run()
        else:
            self.commands, self.thrust_wanted_n = STOPPED, 0.0
        wind_mps = self.wind.at(now_s, self.body.alt_m - self.body.ground_m())
        self.body.step(self.commands, TICK_S, wind_mps, self.battery.power)
        self.camera.update(self)
        self.battery.draw(sum(self.body.thrust_n), TICK_S)
        self._notice_ground()
        self._disarm_when_done()

    def _asks_to_fly(self) -> bool:
        return self.sticks.throttle > 0.0 and not self._autopilot.lands_with_throttle_up

    def _apply_failures(self) -> None:
        if not self.failures and not self._suffers:
            return
        self._suffers = bool(self.failures)
        self.body.suffer(self.failures)
        self.body.motor_health[0] = 0.7 if Failure.MOTOR_WEAK in self.failures else 1.0
        if Failure.MOTOR_LOST in self.failures:
            self.body.motor_health[0] = 0.0
        self.battery.extra_ohm = SAG_OHM if Failure.BATTERY_SAG in self.failures else 0.0
        self.wind.gust_mps = GUST_MPS if Failure.WIND_GUST in self.failures else NO_GUST
        if Failure.BATTERY_LOW in self.failures:
            self.battery.used_mah = max(self.battery.used_mah, 0.88 * self.battery.capacity_mah)

    def _notice_ready(self) -> None:
        if self.estimator_was_ready or not self.estimator.position_ok:
            return
        self.estimator_was_ready = True
        if self.home is None:
            self.set_home(self.place())
        self.notify(Severity.INFO, "EKF3 IMU0 is using GPS")
        self.notify(Severity.INFO, "EKF3 IMU0 origin set")

    def _obey_commander(self) -> None:
        """A major fault lands the vehicle, or what is left of it, and disarms it on the ground."""
        if self.commander is None:
            return
        self.notices.extend(self.commander.update(self))
        if self.armed and self.commander.state is SystemState.FAIL_MAJOR:
            if self.landed or self.body.on_ground:
                self.disarm()
            else:
                self.set_mode(self._autopilot.land_mode)

    def _notice_contradictions(self) -> None:
        """Says each once, and again only after it was gone. With a commander, the commander does."""
        if self.commander is not None:
            return
        found = self.body.contradictions()
        for text in found:
            if text not in self._contradictions:
                self.notify(Severity.WARNING, text)
        self._contradictions = found

    def _read_mode_switch(self) -> None:
        """Acts on a change of the switch, not on its position: that is how an expiring channel 5 changes the mode."""
        switch = self.sticks.mode_switch
        if switch != self._switch_seen:
            self._switch_seen, self._switch_since_s = switch, self.now_s
        if switch is None or switch == self._switch_settled:
            return
        if self.now_s - self._switch_since_s < SWITCH_DEBOUNCE_S:
            return
        self._switch_settled = switch
        mode = mode_of(self.parameters.whole(f"FLTMODE{switch}"))
        if mode is not None:
            self.set_mode(mode)

    def _notice_ground(self) -> None:
        body = self.body
        if body.impact_mps > HARD_IMPACT_MPS and self.armed:
            self.notify(Severity.EMERGENCY, "Crash: Disarming")
            self.landed = True
            self.disarm()
        body.impact_mps = 0.0
        if self.landed:
            return
        pressing_down = self.target.climb_mps < -0.1 or self.thrust_wanted_n < 0.5 * WEIGHT_N
        if not body.on_ground or (self.armed and not pressing_down):
            self._on_ground_since_s = None
        elif self._on_ground_since_s is None:
            self._on_ground_since_s = self.now_s
        elif self.now_s - self._on_ground_since_s >= LANDED_AFTER_S:
            self.landed = True

    def _disarm_when_done(self) -> None:
        if not self.armed:
            return
        if self.landed and self.disarms_on_landing:
            self.disarm()
            return
        if not self.landed or self._asks_to_fly() or self.flying.waits_to_take_off:
            self._throttle_zero_since_s = None
            return
        if self._throttle_zero_since_s is None:
            self._throttle_zero_since_s = self.now_s
        delay_s = self._autopilot.disarm_delay_s(self)
        if 0 < delay_s <= self.now_s - self._throttle_zero_since_s:
            self.disarm()
