"""Logs of older and newer versions of ArduPilot and PX4: the same values from other names, units and structures."""

import io
import math
import struct
from typing import Any

import pytest
from worlds.foreign_logs import GPS_EPOCH_S, HOME, WEEK_S
from worlds.log_versions import (
    COPTER_3_2,
    CURRENT,
    PLANE,
    PX4_ATTITUDE_1_7,
    PX4_BATTERY,
    PX4_GPS_1_13,
    PX4_HOME,
    PX4_LOCAL,
    PX4_STATUS,
    Row,
    Ulog,
    dataflash,
)

from server.flights.core.imports.conversion import convert
from server.flights.core.imports.converted import Converted
from server.flights.core.imports.dataflash_beginning import LEAP_SECONDS
from server.flights.core.tlog import read_entries
from wire.dialect import decode, mavlink

UPLOADED_US = 1_790_000_000_000_000
Messages = dict[str, list[tuple[int, Any]]]


def made(log: bytes) -> tuple[Converted, Messages]:
    """What was found, and by kind each message with its time in microseconds since 1970."""
    out = io.BytesIO()
    found = convert(log, out, uploaded_us=UPLOADED_US, max_bytes=10_000_000)
    messages: Messages = {}
    for entry in read_entries(out):
        message: Any = decode(entry.frame)
        messages.setdefault(message.get_type(), []).append((entry.at_us, message))
    return found, messages


def copter_3_2(week: int = 1833) -> bytes:
    def gps(at_ms: int, fix: int = 3) -> Row:
        place = HOME[0], HOME[1], 1.5, 489.5
        return "GPS", fix, 50_000 + at_ms, week, 9, 1.56, *place, 4.0, 90.0, -0.5, at_ms

    rows: list[Row] = [
        ("MSG", b"ArduCopter V3.2.1 (36b405fb)"),
        ("MODE", 0, 500),
        ("EV", 10),
        ("ATT", 10_000, 0, 2.0, 0, -3.0, 0, 270.0, 0, 0),
        gps(10_100),
        ("IMU", 10_140, 0.1, 0.2, 0.3, 0, 0, -9.8),
        ("EKF1", 10_140, 0, 0, 0, 1.0, -2.0, 0.5, 0, 0, 0, 0, 0, 0),
        ("CTUN", 10_140, 300, 0, 640, 0, 0, 0, 0, 0, 0, 0),
        ("CURR", 10_150, 300, 0, 1239, 720, 5154, 6.0),
        ("RCOU", 10_150, 1187, 1286, 1233, 1277, 0, 0, 1494, 1387),
        ("ATT", 10_200, 0, 2.0, 0, -3.0, 0, 270.0, 0, 0),
        gps(10_300),
        ("MODE", 6, 500),
        ("EV", 11),
        ("ATT", 10_400, 0, 2.0, 0, -3.0, 0, 270.0, 0, 0),
    ]
    return dataflash(COPTER_3_2, rows)


def test_copter_3_2_with_milliseconds_and_messages_without_a_time() -> None:
    found, messages = made(copter_3_2())
    assert (found.clock_known, found.skipped_bytes, found.max_height_m) == (True, 0, 1.5)
    began_us = (GPS_EPOCH_S + 1833 * WEEK_S + 50 + 10 - 16) * 1_000_000  # 16 leap seconds in February 2015
    assert found.began_us == began_us
    beats = [(at_us - began_us, one.custom_mode, one.base_mode >> 7) for at_us, one in messages["HEARTBEAT"]]
    assert beats == [(0, 0, 0), (0, 0, 1), (300_000, 6, 1), (300_000, 6, 0)]  # it says itself that it arms
    assert [one.text for _, one in messages["STATUSTEXT"]] == ["ArduCopter V3.2.1 (36b405fb)"]
    _, attitude = messages["ATTITUDE"][-1]
    assert attitude.roll == pytest.approx(math.radians(2.0))
    assert attitude.yaw == pytest.approx(math.radians(-90.0))
    assert (attitude.rollspeed, attitude.yawspeed) == pytest.approx((0.1, 0.3))
    _, position = messages["GLOBAL_POSITION_INT"][-1]
    assert (position.relative_alt, position.alt) == (1500, 489_500)
    assert (position.vx, position.vy, position.vz) == (100, -200, 50)
    ((_, battery),) = messages["SYS_STATUS"]
    assert (battery.voltage_battery, battery.current_battery, battery.battery_remaining) == (12_390, 720, -1)
    ((_, outputs),) = messages["SERVO_OUTPUT_RAW"]
    assert (outputs.servo1_raw, outputs.servo8_raw) == (1187, 1387)
    assert messages["VFR_HUD"][-1][1].throttle == 64


