"""A flight controller that speaks MSP, as the agent sees it: the simulator's server half, and switches, on a fake
clock."""

import struct
from dataclasses import replace
from typing import Any

import pytest

from onboard_agent.autopilot.msp import answers as msp
from onboard_agent.autopilot.msp.boxes import Boxes
from onboard_agent.autopilot.msp.frames import ANSWER, ERROR, REQUEST, MspMessage, MspReader, encode
from onboard_agent.autopilot.msp.stick_stream import MAX_RETURN_S, PRESS_S, STICKS_LAST_S
from onboard_agent.autopilot.msp.translator import MAX_TRIES, SILENT_S, TICK_S, MspTranslator
from simulator.serial_inputs.msp_server import MspServer, Snapshot
from wire.autopilots.msp_multicopter import NUMBERS
from wire.dialect import build, decode, mavlink
from wire.frames import split_frames

FLYING = Snapshot(
    armed=True,
    roll_deg=10.0,
    pitch_deg=-5.0,
    yaw_deg=270.0,
    alt_m=12.5,
    climb_mps=-0.5,
    lat_deg=47.3977,
    lon_deg=8.5456,
    alt_amsl_m=500.0,
    ground_speed_mps=3.0,
    course_deg=90.0,
    satellites=12,
    fix=True,
    voltage_v=15.34,
    current_a=12.5,
    sticks_us=(1500, 1500, 1500, 1000, 1000, 1800, 1300, 1300),
)
NAMES = b"ARM;ANGLE;NAV POSHOLD;NAV RTH;BEEPER;"
IDS = bytes((0, 1, 11, 10, 13))
RANGES = bytes((0, 0, 32, 48, 1, 1, 32, 48, 11, 2, 8, 24, 10, 2, 32, 48, 13, 3, 32, 48, 0, 0, 0, 0))
"""ARM and ANGLE high on the first two switches; position hold low and return high on the third; 900 + 25 a step."""


class Controller:
    """The simulator's server half, with switches that it lacks: they follow the channels that it is sent."""

    def __init__(self, *, switches: bool = True) -> None:
        self.snapshot = FLYING
        self.sticks: list[tuple[int, ...]] = []
        self.silent = False
        self.asked: list[int] = []
        self.flags: int | None = None
        self._switches = switches
        self._server = MspServer(lambda: self.snapshot, self.sticks.append)
        self._reader = MspReader()
        self.translator = MspTranslator()
        self.now = 100.0
        self.seen: list[Any] = []

    def run(self, seconds: float, *sent: Any) -> list[Any]:
        """Advances time; sends these messages of the agent first, and again each 0.2 s. Returns what came."""
        before, ticks = len(self.seen), round(seconds / TICK_S)
        for tick in range(ticks):
            if tick % 20 == 0:
                for message in sent:
                    self._take(
                        self.translator.from_agent(
                            build(message, system_id=255, component_id=190, sequence=0), self.now
                        )
                    )
            self._take(self.translator.tick(self.now))
            self.now += TICK_S
        return self.seen[before:]

    def once(self, message: Any) -> Any:
        """Sends one message; returns its COMMAND_ACK."""
        frame = build(message, system_id=255, component_id=190, sequence=0)
        before = len(self.seen)
        self._take(self.translator.from_agent(frame, self.now))
        return next(one for one in self.seen[before:] if one.get_type() == "COMMAND_ACK")

    def last(self, kind: str) -> Any:
        return next(one for one in reversed(self.seen) if one.get_type() == kind)

    def count(self, kind: str, seen: list[Any]) -> int:
        return sum(one.get_type() == kind for one in seen)

    def _take(self, out: tuple[bytes, bytes]) -> None:
        to_controller, to_agent = out
        self.seen += [decode(frame) for frame in split_frames(to_agent)] if to_agent else []
        for request in self._reader.feed(to_controller):
            self.asked.append(request.function)
            if not self.silent:
                answer = self._own(request.function) or self._server.receive(encode(request))
                self._take(self.translator.from_controller(answer, self.now))

    def _own(self, function: int) -> bytes | None:
        own = {
            msp.BOX_NAMES: NAMES,
            msp.BOX_IDS: IDS,
            msp.MODE_RANGES: RANGES,
            msp.RX_MAP: bytes((0, 1, 3, 2, 4, 5, 6, 7)),
        }
        if self.flags is not None and function == msp.STATUS:
            own[msp.STATUS] = struct.pack("<HHHIB", 250, 0, 15, self.flags, 0)
        payload = own.get(function) if self._switches else None
        return None if payload is None else encode(MspMessage(1, ANSWER, function, payload))


def long(command: int, *parameters: float) -> Any:
    return mavlink.MAVLink_command_long_message(1, 1, command, 0, *parameters, *[0.0] * (7 - len(parameters)))


