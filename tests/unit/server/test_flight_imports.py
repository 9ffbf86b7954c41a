"""Logs of other programs become telemetry: every value where it was, and no file harms the reader."""

import io
import itertools
import math
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from worlds import foreign_logs
from worlds.flight_files import telemetry_log
from worlds.foreign_logs import (
    BEGAN_S,
    CLIMB_M_S,
    HOME,
    HOME_MSL_M,
    LONG_TEXT,
    ROLL_DEG,
    SPEED_M_S,
    YAW_DEG,
    dataflash_log,
    middle_replaced,
    place,
    ulog_log,
)
from worlds.tiers import examples, thinned

from server.flights.core.imports.conversion import convert
from server.flights.core.imports.converted import Converted
from server.flights.core.imports.refusals import BadFlightFile
from server.flights.core.imports.ulog import UlogReader
from server.flights.core.imports.ulog_flight import MODES
from server.flights.core.tlog import STAMP, read_entries
from wire.dialect import build, decode, mavlink

UPLOADED_US = 1_790_000_000_000_000
MANY_BYTES = 100_000_000
LASTS_S = 30.0


def made(log: bytes, *, max_bytes: int = MANY_BYTES) -> tuple[Converted, list[tuple[float, Any]]]:
    """What was found, and each message with its time in seconds since boot of the examples."""
    out = io.BytesIO()
    found = convert(log, out, uploaded_us=UPLOADED_US, max_bytes=max_bytes)
    entries = list(read_entries(out))
    assert entries[-1].end == len(out.getvalue()) == found.size_bytes
    assert len(entries) == found.frames
    return found, [(entry.at_us / 1e6 - BEGAN_S, decode(entry.frame)) for entry in entries]


def of_kind(messages: list[tuple[float, Any]], name: str) -> list[tuple[float, Any]]:
    return [(at_s, message) for at_s, message in messages if message.get_type() == name]


LOGS = {"dataflash": dataflash_log(LASTS_S), "ulog": ulog_log(LASTS_S)}


@pytest.mark.parametrize("kind", LOGS)
def test_every_value_is_where_it_was(kind: str) -> None:
    found, messages = made(LOGS[kind])
    assert (found.format, found.clock_known, found.skipped_bytes) == (kind, True, 0)
    assert found.began_us == round((BEGAN_S + 1) * 1e6)
    assert found.ended_us == pytest.approx((BEGAN_S + LASTS_S) * 1e6, abs=1e6)
    flown_s = LASTS_S - foreign_logs.TAKE_OFF_S
    assert found.distance_m == pytest.approx(flown_s * SPEED_M_S, rel=0.05)
    assert found.max_height_m == pytest.approx(flown_s * CLIMB_M_S, rel=0.02)
    times = [at_s for at_s, _ in messages]
    assert times == sorted(times)

    positions = of_kind(messages, "GLOBAL_POSITION_INT")
    assert len(positions) == pytest.approx(10 * (LASTS_S - 2), rel=0.03)
    for at_s, one in positions:
        lat, lon, height = place(at_s)
        assert (one.lat / 1e7, one.lon / 1e7) == pytest.approx((lat, lon), abs=2e-6)
        assert one.relative_alt / 1000 == pytest.approx(height, abs=0.01)
        assert one.alt / 1000 == pytest.approx(HOME_MSL_M + height, abs=0.05)
        assert one.hdg / 100 == pytest.approx(YAW_DEG, abs=0.1)
    _, last = positions[-1]
    assert (last.vx, last.vy, last.vz) == (SPEED_M_S * 100, 0, -CLIMB_M_S * 100)

    attitudes = of_kind(messages, "ATTITUDE")
    assert len(attitudes) == pytest.approx(25 * (LASTS_S - 2), rel=0.05)  # of 50 a second
    assert all(one.yaw == pytest.approx(math.radians(YAW_DEG), abs=1e-3) for _, one in attitudes)
    batteries = of_kind(messages, "SYS_STATUS")
    assert {(one.voltage_battery, one.current_battery, one.battery_remaining) for _, one in batteries} == {
        (16_200, 1250, 81)
    }
    (_, home), *_ = of_kind(messages, "HOME_POSITION")
    assert (home.latitude / 1e7, home.longitude / 1e7, home.altitude) == pytest.approx((*HOME, HOME_MSL_M * 1000))
    _, gps = of_kind(messages, "GPS_RAW_INT")[-1]
    assert (gps.fix_type, gps.satellites_visible, gps.eph) == (3, 14, 80)
    assert gps.lat / 1e7 == pytest.approx(place(LASTS_S)[0], abs=2e-5)
    _, sticks = of_kind(messages, "RC_CHANNELS")[-1]
    assert (sticks.chan1_raw, sticks.chan4_raw) in ((1500, 1503),)
    assert sticks.chan18_raw == 0xFFFF