@pytest.mark.parametrize(("year_week", "ahead_s"), [(1600, 15), (1699, 16), (1851, 16), (1852, 17), (1930, 18)])
def test_leap_seconds_are_those_of_the_day(year_week: int, ahead_s: int) -> None:
    found, _ = made(copter_3_2(year_week))
    assert found.began_us == (GPS_EPOCH_S + year_week * WEEK_S + 60 - ahead_s) * 1_000_000
    assert ahead_s in [seconds for _, seconds in LEAP_SECONDS]


def test_ardupilot_4_7_texts_cores_clock_and_channels() -> None:
    long = "PreArm: a text of more than sixty-four bytes goes on in the next message of the log"
    rows: list[Row] = [
        ("MSG", 1_000_000, 7, 0, b"ArduCopter V4.7.0-dev (d74a9a2d)"),
        ("RTC", 1_000_000, 1_780_000_000_000_000, 0),
        ("MSG", 1_000_100, 8, 0, long[:64].encode()),
        ("MSG", 1_000_200, 8, 1, long[64:].encode()),
        ("MSG", 1_000_300, 9, 0, b"x" * 64),  # just as long as a message, and nothing goes on
        ("ATT", 1_100_000, 0, 0, 0, 0, 0, 0, 3),
        ("XKF4", 1_100_000, 0, 1),
        ("NKF1", 1_100_000, 0, 99, 99, 99),  # runs, but does not fly
        ("XKF1", 1_100_000, 0, 88, 88, 88),  # not the primary core
        ("XKF1", 1_100_000, 1, 3.0, 4.0, -1.0),
        ("POS", 1_100_000, *HOME, 500.0, 12.0, 12.0),
        ("RCI2", 1_100_000, 1815, 1816, 0, 0),
        ("RCIN", 1_100_000, *range(1801, 1815)),
        ("RCO2", 1_100_000, 1715, 1716, 1717, 1718),
        ("RCOU", 1_100_000, *range(1701, 1715)),
    ]
    found, messages = made(dataflash(CURRENT, rows))
    assert (found.clock_known, found.began_us) == (True, 1_780_000_000_000_000)
    texts = ["".join(one.text for _, one in messages["STATUSTEXT"][at:to]) for at, to in ((0, 1), (1, 3), (3, 5))]
    assert texts == ["ArduCopter V4.7.0-dev (d74a9a2d)", long, "x" * 64]
    ((_, position),) = messages["GLOBAL_POSITION_INT"]
    assert (position.vx, position.vy, position.vz) == (300, 400, -100)
    ((_, sticks),) = messages["RC_CHANNELS"]
    assert [sticks.chan1_raw, sticks.chan15_raw, sticks.chan16_raw, sticks.chancount] == [1801, 1815, 1816, 16]
    ((_, outputs),) = messages["SERVO_OUTPUT_RAW"]
    assert (outputs.servo1_raw, outputs.servo14_raw, outputs.servo16_raw) == (1701, 1714, 1716)


def test_a_log_that_begins_at_arming_begins_armed_and_in_its_mode() -> None:
    formats = CURRENT | {"MODE": ("QMBB", "TimeUS,Mode,ModeNum,Rsn"), "ARM": ("QBIBB", "TimeUS,ArmState,ArmChecks,F,M")}
    attitude = 0, 0, 0, 0, 0, 0, 3
    rows: list[Row] = [
        ("ATT", 1_000_000, *attitude),
        ("MODE", 1_100_000, 4, 4, 2),
        ("MODE", 2_000_000, 9, 9, 2),
        ("ATT", 2_000_000, *attitude),
        ("ARM", 2_500_000, 0, 0, 0, 13),
        ("ATT", 2_600_000, *attitude),
    ]
    _, messages = made(dataflash(formats, rows))
    beats = [(one.custom_mode, one.base_mode >> 7) for _, one in messages["HEARTBEAT"]]
    assert (beats[0], beats[-1]) == ((4, 1), (9, 0))
    assert (0, 1) not in beats
    log = Ulog(PX4)
    px4_attitude(log, 1_000_000)
    log.put("vehicle_status", 1_200_000, 2, 4, 2)
    log.put("vehicle_status", 2_000_000, 1, 4, 2)
    _, messages = made(bytes(log.log))
    beats = [(one.custom_mode, one.base_mode >> 7) for _, one in messages["HEARTBEAT"]]
    assert {mode for mode, _ in beats} == {4 << 16 | 3 << 24}
    assert (beats[0][1], beats[-1][1]) == (1, 0)


