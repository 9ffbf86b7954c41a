"""The state of one vehicle, and how a flight mode moves it. The lowest layer that flight modes, fence and camera share.

Knows no flight mode, no fence and no autopilot: `flight.Flight` adds those.
"""

from __future__ import annotations

import math
import random
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum

from simulator.airframe import Commands
from simulator.airframe_model import AirframeModel, make_airframe
from simulator.attitude_control import IDLE_COMMAND, AttitudeControl
from simulator.battery import Battery
from simulator.dialect import Event
from simulator.estimator import Estimator
from simulator.failure_modes import Failure
from simulator.flight_constants import TICK_S
from simulator.geodesy import LocalFrame, Place
from simulator.mission_plan import Plans
from simulator.notices import Notice, Severity
from simulator.parameters import Parameters
from simulator.photographs import Camera, Photo
from simulator.pilot_input import PilotInput
from simulator.position_control import Limits, PositionControl, Target
from simulator.precision_landing import PrecisionLanding
from simulator.receiver import Receiver
from simulator.servo_outputs import ServoOutputs
from simulator.setup_state import VehicleSetup
from simulator.terrain import Ground
from simulator.wind import Wind

STOPPED = (0.0, 0.0, 0.0, 0.0)
IDLE = (IDLE_COMMAND,) * 4
NOTICES_MAX = 64


@dataclass(frozen=True, slots=True)
class FlightSettings:
    """Initial state of one vehicle. Angles in degrees, `wind_from_deg` as in weather reports."""

    place: Place
    heading_deg: float = 0.0
    boot_s: float = 8.0
    wind_mps: float = 0.0
    wind_from_deg: float = 0.0
    receiver: Receiver = Receiver.LOW
    battery_mah: float = 5200.0
    seed: int = 1
    model: AirframeModel = AirframeModel.EXACT
    commander: bool = False
    """The flight controller's own states and checks stand above the autopilot's."""
    ground: Ground | None = None
    """None: flat."""


class FailsafeFlags:
    """Which failsafes are active."""

    def __init__(self) -> None:
        self.radio = False
        self.ground_station = False
        self.battery_low = False
        self.battery_critical = False
        self.position = False
        self.ground_station_seen_s: float | None = None
        """Time of the last heartbeat (or, on ArduPilot, stick message) that counts; None: never, so its loss does not
        count."""

    @property
    def any(self) -> bool:
        return self.radio or self.ground_station or self.battery_low or self.battery_critical or self.position


class FlightState(ABC):
    def __init__(
        self,
        settings: FlightSettings,
        parameters: Parameters,
        failures: set[Failure],
        *,
        sticks: PilotInput,
        failsafes: FailsafeFlags,
        plans: Plans,
        mode: IntEnum,
    ) -> None:
        self.parameters = parameters
        self.failures = failures
        self.now_s = 0.0
        self.origin = LocalFrame(settings.place)
        heading_rad = math.radians(settings.heading_deg)
        self.body = make_airframe(settings.model, heading_rad, settings.seed, settings.boot_s)
        self.body.ground = settings.ground
        self.battery = Battery(settings.battery_mah)
        self.wind = Wind(settings.wind_mps, settings.wind_from_deg, random.Random(settings.seed))  # noqa: S311
        self.sticks = sticks
        self.estimator = Estimator(settings.boot_s)
        self.estimator_was_ready = False
        self.failsafes = failsafes
        self.plans = plans
        self.camera = Camera()
        self.setup = VehicleSetup()
        self.outputs = ServoOutputs()
        self.precision = PrecisionLanding()
        self.attitude = AttitudeControl()
        self.position = PositionControl()
        self.target = Target()
        self.mode = mode
        self.armed = False
        self.transmitter_lost = False
        """As a serial receiver says; a failure does the same."""
        self.heartbeat_heard_s: float | None = None
        """Of anybody on the MAVLink port; None: never."""
        self.landed = True
        self.has_flown = False
        """Since arming."""
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
        """Target of the nose in the modes that point it: north and east of the origin, metres."""
        self.commands: Commands = STOPPED
        self.thrust_wanted_n = 0.0
        self._limits = self._read_limits()
        self._limits_key: tuple[int, float | None] = (parameters.version, None)
        self._last_known: Place | None = None
        self._on_ground_since_s: float | None = None
        self.attitude.reset(self.body.attitude()[2])
        self.target.reset(self.body)

    @property
    @abstractmethod
    def disarms_on_landing(self) -> bool:
        """Whether the present mode disarms as soon as the vehicle has landed."""

    @abstractmethod
    def set_mode(self, mode: IntEnum) -> bool:
        """Selecting the present mode succeeds and changes nothing. A refusal gives its reason in a notice."""

    @abstractmethod
    def disarm(self) -> None: ...

    def notify(self, severity: Severity, text: str, event: Event | None = None) -> None:
        self.notices.append(Notice(severity, text, event))

    def tell(self, event: Event) -> None:
        """Sends an event without a text."""
        self.notices.append(Notice(Severity.INFO, "", event))

    def set_home(self, place: Place) -> None:
        self.home = place
        self.plans.home_moved(place)

    def lift_off(self) -> None:
        """Called by a mode that leaves the ground."""
        self.landed = False
        self.has_flown = True
        self._on_ground_since_s = None

    # Read by the modes and the telemetry.

    def place(self) -> Place:
        body = self.body
        return self.origin.to_place(body.north_m, body.east_m, body.down_m)

    @property
    def known_place(self) -> Place | None:
        """The estimated position: None before the first one, the last one after a loss."""
        if self.estimator.position_ok:
            self._last_known = self.place()
        return self._last_known

    def home_local(self) -> tuple[float, float, float]:
        """Returns north, east and height of home relative to the origin; the origin itself without a home."""
        if self.home is None:
            return 0.0, 0.0, 0.0
        north_m, east_m = self.origin.to_local(self.home.lat_deg, self.home.lon_deg)
        return north_m, east_m, self.home.alt_amsl_m - self.origin.origin.alt_amsl_m

    def alt_over_home_m(self) -> float:
        return self.body.alt_m - self.home_local()[2]

    def limits(self) -> Limits:
        """Returns the limits of the waypoint controller."""
        key = (self.parameters.version, self.speed_override_mps)
        if key != self._limits_key:
            self._limits_key, self._limits = key, self._read_limits()
        return self._limits

    def _read_limits(self) -> Limits:
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
        """On the ground with motors idling: prevents integrator windup."""
        self.commands = IDLE
        self.thrust_wanted_n = 0.0
        self.restart_controllers()

    def fly(self, lean: tuple[float, float] | None = None) -> None:
        """Follows the target in height, and horizontally too unless a pilot gives `lean` (roll, pitch)."""
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