def test_ardupilots_modes_arming_and_texts() -> None:
    _, messages = made(LOGS["dataflash"])
    beats = of_kind(messages, "HEARTBEAT")
    assert {one.type for _, one in beats} == {mavlink.MAV_TYPE_FIXED_WING}
    assert {one.autopilot for _, one in beats} == {mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA}
    armed = [at_s for at_s, one in beats if one.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED]
    assert (armed[0], armed[-1]) == (pytest.approx(2.0, abs=0.01), pytest.approx(LASTS_S, abs=0.01))
    assert [beats[4][1].custom_mode, beats[-1][1].custom_mode] == [10, 11]
    assert not beats[-1][1].base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED
    assert all(late - soon <= 1.05 for (soon, _), (late, _) in itertools.pairwise(beats))
    texts = of_kind(messages, "STATUSTEXT")
    assert texts[0][1].text == "ArduPlane V4.6.0 (1234abcd)"
    assert "".join(one.text for _, one in texts[1:]) == LONG_TEXT[:64]
    assert of_kind(messages, "ATTITUDE")[0][1].roll == pytest.approx(math.radians(ROLL_DEG))


def test_px4s_modes_arming_and_texts() -> None:
    _, messages = made(LOGS["ulog"])
    beats = of_kind(messages, "HEARTBEAT")
    assert {(one.type, one.autopilot) for _, one in beats} == {(mavlink.MAV_TYPE_HEXAROTOR, mavlink.MAV_AUTOPILOT_PX4)}
    hold, returns = 4 << 16 | 3 << 24, 4 << 16 | 5 << 24
    assert [beats[4][1].custom_mode, beats[-1][1].custom_mode] == [hold, returns]
    texts = of_kind(messages, "STATUSTEXT")
    assert "".join(one.text for _, one in texts) == LONG_TEXT
    assert {one.severity for _, one in texts} == {4}
    assert [one.chunk_seq for _, one in texts] == [0, 1]
    landed = [one.landed_state for _, one in of_kind(messages, "EXTENDED_SYS_STATE")]
    assert (landed[0], landed[-1]) == (mavlink.MAV_LANDED_STATE_ON_GROUND, mavlink.MAV_LANDED_STATE_IN_AIR)
    assert all(0 < main < 8 and (sub < 11 or main == 4) for main, sub in MODES.values())


@pytest.mark.parametrize("log", [dataflash_log(5, has_gps=False), ulog_log(5, has_gps=False)])
def test_a_log_without_a_clock_begins_at_the_upload(log: bytes) -> None:
    found, _ = made(log)
    assert not found.clock_known
    assert found.began_us == UPLOADED_US + 1_000_000


def test_a_telemetry_log_keeps_its_frames_and_loses_torn_places_and_keys() -> None:
    log = telemetry_log(BEGAN_S, 20.0, 10)
    found, messages = made(log)
    assert (found.format, found.skipped_bytes, found.size_bytes) == ("tlog", 0, len(log))
    torn, fewer = made(middle_replaced(log, [0xFD] * 200))
    assert 200 <= torn.skipped_bytes < 600
    assert len(messages) - 20 < len(fewer) < len(messages)
    key = build(mavlink.MAVLink_setup_signing_message(1, 1, bytes(32), 0), system_id=1, component_id=1, sequence=0)
    kept, same = made(log + STAMP.pack(round((BEGAN_S + 30) * 1e6)) + key)
    assert (kept.frames, len(same)) == (found.frames, len(messages))


def test_torn_places_cost_only_themselves() -> None:
    found, messages = made(middle_replaced(LOGS["dataflash"], [0xA3] * 300))
    assert 200 <= found.skipped_bytes < 600
    assert len(of_kind(messages, "GLOBAL_POSITION_INT")) > 270
    cut, _ = made(LOGS["ulog"][:-7])
    assert 0 < cut.skipped_bytes < 100


@pytest.mark.parametrize(
    ("log", "words"),
    [
        (b"", "no flight file"),
        (b"PK\x03\x04 and so on" * 50, "no flight file"),
        (bytes(10_000), "no flight file"),
        (b"\xa3\x95\x01" + bytes(100), "no dataflash log"),
        (foreign_logs.dataflash_formats(), "nothing in this log"),
        (b"ULog\x01\x12\x35\x01", "no ULog"),
        (ulog_log(3)[:500], "nothing in this log"),
        (ulog_log(3, flags=bytes(8) + b"\x02" + bytes(31)), "newer kind"),
    ],
)
def test_a_bad_file_is_refused_with_words(log: bytes, words: str) -> None:
    with pytest.raises(BadFlightFile, match=words):
        made(log)