def mode(name: str) -> Any:
    return long(mavlink.MAV_CMD_DO_SET_MODE, 1, NUMBERS[name])


ARM, DISARM = long(400, 1), long(400, 0)
CENTRED = mavlink.MAVLink_manual_control_message(1, 0, 0, 500, 0, 0)


def test_it_shows_the_controller_as_an_autopilot() -> None:
    controller = Controller(switches=False)
    seen = controller.run(3.0)
    beat, attitude, position = (controller.last(kind) for kind in ("HEARTBEAT", "ATTITUDE", "GLOBAL_POSITION_INT"))
    assert (beat.autopilot, beat.type, bool(beat.base_mode & 128)) == (1, mavlink.MAV_TYPE_QUADROTOR, True)
    assert beat.custom_mode == NUMBERS["UNKNOWN"]
    assert attitude.roll == pytest.approx(0.1745, abs=1e-3)
    assert attitude.pitch == pytest.approx(-0.0873, abs=1e-3)
    assert attitude.yaw == pytest.approx(-1.5708, abs=1e-3)
    assert (position.lat, position.lon, position.alt, position.relative_alt) == (473977000, 85456000, 500_000, 12_500)
    assert (position.vx, position.vy, position.vz, position.hdg) == (0, 300, 50, 27_000)
    status, gps = controller.last("SYS_STATUS"), controller.last("GPS_RAW_INT")
    assert (status.voltage_battery, status.current_battery, status.battery_remaining) == (15_340, 1250, -1)
    assert (gps.fix_type, gps.satellites_visible) == (3, 12)
    channels = controller.last("RC_CHANNELS")
    assert (channels.chancount, channels.chan3_raw, channels.chan4_raw, channels.chan6_raw) == (8, 1000, 1500, 1800)
    assert 27 <= controller.count("ATTITUDE", seen) <= 31
    assert 3 <= controller.count("HEARTBEAT", seen) <= 4
    assert controller.asked.count(msp.BOX_NAMES) == 1, "an error is not asked again"
    assert controller.sticks == [], "nobody flies by hand"


def test_a_silent_controller_is_a_silent_autopilot() -> None:
    controller = Controller()
    controller.run(2.0)
    controller.silent = True
    controller.run(SILENT_S + 0.1)
    assert controller.count("HEARTBEAT", controller.run(3.0)) == 0
    controller.silent = False
    assert controller.count("HEARTBEAT", controller.run(1.0)) >= 1


def test_questions_that_nobody_answers_end() -> None:
    controller = Controller()
    controller.silent = True
    controller.run(20.0)
    assert controller.asked.count(msp.BOX_NAMES) == MAX_TRIES


def test_home_is_where_it_was_armed_and_no_fix_is_no_position() -> None:
    controller = Controller()
    controller.snapshot = replace(FLYING, fix=False, satellites=3)
    seen = controller.run(1.0)
    assert controller.count("GLOBAL_POSITION_INT", seen) == controller.count("HOME_POSITION", seen) == 0
    controller.snapshot = replace(FLYING, armed=False)
    controller.run(1.5)
    controller.snapshot = replace(FLYING, lat_deg=47.4)
    controller.run(1.5)
    home = controller.last("HOME_POSITION")
    assert (home.latitude, home.altitude) == (473977000, 500_000)


@pytest.mark.parametrize(
    ("flags", "name"),
    [
        (0b00001, "ACRO"),
        (0b00011, "ANGLE"),
        (0b10111, "POSHOLD"),
        (0b01111, "RETURN"),
    ],
)
def test_modes_are_boxes_by_name(flags: int, name: str) -> None:
    controller = Controller()
    controller.flags = flags
    controller.run(1.5)
    assert controller.last("HEARTBEAT").custom_mode == NUMBERS[name]
    if flags == 0b10111:
        assert controller.last("STATUSTEXT").text == "Boxes: ARM, ANGLE, NAV POSHOLD, BEEPER"
        assert controller.count("STATUSTEXT", controller.run(2.0)) == 0
    controller.flags = 0
    controller.run(0.25)
    beat = controller.last("HEARTBEAT")
    assert (beat.custom_mode, beat.base_mode & 128) == (NUMBERS["ACRO"], 0), "at once, not at the next second"


def test_sticks_go_out_in_the_controllers_order_and_end_with_the_pilots() -> None:
    controller = Controller()
    controller.run(1.0)
    forward = mavlink.MAVLink_manual_control_message(1, 400, -200, 700, 100, 0)
    controller.run(1.0, forward)
    assert 45 <= len(controller.sticks) <= 55
    assert controller.sticks[-1] == (1400, 1700, 1700, 1550, 1000, 1800, 1300, 1300), "switches stay as they are"
    controller.run(STICKS_LAST_S + 0.1)
    controller.sticks.clear()
    controller.run(2.0)
    assert controller.sticks == [], "its own failsafe must see that nobody flies"


