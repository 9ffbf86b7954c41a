"""Ports of a vehicle beside MAVLink: flown by the agent's own MSP client, and by a radio on an SBUS line."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from worlds.tiers import examples

from onboard_agent.autopilot.msp.boxes import Boxes
from onboard_agent.autopilot.msp.translator import TICK_S, MspTranslator
from simulator.cli import _port_endpoints
from simulator.dialect import Codec, mavlink
from simulator.failure_modes import Failure
from simulator.firmware.states import SystemState
from simulator.flavour import Flavour
from simulator.flight_state import FlightSettings
from simulator.geodesy import Place
from simulator.modes import Mode
from simulator.px4.flavour import PX4
from simulator.receiver import Receiver
from simulator.serial_inputs import boxes, sbus
from simulator.vehicle import Vehicle, VehicleSettings
from simulator.vehicle_ports import MAX_WAITING, MspPort, SbusPort
from wire.autopilots.msp_multicopter import BOXES, NUMBERS

HOME = Place(47.397742, 8.545594, 488.0)
STICKS_S = 0.05
ARMED = mavlink.MAV_MODE_FLAG_SAFETY_ARMED
Ground = Any


class Pilot:
    """A program that flies through the agent's MSP port, on a fake clock."""

    def __init__(self, flavour: Flavour | None = None, *, commander: bool = False) -> None:
        flight = FlightSettings(HOME, boot_s=2.0, commander=commander)
        settings_ = VehicleSettings(flight) if flavour is None else VehicleSettings(flight, flavour=flavour)
        self.vehicle = Vehicle(settings_)
        self.port = MspPort(self.vehicle)
        self.agent = MspTranslator()
        self.now_s = 0.0
        self.heard: list[Any] = []
        self.sticks: tuple[int, int, int, int] | None = None
        """Forward, right, throttle (0 to 1000) and turn of MANUAL_CONTROL, sent 20 times a second while set."""
        self._due_s = 0.0
        self._mouth, self._ears = Codec(255, 190), Codec(255, 190)

    @property
    def flight(self) -> Any:
        return self.vehicle.flight

    def _pass_on(self, out: tuple[bytes, bytes]) -> None:
        to_controller, to_agent = out
        self.port.receive(to_controller)
        self.heard += self._ears.decode(to_agent) if to_agent else []

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / TICK_S)):
            self.now_s += TICK_S
            if self.sticks is not None and self.now_s >= self._due_s:
                self._due_s = self.now_s + STICKS_S
                x, y, z, r = self.sticks
                self._send(mavlink.MAVLink_manual_control_message(1, x, y, z, r, 0))
            self._pass_on(self.agent.tick(self.now_s))
            answers = self.port.step(self.now_s)
            if answers:
                self._pass_on(self.agent.from_controller(answers, self.now_s))
            self.vehicle.step(self.now_s)
            self.vehicle.datagrams_to_send()

    def _send(self, message: Any) -> None:
        self._pass_on(self.agent.from_agent(self._mouth.encode(message), self.now_s))

    def command(self, number: int, *params: float) -> int:
        self.heard.clear()
        self._send(mavlink.MAVLink_command_long_message(1, 1, number, 0, *params, *([0.0] * (7 - len(params)))))
        return next(int(m.result) for m in self.heard if m.get_type() == "COMMAND_ACK")

    def last(self, name: str) -> Any:
        return next(m for m in reversed(self.heard) if m.get_type() == name)

    def until(self, condition: Callable[[], bool], timeout_s: float) -> None:
        end_s = self.now_s + timeout_s
        while not condition():
            assert self.now_s < end_s, "the condition never came true"
            self.run(0.2)

    def armed(self) -> bool:
        return bool(self.last("HEARTBEAT").base_mode & ARMED)

    def shown(self) -> str:
        numbers = {number: name for name, number in NUMBERS.items()}
        return numbers[self.last("HEARTBEAT").custom_mode]


