"""The flight code: one vehicle's body, senses and modes, moved on tick by tick. No MAVLink in here.

`tick` is called every TICK_S of simulated time. The order within a tick is fixed: sense, decide (failsafes,
mode switch), fly the mode, move the body, notice the ground.
"""

from __future__ import annotations

import math
import random
from collections import deque
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import IntEnum

from simulator.airframe import WEIGHT_N, Airframe, Commands
from simulator.attitude_control import IDLE_COMMAND, AttitudeControl
from simulator.auto import Auto
from simulator.battery import Battery
from simulator.behaviours import Behaviour
from simulator.estimator import Estimator
from simulator.failure_modes import Failure
from simulator.fence import Fence
from simulator.flavour import Flavour
from simulator.flight_constants import TICK_S
from simulator.geodesy import LocalFrame, Place
from simulator.mission_plan import Plans
from simulator.modes import ModeRules, mode_of
from simulator.notices import Notice, Severity
from simulator.parameters import Parameters
from simulator.photographs import Camera, Photo
from simulator.position_control import Limits, PositionControl, Target
from simulator.receiver import Receiver
from simulator.wind import Wind

LANDED_AFTER_S = 1.8
SWITCH_DEBOUNCE_S = 0.2
HARD_IMPACT_MPS = 5.0
STOPPED = (0.0, 0.0, 0.0, 0.0)
IDLE = (IDLE_COMMAND,) * 4
NOTICES_MAX = 64


@dataclass(frozen=True, slots=True)
class FlightSettings:
    """How one vehicle starts. Angles in degrees, `wind_from_deg` as weather reports give it."""

    place: Place
    heading_deg: float = 0.0
    boot_s: float = 8.0
    wind_mps: float = 0.0
    wind_from_deg: float = 0.0
    receiver: Receiver = Receiver.LOW
    battery_mah: float = 5200.0
    seed: int = 1