def test_a_planes_throttle_is_in_percent_and_its_airspeed_may_be_estimated() -> None:
    def control(at_us: int, throttle: float, air_m_s: float) -> Row:
        return "CTUN", at_us, 0, 0, 0, 0, throttle, 0, 0, air_m_s, 2, 1.0, 0

    place = *HOME, 500.0, 12.0, 12.0
    rows: list[Row] = [
        ("MSG", 1_000_000, 0, 0, b"ArduPlane V4.7.0-dev"),
        control(1_000_000, 55.0, 17.5),
        ("POS", 1_000_000, *place),
        ("ARSP", 1_300_000, 0, 18.5),
        control(1_300_000, 60.0, 17.5),
        ("POS", 1_300_000, *place),
    ]
    _, messages = made(dataflash(PLANE, rows))
    assert [(one.throttle, one.airspeed) for _, one in messages["VFR_HUD"]] == [(55, 17.5), (60, 18.5)]
    assert {one.type for _, one in messages["HEARTBEAT"]} == {mavlink.MAV_TYPE_FIXED_WING}


def test_a_damaged_time_does_not_end_the_flight_and_a_real_pause_is_kept() -> None:
    rows: list[Row] = [("ATT", at_s * 1_000_000, 0, 0, 0, 0, 0, 0, 0) for at_s in (1, 2, 50_000, 3, 500, 501, 502)]
    found, messages = made(dataflash(CURRENT, rows))
    assert [at_us - found.began_us for at_us, _ in messages["ATTITUDE"]] == [0, 1e6, 2e6, 500e6, 501e6]


def test_numbers_that_are_none_cost_their_message_only() -> None:
    formats = {"ATT": ("dfff", "TimeUS,Roll,Pitch,Yaw"), "VIBE": ("Qdddd", "TimeUS,VibeX,VibeY,VibeZ,Clip")}
    rows: list[Row] = [
        ("ATT", math.nan, 1.0, 1.0, 1.0),
        ("ATT", math.inf, 1.0, 1.0, 1.0),
        ("VIBE", 10, 1e300, 1.0, 1.0, math.nan),
        ("ATT", 1_000_000.0, 1.0, 1.0, 1.0),
    ]
    found, messages = made(dataflash(formats, rows))
    assert found.frames >= 2
    assert messages["ATTITUDE"][-1][1].roll == pytest.approx(math.radians(1.0))
    assert "VIBRATION" not in messages


PX4 = {
    "home_position": PX4_HOME,
    "vehicle_status": PX4_STATUS,
    "vehicle_attitude": PX4_ATTITUDE_1_7,
    "vehicle_local_position": PX4_LOCAL,
    "vehicle_gps_position": PX4_GPS_1_13,
    "battery_status": PX4_BATTERY,
    "actuator_controls_0": ("uint64_t timestamp;float[8] control", "Q8f"),
}


def px4_attitude(log: Ulog, at_us: int, rate: float = 0.5) -> None:
    log.put("vehicle_attitude", at_us, rate, 0, 0, 1, 0, 0, 0)


def test_px4_1_7_says_rates_with_the_attitude_and_places_in_metres() -> None:
    log = Ulog(PX4, began_us=60_000_000)
    log.put("home_position", 3_000_000, 0, 0, 480.0, True, False)  # said at boot: a height, as yet no place
    log.put("battery_status", 60_000_000, 16.2, -1.0, -1.0)
    log.put("actuator_controls_0", 60_100_000, 0, 0, 0, 0.42, 0, 0, 0, 0)
    px4_attitude(log, 60_100_000)
    north_m, east_m = 100.0, 50.0
    log.put("vehicle_local_position", 60_100_000, *HOME, north_m, east_m, -12.0, 1, 2, 3, 485.0, True, True)
    log.put("vehicle_gps_position", 60_500_000, 1_780_000_060_400_000, 1, 1, 1, 0.8, 1, 0, -100_000, 3, 9)
    found, messages = made(bytes(log.log))
    assert (found.clock_known, found.began_us) == (True, 1_780_000_060_000_000)
    assert "HOME_POSITION" not in messages
    ((_, battery),) = messages["SYS_STATUS"]
    assert (battery.voltage_battery, battery.current_battery, battery.battery_remaining) == (16_200, -1, -1)
    assert messages["ATTITUDE"][0][1].rollspeed == pytest.approx(0.5)
    ((_, position),) = messages["GLOBAL_POSITION_INT"]
    east_per_degree = 111_195 * math.cos(math.radians(HOME[0]))
    assert position.lat / 1e7 == pytest.approx(HOME[0] + north_m / 111_195, abs=1e-6)
    assert position.lon / 1e7 == pytest.approx(HOME[1] + east_m / east_per_degree, abs=1e-6)
    assert (position.alt, position.relative_alt) == (497_000, 17_000)  # above the home that was said before the log
    assert messages["VFR_HUD"][0][1].throttle == 42