@pytest.mark.parametrize("flavour", [None, PX4], ids=["ardupilot", "px4"])
def test_the_agents_msp_client_flies_it_from_the_ground_and_home(flavour: Flavour | None) -> None:
    pilot = Pilot(flavour, commander=True)
    pilot.run(4.0)
    place = pilot.last("GLOBAL_POSITION_INT")
    assert (place.lat, place.lon) == pytest.approx((473_977_420, 85_455_940), abs=2)
    assert not pilot.armed()
    pilot.sticks = (0, 0, 0, 0)
    pilot.run(0.5)
    assert pilot.command(mavlink.MAV_CMD_DO_SET_MODE, 1, NUMBERS["ALTHOLD"]) == mavlink.MAV_RESULT_ACCEPTED
    pilot.run(0.5)
    assert pilot.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1) == mavlink.MAV_RESULT_ACCEPTED
    pilot.run(1.0)
    assert pilot.armed()
    assert pilot.shown() == "ALTHOLD"
    assert pilot.flight.commander.state is SystemState.RUN_MANUAL
    pilot.sticks = (0, 0, 800, 0)
    pilot.until(lambda: pilot.flight.body.alt_m > 10.0, 30.0)
    pilot.sticks = (0, 0, 500, 0)
    pilot.run(0.2)
    assert pilot.command(mavlink.MAV_CMD_DO_SET_MODE, 1, NUMBERS["POSHOLD"]) == mavlink.MAV_RESULT_ACCEPTED
    pilot.run(3.0)
    assert pilot.shown() == "POSHOLD"
    assert pilot.last("GLOBAL_POSITION_INT").relative_alt / 1000 == pytest.approx(pilot.flight.body.alt_m, abs=0.3)
    pilot.sticks = (700, 0, 500, 0)
    pilot.run(4.0)
    assert pilot.flight.body.north_m > 5.0, "forward is forward"
    assert pilot.last("ATTITUDE").pitch < 0.0
    pilot.sticks = (0, 0, 500, 0)
    pilot.run(1.0)  # PX4 leaves a mode without sticks while they move
    pilot.sticks = None
    pilot.run(0.1)
    assert pilot.command(mavlink.MAV_CMD_DO_SET_MODE, 1, NUMBERS["RETURN"]) == mavlink.MAV_RESULT_ACCEPTED
    pilot.run(1.0)
    assert pilot.shown() == "RETURN"
    pilot.until(lambda: not pilot.armed(), 120.0)
    assert math.hypot(pilot.flight.body.north_m, pilot.flight.body.east_m) < 1.0
    assert pilot.flight.commander.state is SystemState.SAFE


def test_when_the_stream_ends_the_autopilots_own_failsafe_acts() -> None:
    pilot = Pilot()
    pilot.run(3.0)
    assert not pilot.flight.transmitter_lost, "nobody has sent sticks: the built-in receiver is in use"
    pilot.sticks = (0, 0, 0, 0)
    pilot.run(0.5)
    pilot.command(mavlink.MAV_CMD_DO_SET_MODE, 1, NUMBERS["POSHOLD"])
    pilot.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1)
    pilot.run(1.5)
    pilot.sticks = (0, 0, 800, 0)
    pilot.until(lambda: pilot.flight.body.alt_m > 8.0, 30.0)
    pilot.sticks = None
    pilot.run(4.0)
    assert pilot.flight.mode is Mode.RTL
    assert pilot.shown() == "FAILSAFE"


def test_a_refused_arming_is_not_shown_as_armed() -> None:
    pilot = Pilot(commander=True)
    pilot.vehicle.failures.add(Failure.NEVER_READY)
    pilot.run(3.0)
    pilot.sticks = (0, 0, 0, 0)
    pilot.run(0.5)
    pilot.command(mavlink.MAV_CMD_DO_SET_MODE, 1, NUMBERS["POSHOLD"])
    pilot.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1)
    pilot.run(1.5)
    assert not pilot.armed()