@pytest.mark.parametrize("log", [*LOGS.values(), telemetry_log(BEGAN_S, 20.0, 10)])
def test_a_flight_that_is_too_long_is_refused(log: bytes) -> None:
    with pytest.raises(BadFlightFile, match="too long"):
        made(log, max_bytes=2000)


def test_types_that_contain_themselves_are_refused() -> None:
    recursive = b"".join(
        foreign_logs.ulog_message(kind, body)
        for kind, body in (
            ("F", b"vehicle_status:uint64_t timestamp;self a;uint8_t x;"),
            ("F", b"self:self[9999] a;"),
            ("A", b"\0\0\0vehicle_status"),
        )
    )
    with pytest.raises(BadFlightFile, match="does not explain"):
        made(b"ULog\x01\x12\x35\x01" + bytes(8) + recursive)


def test_a_type_is_worked_out_once_however_often_it_is_subscribed_to(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each of 6,600 subscriptions looked at each of 15,000 fields: 144 kB kept the one converter busy for 5 minutes."""
    worked_out = []
    layout, size = UlogReader._layout, UlogReader._size
    monkeypatch.setattr(UlogReader, "_layout", lambda self, name: worked_out.append(name) or layout(self, name))
    monkeypatch.setattr(UlogReader, "_size", lambda self, *one: worked_out.append(one[0]) or size(self, *one))
    formats = [
        ("F", b"one:uint8_t a;"),
        ("F", b"wide:" + b"one a;" * 9_000),
        ("F", b"wide:float a;"),  # counts for nothing: the first one does
        ("F", b"vehicle_status:uint64_t timestamp;wide a;uint8_t nav_state;"),
    ]
    subscribed = [("A", b"\0" + number.to_bytes(2, "little") + b"vehicle_status") for number in range(6_600)]
    head = b"ULog\x01\x12\x35\x01" + bytes(8)
    log = head + b"".join(foreign_logs.ulog_message(kind, body) for kind, body in formats + subscribed)
    reader = UlogReader(log, {"vehicle_status"})
    assert list(reader) == []
    assert worked_out.count("vehicle_status") == 1
    assert len(worked_out) < 10_000
    assert reader._topics[6_599][2].body.size == 8 + 9_000 + 1


@given(st.data())
@settings(max_examples=examples(50, long=300), deadline=None)
def test_no_bytes_break_the_reader(data: st.DataObject) -> None:
    """Whatever stands in a file, it is converted or refused with words."""
    kind = data.draw(st.sampled_from(("dataflash", "ulog", "tlog")))
    log = bytearray({"dataflash": dataflash_log(3), "ulog": ulog_log(3), "tlog": telemetry_log(BEGAN_S, 3, 10)}[kind])
    for _ in range(data.draw(st.integers(1, 12))):
        at = data.draw(st.integers(4, len(log) - 1))
        junk = data.draw(st.binary(min_size=1, max_size=9))
        log[at : at + len(junk)] = junk
    try:
        convert(bytes(log), io.BytesIO(), uploaded_us=UPLOADED_US, max_bytes=MANY_BYTES)
    except BadFlightFile as refusal:
        assert str(refusal)


def set_in_flight(log: bytes, at_s: float, by_s: float) -> bytes:
    """The same telemetry log, written by a computer whose clock is set then."""
    out = bytearray()
    for entry in read_entries(io.BytesIO(log)):
        is_later = entry.at_us / 1e6 - BEGAN_S >= at_s
        out += STAMP.pack(entry.at_us + (round(by_s * 1e6) if is_later else 0)) + entry.frame
    return bytes(out)


YEARS_S = 94_608_000.0


@pytest.mark.parametrize(
    ("by_s", "at_s"),
    thinned(
        itertools.product([YEARS_S, 3600.0, 20.0, -20.0, -3600.0, -YEARS_S / 10], [0.4, 37.03, 118.0]),
        every=5,
        why="another time and another jump",
    ),
)
def test_a_clock_that_is_set_in_flight_makes_no_flight_longer(by_s: float, at_s: float) -> None:
    log = telemetry_log(BEGAN_S, 120.0, 10)
    plain, messages = made(log)
    found, moved = made(set_in_flight(log, at_s, by_s))
    assert (found.ended_us - found.began_us) / 1e6 == pytest.approx(120.0, abs=0.2)
    assert found.began_us / 1e6 == pytest.approx(BEGAN_S + by_s, abs=0.2), "the clock that was set is right"
    (jump,) = found.clock_jumps
    assert jump.by_s == pytest.approx(by_s, abs=0.2)
    assert jump.at_us / 1e6 == pytest.approx(BEGAN_S + by_s + at_s, abs=0.2)
    assert (found.distance_m, found.max_height_m, found.frames) == (
        plain.distance_m,
        plain.max_height_m,
        plain.frames,
    )
    for (at, _), (moved_at, _) in zip(messages, moved, strict=True):
        assert moved_at - by_s == pytest.approx(at, abs=0.2)


def test_a_clock_that_is_set_twice() -> None:
    log = set_in_flight(set_in_flight(telemetry_log(BEGAN_S, 200.0, 10), 20.0, YEARS_S), 150.0 + YEARS_S, -300.0)
    found, _ = made(log)
    assert (found.ended_us - found.began_us) / 1e6 == pytest.approx(200.0, abs=0.2)
    assert [round(jump.by_s) for jump in found.clock_jumps] == [YEARS_S, -300]


def test_a_log_whose_clock_was_right_keeps_every_time() -> None:
    log = telemetry_log(BEGAN_S, 300.0, 10)
    found, messages = made(log)
    assert found.clock_jumps == []
    assert [entry.at_us / 1e6 - BEGAN_S for entry in read_entries(io.BytesIO(log))] == [at for at, _ in messages]


def test_a_pause_of_the_link_is_a_pause_and_no_jump() -> None:
    first, second = telemetry_log(BEGAN_S, 20.0, 10), telemetry_log(BEGAN_S, 600.0, 10)
    later = [entry for entry in read_entries(io.BytesIO(second)) if entry.at_us / 1e6 - BEGAN_S > 500.0]
    found, _ = made(first + b"".join(STAMP.pack(one.at_us) + one.frame for one in later))
    assert found.clock_jumps == []
    assert (found.ended_us - found.began_us) / 1e6 == pytest.approx(600.0, abs=0.2)


def test_frames_that_were_held_up_are_no_jump() -> None:
    """Eight seconds of frames come all at once."""
    out = bytearray()
    for entry in read_entries(io.BytesIO(telemetry_log(BEGAN_S, 120.0, 10))):
        at_s = entry.at_us / 1e6 - BEGAN_S
        late_s = 58.0 - at_s if 50.0 <= at_s < 58.0 else 0.0
        out += STAMP.pack(entry.at_us + round(late_s * 1e6)) + entry.frame
    found, _ = made(bytes(out))
    assert found.clock_jumps == []
    assert (found.ended_us - found.began_us) / 1e6 == pytest.approx(120.0, abs=3.0)


def test_a_reboot_in_the_middle_counts_by_the_clock_of_the_computer() -> None:
    again = telemetry_log(BEGAN_S + 900.0, 60.0, 10)
    found, _ = made(telemetry_log(BEGAN_S, 60.0, 10) + again)
    assert found.clock_jumps == []
    assert (found.ended_us - found.began_us) / 1e6 == pytest.approx(960.0, abs=0.2)
    back, _ = made(telemetry_log(BEGAN_S, 60.0, 10) + telemetry_log(BEGAN_S - YEARS_S, 60.0, 10))
    assert (back.ended_us - back.began_us) / 1e6 == pytest.approx(120.0, abs=0.3)
    assert [jump.by_s < -YEARS_S for jump in back.clock_jumps] == [True]


def test_a_log_of_a_computer_without_a_clock_begins_at_the_upload() -> None:
    found, _ = made(telemetry_log(5.0, 60.0, 10))
    assert (found.clock_known, found.began_us, found.skipped_bytes) == (False, UPLOADED_US, 0)
    assert (found.ended_us - found.began_us) / 1e6 == pytest.approx(60.0, abs=0.2)


def test_a_clock_that_is_set_from_1970_loses_no_frame() -> None:
    log = set_in_flight(telemetry_log(BEGAN_S, 60.0, 10), 0.0, -BEGAN_S + 40.0)
    halves = list(read_entries(io.BytesIO(telemetry_log(BEGAN_S, 120.0, 10))))
    later = b"".join(STAMP.pack(one.at_us) + one.frame for one in halves if one.at_us / 1e6 - BEGAN_S >= 60.0)
    found, _ = made(log + later)
    assert (found.clock_known, found.skipped_bytes) == (True, 0)
    assert found.began_us / 1e6 == pytest.approx(BEGAN_S, abs=0.2)
    assert (found.ended_us - found.began_us) / 1e6 == pytest.approx(120.0, abs=0.2)


@given(st.lists(st.tuples(st.floats(0, 1), st.floats(-1e8, 1e8)), max_size=3))
@settings(max_examples=examples(10, long=200), deadline=None)
def test_whatever_the_clock_does_the_duration_is_the_autopilots(sets: list[tuple[float, float]]) -> None:
    entries = list(read_entries(io.BytesIO(telemetry_log(BEGAN_S, 60.0, 2))))
    out = bytearray()
    for number, entry in enumerate(entries):
        wrong_s = sum(by_s for share, by_s in sets if number >= share * len(entries))
        out += STAMP.pack(entry.at_us + round(wrong_s * 1e6)) + entry.frame
    found, _ = made(bytes(out))
    assert (found.ended_us - found.began_us) / 1e6 == pytest.approx(60.0, abs=7.0)