def test_a_px4_log_without_an_estimate_has_the_places_of_the_gps() -> None:
    log = Ulog(PX4)
    for step, height_mm in enumerate((488_000, 490_500)):
        at_us = 1_000_000 + step * 1_000_000
        place = round(HOME[0] * 1e7), round(HOME[1] * 1e7), height_mm
        log.put("vehicle_gps_position", at_us, 1_780_000_000_000_000 + at_us, *place, 0.8, 1, 0, 0, 3, 9)
    _, messages = made(bytes(log.log))
    assert [one.relative_alt for _, one in messages["GLOBAL_POSITION_INT"]] == [0, 2500]


def test_px4s_modes_of_external_programs() -> None:
    log = Ulog(PX4)
    log.put("vehicle_status", 1_000_000, 2, 23, 2)
    log.put("vehicle_status", 2_000_000, 2, 30, 2)
    _, messages = made(bytes(log.log))
    assert [one.custom_mode for _, one in messages["HEARTBEAT"]][-1] == 4 << 16 | 18 << 24
    assert 4 << 16 | 11 << 24 in [one.custom_mode for _, one in messages["HEARTBEAT"]]


def test_what_px4_appends_after_a_crash_is_read_from_its_place() -> None:
    flags = bytearray(40)
    flags[8] = 1
    begun = Ulog(PX4, flags=bytes(flags))
    begun.put("vehicle_status", 1_000_000, 2, 4, 2)
    px4_attitude(begun, 1_100_000)
    half = struct.pack("<HB", 2000, ord("D")) + b"\x02\x00 the log ended in the middle of this"
    at = len(begun.log) + len(half)
    flags[16:24] = struct.pack("<Q", at)
    whole = Ulog(PX4, flags=bytes(flags))
    whole.put("vehicle_status", 1_000_000, 2, 4, 2)
    px4_attitude(whole, 1_100_000)
    whole.log += half
    whole.put("vehicle_status", 2_000_000, 2, 5, 2)
    px4_attitude(whole, 2_100_000, rate=0.25)
    found, messages = made(bytes(whole.log))
    assert found.skipped_bytes == len(half)
    assert [one.rollspeed for _, one in messages["ATTITUDE"]] == [0.5, 0.25]
    assert messages["HEARTBEAT"][-1][1].custom_mode == 4 << 16 | 5 << 24


def test_a_px4_log_with_many_torn_places_keeps_the_rest() -> None:
    log = Ulog(PX4)
    begins = []
    for step in range(400):
        begins.append(len(log.log))
        px4_attitude(log, 1_000_000 + step * 100_000)
    for at in begins[20::20]:  # sizes that would swallow what follows, kinds that are none, flags of nobody
        log.log[at : at + 3] = (b"\xff\x03D", b"\x20\x00?", b"\x10\x00B")[at % 3]
    _, messages = made(bytes(log.log))
    assert len(messages["ATTITUDE"]) >= 400 - 2 * len(begins[20::20])


@pytest.mark.parametrize("has_mark", [True, False])
def test_a_torn_px4_log_goes_on_after_the_tear(has_mark: bool) -> None:
    log = Ulog(PX4)
    for step in range(50):
        px4_attitude(log, 1_000_000 + step * 100_000)
    before = len(log.log)
    log.log += b"\xff\xff\xff" + b"\xee" * 300  # a size that leads past the end, and junk
    if has_mark:
        log.message("S", b"\x2f\x73\x13\x20\x25\x0c\xbb\x12")
    for step in range(50, 100):
        px4_attitude(log, 1_000_000 + step * 100_000)
    assert len(log.log) - before < 0xFFFF  # so the size of the torn place would hide all the rest
    found, messages = made(bytes(log.log))
    assert len(messages["ATTITUDE"]) == 100
    assert found.skipped_bytes == 303