def test_the_agent_finds_a_switch_for_each_mode_that_the_simulator_has() -> None:
    from onboard_agent.autopilot.msp import answers

    found = Boxes()
    found.names = answers.box_names(boxes.names(boxes.BOXES))
    found.ids = tuple(boxes.ids(boxes.BOXES))
    found.ranges = answers.mode_ranges(boxes.ranges(boxes.BOXES))
    for mode in ("RETURN", "MISSION", "POSHOLD", "ALTHOLD", "ANGLE"):
        pulses = found.switches(mode)
        assert pulses is not None
        aux = [pulses.get(channel, 1000) for channel in range(4)]
        moved = [box for box in boxes.FLYING if box.moved_by(aux)]
        assert [box.name.replace("NAV ", "") for box in moved] == [next(iter(BOXES[mode] & {"RTH", *_plain()}))]
    assert found.switches("HORIZON") is None


def _plain() -> set[str]:
    return {box.name.replace("NAV ", "") for box in boxes.FLYING}


@given(st.lists(st.binary(max_size=200), max_size=20))
@settings(max_examples=examples(16, long=100), deadline=None)
def test_random_bytes_arm_nothing_and_stay_bounded(noise: list[bytes]) -> None:
    vehicle = Vehicle(VehicleSettings(FlightSettings(HOME, boot_s=0.1)))
    msp, line = MspPort(vehicle), SbusPort(vehicle)
    for index, data in enumerate(noise):
        for port in (msp, line):
            port.receive(data * 50)
            port.step(index * 0.01)
    vehicle.step(0.5)
    assert not vehicle.flight.armed


def test_a_flood_between_two_steps_is_cut() -> None:
    vehicle = Vehicle(VehicleSettings(FlightSettings(HOME)))
    port = MspPort(vehicle)
    port.receive(bytes(10 * MAX_WAITING))
    assert port._waiting.lost_bytes == 9 * MAX_WAITING


def frame(*, throttle: int = 172, switch: int = 1811, failsafe: bool = False) -> bytes:
    """172 is 988 us, 1811 is 2012 us; the fifth channel is the mode switch."""
    channels = (992, 992, throttle, 992, switch, *([172] * 11))
    return sbus.encode(sbus.SbusFrame(channels, failsafe=failsafe))


def test_a_radio_on_an_sbus_line_flies_it(ground: Callable[..., Ground]) -> None:
    station = ground(parameters={"FLTMODE6": float(Mode.ALT_HOLD), "FLTMODE1": float(Mode.LAND)})
    port = SbusPort(station.vehicle)

    def listen(seconds: float, data: bytes) -> None:
        for _ in range(round(seconds / 0.02)):
            port.receive(data)
            assert port.step(station.now_s) == b""
            station.run(0.02)

    listen(0.1, b"")
    assert not station.flight.sticks.ever_heard, "the built-in transmitter is off"
    listen(2.0, frame())
    assert station.flight.mode is Mode.ALT_HOLD
    assert station.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1) == mavlink.MAV_RESULT_ACCEPTED
    listen(6.0, frame(throttle=1600))
    assert station.body.alt_m > 5.0
    height_m = station.body.alt_m
    listen(5.0, frame(throttle=992))
    assert station.body.alt_m == pytest.approx(height_m, abs=3.0)
    listen(3.0, frame(failsafe=True))
    assert "Radio Failsafe" in station.texts()
    assert station.flight.mode is Mode.RTL
    listen(1.0, frame(throttle=992, switch=172))
    assert station.flight.mode is Mode.LAND, "the radio is back, and its switch has moved"


def test_a_vehicle_has_one_receiver() -> None:
    url = "tcpin:127.0.0.1:5761"
    assert [str(one) for one in _port_endpoints([url], None, 2, Receiver.LOW)] == [url]
    for msp, line, count, radio in (
        ([url], [url], 1, Receiver.LOW),
        ([url], None, 1, Receiver.NONE),
        ([url, url], None, 1, Receiver.LOW),
        (["serial:/dev/x"], None, 1, Receiver.LOW),
    ):
        with pytest.raises(ValueError, match=r"receiver|ports for|is none of"):
            _port_endpoints(msp, line, count, radio)
