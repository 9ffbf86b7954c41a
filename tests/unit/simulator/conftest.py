"""A ground station with a fake clock, connected to one vehicle through plain bytes."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest

from simulator.dialect import Codec, mavlink
from simulator.failure_modes import Failure
from simulator.flight_state import FlightSettings
from simulator.geodesy import Place
from simulator.modes import Mode
from simulator.receiver import Receiver
from simulator.vehicle import Vehicle, VehicleSettings

HOME = Place(47.397742, 8.545594, 488.0)
STEP_S = 0.02
STICK_PERIOD_S = 0.1
LEAVE = 65535
Message = Any


class Ground:
    """Sends as sysid 255, component 190 by default; keeps everything that it receives."""

    def __init__(self, *, failures: set[Failure] | None = None, **options: Any) -> None:
        flight = {
            key: options.pop(key)
            for key in (
                "heading_deg",
                "wind_mps",
                "wind_from_deg",
                "receiver",
                "battery_mah",
                "seed",
                "model",
                "commander",
            )
            if key in options
        }
        flight["receiver"] = Receiver(flight.get("receiver", Receiver.LOW))
        boot_s = options.pop("boot_s", 0.5)
        parameters = tuple(options.pop("parameters", {}).items())
        settings = VehicleSettings(FlightSettings(HOME, boot_s=boot_s, **flight), parameters=parameters, **options)
        self.vehicle = Vehicle(settings, failures or ())
        self.now_s = 0.0
        self.heard: list[tuple[float, Message]] = []
        self.sticks: Message | None = None
        """Sent ten times a second while set."""
        self._stick_due_s = 0.0
        self._codecs: dict[tuple[int, int], Codec] = {}
        self._ears = Codec(255, 190)

    @property
    def flight(self) -> Any:
        return self.vehicle.flight

    @property
    def body(self) -> Any:
        return self.vehicle.flight.body

    def send(self, message: Message, sysid: int = 255, compid: int = 190) -> None:
        codec = self._codecs.setdefault((sysid, compid), Codec(sysid, compid))
        self.vehicle.receive(codec.encode(message), self.now_s)

    def run(self, seconds: float) -> list[Message]:
        """Advances the time. Returns the messages received meanwhile."""
        first = len(self.heard)
        end_s = self.now_s + seconds
        while self.now_s < end_s - 1e-9:
            if self.sticks is not None and self.now_s >= self._stick_due_s - 1e-9:
                self.send(self.sticks)
                self._stick_due_s = self.now_s + STICK_PERIOD_S
            self.now_s = round(min(self.now_s + STEP_S, end_s), 6)
            self.vehicle.step(self.now_s)
            for datagram in self.vehicle.datagrams_to_send():
                for message in self._ears.decode(datagram):
                    self.heard.append((self.now_s, message))
        return [message for _, message in self.heard[first:]]

    def until(self, condition: Callable[[], bool], timeout_s: float = 60.0) -> float:
        """Waits for the condition. Returns the duration."""
        start_s = self.now_s
        while not condition():
            assert self.now_s - start_s < timeout_s, "the condition never came true"
            self.run(STEP_S)
        return self.now_s - start_s

    def texts(self) -> list[str]:
        return [m.text for _, m in self.heard if m.get_type() == "STATUSTEXT"]

    def of(self, name: str) -> list[Message]:
        return [m for _, m in self.heard if m.get_type() == name]

    def command(self, number: int, *params: float, sysid: int = 255, to: tuple[int, int] = (1, 1)) -> int | None:
        """Returns the result of a COMMAND_LONG, or None without an acknowledgement within a tenth of a second."""
        seven = (*params, *([0.0] * (7 - len(params))))
        self.send(mavlink.MAVLink_command_long_message(*to, number, 0, *seven), sysid)
        return self._answer(number)

    def command_int(
        self, number: int, *params: float, x: int = 0, y: int = 0, z: float = 0.0, frame: int = 6
    ) -> int | None:
        four = (*params, *([0.0] * (4 - len(params))))
        self.send(mavlink.MAVLink_command_int_message(1, 1, frame, number, 0, 0, *four, x, y, z))
        return self._answer(number)

    def _answer(self, number: int) -> int | None:
        """The last one: PX4 answers a mode change twice."""
        answers = [one for one in self.run(0.1) if one.get_type() == "COMMAND_ACK" and one.command == number]
        return int(answers[-1].result) if answers else None

    def set_mode(self, mode: Mode) -> int | None:
        return self.command(mavlink.MAV_CMD_DO_SET_MODE, 1, int(mode))

    def override(self, *pwm: int) -> Message:
        """Returns a stick message for channels 1 to 4 (or more) that leaves the others unchanged."""
        eight = (*pwm, *([LEAVE] * (8 - len(pwm))))
        return mavlink.MAVLink_rc_channels_override_message(1, 1, *eight)

    def ready(self) -> Ground:
        self.until(lambda: self.flight.estimator.position_ok)
        self.run(0.1)
        return self

    def take_off(self, alt_m: float = 10.0) -> Ground:
        """Takes off in GUIDED and waits until settled. Without a receiver it streams sticks."""
        self.ready()
        receiver = self.flight.sticks.receiver
        if receiver is not Receiver.LOW:
            self.sticks = self.override(1500, 1500, 1000, 1500)
            self.run(0.3)
        assert self.set_mode(Mode.GUIDED) == mavlink.MAV_RESULT_ACCEPTED
        assert self.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1) == mavlink.MAV_RESULT_ACCEPTED
        self.sticks = self.override(1500, 1500, 1500, 1500) if receiver is Receiver.NONE else None
        assert self.command(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, alt_m) == 0
        self.until(lambda: abs(self.body.alt_m - alt_m) < 0.1 and abs(self.body.vd_mps) < 0.1)
        return self

    def tilt_deg(self) -> float:
        roll, pitch, _ = self.body.attitude()
        return math.degrees(math.acos(math.cos(roll) * math.cos(pitch)))

    def from_home_m(self) -> float:
        return math.hypot(self.body.north_m, self.body.east_m)


@pytest.fixture
def ground() -> Callable[..., Ground]:
    """Makes a ground station with its own vehicle."""
    return Ground