def test_override_of_channels() -> None:
    controller = Controller()
    controller.run(1.0)
    override = mavlink.MAVLink_rc_channels_override_message(1, 1, 1600, 65535, 1200, 0, 65535, 65535, 1900, 65535)
    controller.run(0.3, override)
    assert controller.sticks[-1] == (1600, 1500, 1200, 1500, 1000, 1800, 1900, 1300)


def test_no_sticks_before_the_switches_are_known() -> None:
    controller = Controller()
    controller.silent = True
    controller.run(1.0, CENTRED)
    controller.run(STICKS_LAST_S + 0.1)
    assert controller.sticks == []
    no_throttle = mavlink.MAVLink_manual_control_message(1, 0, 0, 32767, 0, 0)
    controller.silent = False
    controller.run(1.0)
    controller.run(0.5, no_throttle)
    assert controller.sticks == []


def test_arming_moves_the_switch_with_the_throttle_down() -> None:
    controller = Controller()
    controller.snapshot = replace(FLYING, armed=False)
    controller.run(1.0)
    assert controller.once(ARM).result == mavlink.MAV_RESULT_ACCEPTED
    controller.run(0.5)
    assert controller.sticks[-1] == (1500, 1500, 1000, 1500, 1900, 1800, 1300, 1300)
    controller.run(PRESS_S + 0.1)
    controller.sticks.clear()
    controller.run(1.0)
    assert controller.sticks == []
    assert controller.once(DISARM).result == mavlink.MAV_RESULT_ACCEPTED
    controller.run(0.1)
    assert controller.sticks[-1][4] == 1000


def test_a_mode_needs_sticks_and_a_return_goes_on_without_them() -> None:
    controller = Controller()
    controller.flags = 1
    controller.run(1.0)
    assert controller.once(mode("POSHOLD")).result == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    controller.run(0.3, CENTRED)
    assert controller.once(mode("POSHOLD")).result == mavlink.MAV_RESULT_ACCEPTED
    controller.run(0.3, CENTRED)
    assert controller.sticks[-1][5:7] == (1000, 1300), "ANGLE off, position hold on"
    controller.run(2.0)
    assert controller.once(mode("RETURN")).result == mavlink.MAV_RESULT_ACCEPTED
    controller.sticks.clear()
    controller.run(5.0)
    assert len(controller.sticks) >= 200
    assert set(controller.sticks) == {(1500, 1500, 1500, 1500, 1000, 1000, 1900, 1300)}
    controller.flags = 0
    controller.run(0.5)
    controller.sticks.clear()
    controller.run(1.0)
    assert controller.sticks == [], "it has landed"
    assert MAX_RETURN_S > 60


def test_what_it_cannot_do_is_said() -> None:
    controller = Controller(switches=False)
    controller.run(1.0)
    assert controller.once(ARM).result == mavlink.MAV_RESULT_DENIED
    assert controller.last("STATUSTEXT").text.startswith("No switch to arm")
    assert controller.once(mode("RETURN")).result == mavlink.MAV_RESULT_DENIED
    assert (
        controller.once(long(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 10)).result
        == mavlink.MAV_RESULT_UNSUPPORTED
    )
    assert controller.once(long(512, 148)).result == mavlink.MAV_RESULT_ACCEPTED
    assert controller.last("AUTOPILOT_VERSION").flight_sw_version >> 8 == 0x000300
    counted = mavlink.MAVLink_mission_request_list_message(1, 1, 0)
    controller.run(0.1, counted)
    assert controller.last("MISSION_COUNT").count == 0


def test_a_channel_whose_ranges_leave_no_room() -> None:
    boxes = Boxes()
    boxes.names, boxes.ids = ("ARM", "ANGLE"), (0, 1)
    boxes.ranges = msp.mode_ranges(bytes((0, 0, 0, 48)))
    assert boxes.arming(arm=True) == {0: 1500}
    assert boxes.arming(arm=False) is None
    assert boxes.switches("ANGLE") is None
    assert boxes.switches("ACRO") == {}


def test_cut_off_answers_are_ignored() -> None:
    translator = MspTranslator()
    for function in (msp.STATUS, msp.ATTITUDE, msp.ALTITUDE, msp.RAW_GPS, msp.ANALOG, msp.RC, msp.FC_VERSION):
        assert translator.from_controller(encode(MspMessage(1, ANSWER, function, b"\1")), 1.0) == (b"", b"")
    assert translator.from_controller(encode(MspMessage(2, ERROR, msp.STATUS)), 1.0) == (b"", b"")
    assert translator.from_controller(encode(MspMessage(1, REQUEST, msp.STATUS)), 1.0) == (b"", b"")