class Flight:
    def __init__(
        self, settings: FlightSettings, parameters: Parameters, failures: set[Failure], flavour: Flavour
    ) -> None:
        self.flavour = flavour
        self.parameters = parameters
        self.failures = failures
        self.now_s = 0.0
        self.origin = LocalFrame(settings.place)
        self.body = Airframe(math.radians(settings.heading_deg))
        self.battery = Battery(settings.battery_mah)
        self.wind = Wind(settings.wind_mps, settings.wind_from_deg, random.Random(settings.seed))  # noqa: S311
        self.sticks = flavour.make_sticks(parameters, settings.receiver)
        self.estimator = Estimator(settings.boot_s)
        self.estimator_was_ready = False
        self.failsafes = flavour.make_failsafes()
        self.plans = Plans(flavour.home_slot)
        self.fence = Fence()
        self.camera = Camera()
        self.attitude = AttitudeControl()
        self.position = PositionControl()
        self.target = Target()
        self.mode: IntEnum = flavour.first_mode
        self.armed = False
        self.landed = True
        self.has_flown = False
        """Since it was armed."""
        self.home: Place | None = None
        self.home_is_chosen = False
        """Set by command, so arming must not move it."""
        self.notices: deque[Notice] = deque(maxlen=NOTICES_MAX)
        self.on_mode_change: Callable[[], None] = lambda: None
        self.on_photo: Callable[[Photo], None] = lambda _photo: None
        self.on_item_reached: Callable[[int], None] = lambda _seq: None
        self.speed_override_mps: float | None = None
        self.yaw_override_rad: float | None = None
        self.roi: tuple[float, float] | None = None
        """Where the nose points while one of the modes for it flies: north and east of the origin, metres."""
        self.commands: Commands = STOPPED
        self.thrust_wanted_n = 0.0
        self._behaviours = flavour.make_behaviours(self)
        self._last_known: Place | None = None
        self._on_ground_since_s: float | None = None
        self._throttle_zero_since_s: float | None = None
        self._switch_seen: int | None = None
        self._switch_since_s = 0.0
        self._switch_settled: int | None = None
        self.attitude.reset(self.body.attitude()[2])
        self.target.reset(self.body)

    # Asked for from outside.

    def say(self, severity: Severity, text: str) -> None:
        self.notices.append(Notice(severity, text))

    def behaviour(self, mode: IntEnum) -> Behaviour:
        return self._behaviours[mode]

    def behaviours(self) -> Iterable[Behaviour]:
        return self._behaviours.values()

    @property
    def flying(self) -> Behaviour:
        """What the present mode does."""
        return self._behaviours[self.mode]

    def rules(self, mode: IntEnum) -> ModeRules:
        return self.flavour.rules[mode]

    def set_mode(self, mode: IntEnum) -> bool:
        """The same mode again is fine and changes nothing. Refusals say why in a notice."""
        if mode is self.mode:
            return True
        refusal: str | None = None
        if self.armed and self.rules(mode).needs_position and not self.estimator.position_ok:
            refusal = "requires position"
        elif self.armed and self.fence.kept_mode is self.mode:
            refusal = "in fence recovery"
        else:
            refusal = self._behaviours[mode].why_not()
        if refusal:
            self.say(Severity.WARNING, f"Mode change to {mode.name} failed: {refusal}")
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
        reason = None if force else self.flavour.why_not_arm(self)
        if reason:
            self.say(Severity.CRITICAL, reason)
            return False
        self.say(Severity.INFO, "Arming motors")
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
        self.say(Severity.INFO, "Disarming motors")
        if not isinstance(self.flying, Auto):
            self.speed_override_mps = None

    def set_home(self, place: Place) -> None:
        self.home = place
        self.plans.home_moved(place)

    def lift_off(self) -> None:
        """A mode has decided to leave the ground."""
        self.landed = False
        self.has_flown = True
        self._on_ground_since_s = None

    # Asked by the modes and the telemetry.

    def place(self) -> Place:
        body = self.body
        return self.origin.to_place(body.north_m, body.east_m, body.down_m)

    @property
    def known_place(self) -> Place | None:
        """What the estimate says: nothing before the first position, the last one after a loss."""
        if self.estimator.position_ok:
            self._last_known = self.place()
        return self._last_known

    def home_local(self) -> tuple[float, float, float]:
        """North, east and height of home over the origin; the origin itself while there is no home."""
        if self.home is None:
            return 0.0, 0.0, 0.0
        north_m, east_m = self.origin.to_local(self.home.lat_deg, self.home.lon_deg)
        return north_m, east_m, self.home.alt_amsl_m - self.origin.origin.alt_amsl_m

    def alt_over_home_m(self) -> float:
        return self.body.alt_m - self.home_local()[2]

    def limits(self) -> Limits:
        """What the waypoint controller may do."""
        parameters = self.parameters
        speed = self.speed_override_mps or parameters["WPNAV_SPEED"] / 100.0
        return Limits(
            speed,
            parameters["WPNAV_SPEED_UP"] / 100.0,
            parameters["WPNAV_SPEED_DN"] / 100.0,
            parameters["WPNAV_ACCEL"] / 100.0,
            parameters["WPNAV_ACCEL_Z"] / 100.0,
        )

    def lean_max_rad(self) -> float:
        return math.radians(min(max(self.parameters["ANGLE_MAX"] / 100.0, 10.0), 80.0))

    # How the modes fly.

    def rest(self) -> None:
        """On the ground with motors idling: nothing may wind up."""
        self.commands = IDLE
        self.thrust_wanted_n = 0.0
        self.restart_controllers()

    def fly(self, lean: tuple[float, float] | None = None) -> None:
        """Follow the target in height, and in place too unless a pilot gives `lean` (roll, pitch)."""
        self.thrust_wanted_n = self.position.thrust_n(self.body, self.target, TICK_S)
        if lean is None:
            lean = self.position.lean(self.body, self.target, self.lean_max_rad(), TICK_S)
        self.fly_by_thrust(lean, self.thrust_wanted_n)

    def fly_by_thrust(self, lean: tuple[float, float], thrust_n: float) -> None:
        self.thrust_wanted_n = thrust_n
        self.commands = self.attitude.commands(self.body, lean, thrust_n, TICK_S)

    def restart_controllers(self) -> None:
        self.target.reset(self.body)
        if self.landed:
            self.position.reset()
            self.attitude.reset(self.body.attitude()[2])

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
        self.sticks.update(now_s, transmitter_lost=Failure.RADIO_LOST in self.failures)
        self._read_mode_switch()
        self.failsafes.update(self)
        self.fence.update(self)
        if self.armed:
            self.flying.run()
        else:
            self.commands, self.thrust_wanted_n = STOPPED, 0.0
        self.body.step(self.commands, TICK_S, self.wind.at(now_s), self.battery.power)
        self.camera.update(self)
        self.battery.draw(sum(self.body.thrust_n), TICK_S)
        self._notice_ground()
        self._disarm_when_done()

    def _apply_failures(self) -> None:
        self.body.motor_health[0] = 0.7 if Failure.MOTOR_WEAK in self.failures else 1.0
        if Failure.BATTERY_LOW in self.failures:
            self.battery.used_mah = max(self.battery.used_mah, 0.88 * self.battery.capacity_mah)

    def _notice_ready(self) -> None:
        if self.estimator_was_ready or not self.estimator.position_ok:
            return
        self.estimator_was_ready = True
        if self.home is None:
            self.set_home(self.place())
        self.say(Severity.INFO, "EKF3 IMU0 is using GPS")
        self.say(Severity.INFO, "EKF3 IMU0 origin set")

    def _read_mode_switch(self) -> None:
        """Act on a change of the switch, not on its position: that is how a lapsing channel 5 changes the mode."""
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
            self.say(Severity.EMERGENCY, "Crash: Disarming")
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
        if self.landed and self.flying.disarms_on_landing:
            self.disarm()
            return
        asks_to_fly = self.sticks.throttle > 0.0 and not self.flavour.lands_with_throttle_up
        if not self.landed or asks_to_fly or self.flying.waits_to_take_off:
            self._throttle_zero_since_s = None
            return
        if self._throttle_zero_since_s is None:
            self._throttle_zero_since_s = self.now_s
        delay_s = self.flavour.disarm_delay_s(self)
        if 0 < delay_s <= self.now_s - self._throttle_zero_since_s:
            self.disarm()
