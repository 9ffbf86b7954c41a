"""System identification against systems whose gain, time constant and delay are known."""

import io
import json
import math
from collections.abc import Callable
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner
from worlds.tiers import thinned

from onboard_agent.black_box.csv_rows import HEADER, CsvRows, clock_offset_us
from server.app.cli import app
from server.flights.core.tlog import STAMP, Entry, read_entries
from server.identification.core.axes import NoColumns, identify, table_of_csv, table_of_tlog
from server.identification.core.first_order import Samples, fit, manoeuvres_in
from wire.dialect import build, mavlink

FINE = 50
"""Steps of the true system for each sample."""


def doublets(at_s: float) -> float:
    """Every six seconds a step to one side and to the other, each of 1.2 s, growing from 40 to 80 %."""
    number, within = divmod(at_s, 6.0 + math.pi / 300)  # never at the same time within a sample
    size = 0.4 + 0.1 * (number % 5)
    return size if 2.0 <= within < 3.2 else -size if 3.2 <= within < 4.4 else 0.0


def ramps(at_s: float) -> float:
    """Trapezoids, as a person moves a stick: 0.4 s up, 1 s there, 0.4 s back."""
    within = at_s % 5.0 - 2.0
    return 0.7 * min(1.0, max(0.0, within / 0.4), max(0.0, (1.8 - within) / 0.4)) if 0 < within < 1.8 else 0.0


def flown(
    hz: float, *, gain: float, tau_s: float, delay_s: float, lasts_s: float = 36.0, stick: Callable[[float], float]
) -> tuple[Samples, Samples, Samples]:
    """The true system, solved in steps of a fiftieth of the sampling time."""
    count, step_s = round(lasts_s * hz), 1 / hz / FINE
    times, given, got = np.arange(count) / hz, np.empty(count), np.empty(count)
    state = 0.0
    for at in range(count):
        given[at], got[at] = stick(times[at]), gain * state
        for part in range(FINE):
            state += (stick(times[at] + (part + 0.5) * step_s - delay_s) - state) * (1 - math.exp(-step_s / tau_s))
    return times, given, got


KNOWN = [
    (50, 45.0, 0.25, 0.08),
    (50, -30.0, 0.08, 0.2),
    (25, 120.0, 0.6, 0.0),
    (100, 3.0, 1.5, 0.4),
    (10, 35.0, 0.4, 0.3),
]
"""Samples per second, gain, time constant and delay in seconds."""


@pytest.mark.parametrize(
    ("stick", "system"), thinned(product([doublets, ramps], KNOWN), every=3, why="the same with other figures")
)
def test_a_known_system_is_found(stick: Callable[[float], float], system: tuple[float, float, float, float]) -> None:
    hz, gain, tau_s, delay_s = system
    found = fit(manoeuvres_in(*flown(hz, gain=gain, tau_s=tau_s, delay_s=delay_s, stick=stick)))
    assert found is not None
    assert found.gain == pytest.approx(gain, rel=0.05)
    # The stick steps between samples, at a time that nobody sees.
    assert found.tau_s == pytest.approx(tau_s, rel=0.05)
    assert found.delay_s == pytest.approx(delay_s, abs=0.4 / hz)
    assert found.r_squared > 0.99
    assert found.sample_s == pytest.approx(1 / hz)
    assert found.rise_s == pytest.approx(2.197 * found.tau_s, rel=1e-3)
    assert found.manoeuvres == len(range(0, 36, 6 if stick is doublets else 5)) - (stick is ramps)
    assert not found.at_bound


def test_noise_and_drift_move_it_little() -> None:
    times, given, got = flown(50, gain=40, tau_s=0.3, delay_s=0.1, stick=doublets, lasts_s=60)
    noisy = got + np.random.default_rng(1).normal(0, 2.0, len(got)) + 5 * np.sin(times / 20)
    found = fit(manoeuvres_in(times, given, noisy))
    assert found is not None
    assert found.gain == pytest.approx(40, rel=0.05)
    assert found.tau_s == pytest.approx(0.3, rel=0.1)
    assert found.delay_s == pytest.approx(0.1, abs=0.02)
    assert 0.9 < found.r_squared < 0.995


def test_what_the_sticks_do_not_cause_is_not_explained() -> None:
    times, given, _ = flown(50, gain=40, tau_s=0.3, delay_s=0.1, stick=doublets)
    found = fit(manoeuvres_in(times, given, np.random.default_rng(2).normal(0, 5.0, len(times))))
    assert found is not None
    assert found.r_squared < 0.3


def test_a_system_slower_than_what_is_searched_is_said_to_be_at_the_bound() -> None:
    found = fit(manoeuvres_in(*flown(25, gain=40, tau_s=30.0, delay_s=0.1, stick=doublets)))
    assert found is not None
    assert found.at_bound


def test_sticks_at_rest_or_without_a_flight_are_no_manoeuvre() -> None:
    times = np.arange(500) / 50
    still = np.full(500, 0.02)
    assert manoeuvres_in(times, still, still) == []
    assert fit([]) is None
    assert manoeuvres_in(times, np.full(500, np.nan), still) == []
    assert manoeuvres_in(np.empty(0), np.empty(0), np.empty(0)) == []


def test_a_drone_that_does_not_move_has_no_response() -> None:
    times, given, got = flown(50, gain=40, tau_s=0.3, delay_s=0.1, stick=doublets)
    assert fit(manoeuvres_in(times, given, np.zeros_like(got))) is None


def test_a_hole_in_the_record_ends_a_manoeuvre() -> None:
    times, given, got = flown(50, gain=40, tau_s=0.3, delay_s=0.1, stick=doublets, lasts_s=6)
    whole = manoeuvres_in(times, given, got)
    there = (times < 3.0) | (times > 5.5)
    (cut,) = manoeuvres_in(times[there], given[there], got[there])
    assert len(whole) == 1
    assert cut.times_s[-1] < 3.0
    # A gap of the answer alone is one as well.
    missing = np.where(there, got, np.nan)
    (same,) = manoeuvres_in(times, given, missing)
    assert np.array_equal(same.times_s, cut.times_s)


SYSTEMS = {"roll": (35.0, 0.25, 0.1), "pitch": (-35.0, 0.3, 0.12), "yaw": (90.0, 0.15, 0.06), "climb": (3.0, 0.8, 0.2)}


def frames() -> list[tuple[int, bytes]]:
    """A flight at 50 Hz in which one stick after the other is moved, each of its axes a known system."""
    hz, lasts_s = 50, 24.0
    runs = {
        name: flown(hz, gain=gain, tau_s=tau_s, delay_s=delay_s, stick=doublets, lasts_s=lasts_s)
        for name, (gain, tau_s, delay_s) in SYSTEMS.items()
    }
    found: list[tuple[int, bytes]] = []
    for number, moved in enumerate(SYSTEMS):
        _, given, got = runs[moved]
        for at, (stick, value) in enumerate(zip(given, got, strict=True)):
            at_us = 1_000_000_000 + round((number * lasts_s + at / hz) * 1e6)
            value = float(value)
            place = 470_000_000, 80_000_000, 500_000, 20_000
            down = round(-value * 100) if moved == "climb" else 0
            roll, pitch, yaw_rate = (math.radians(value) if moved == one else 0.0 for one in ("roll", "pitch", "yaw"))
            deflections = {name: round(1000 * stick) if moved == name else 0 for name in SYSTEMS}
            sticks = deflections["pitch"], deflections["roll"], 500 + deflections["climb"] // 2, deflections["yaw"]
            by_ground = mavlink.MAVLink_manual_control_message(1, *sticks, 0)
            found.append((at_us, build(by_ground, system_id=255, component_id=190, sequence=at % 256)))
            position = mavlink.MAVLink_global_position_int_message(20 * at, *place, 0, 0, down, 0)
            attitude = mavlink.MAVLink_attitude_message(20 * at, roll, pitch, 0.0, 0.0, 0.0, yaw_rate)
            by_drone = (build(one, system_id=1, component_id=1, sequence=at % 256) for one in (position, attitude))
            found.extend((at_us, frame) for frame in by_drone)
    return found


@pytest.fixture(scope="module")
def flight() -> list[tuple[int, bytes]]:
    return frames()


def check(found: dict[str, object]) -> None:
    assert set(found) == set(SYSTEMS)
    for name, (gain, tau_s, delay_s) in SYSTEMS.items():
        one = found[name]
        assert isinstance(one, dict), name
        assert one["gain"] == pytest.approx(gain, rel=0.06), name
        assert one["tau_s"] == pytest.approx(tau_s, rel=0.06, abs=0.01), name
        assert one["delay_s"] == pytest.approx(delay_s, abs=0.02), name
        assert one["manoeuvres"] == 4, name


def test_black_box_and_telemetry_log_say_the_same_by_command(flight: list[tuple[int, bytes]], tmp_path: Path) -> None:
    rows = CsvRows()
    (table := tmp_path / "flight.csv").write_text(HEADER + "".join(rows.take(at_us, frame) for at_us, frame in flight))
    (log := tmp_path / "flight.tlog").write_bytes(b"".join(STAMP.pack(at_us) + frame for at_us, frame in flight))
    for file in (table, log):
        ran = CliRunner().invoke(app, ["identify", "--json", str(file)])
        assert ran.exit_code == 0, ran.output
        check(json.loads(ran.output))
    assert identify(table_of_tlog(read_entries(io.BytesIO(log.read_bytes()))))["roll"] is not None
    said = CliRunner().invoke(app, ["identify", str(table)]).output.splitlines()
    assert [line.split()[0] for line in said] == ["axis", "roll", "pitch", "yaw", "climb"]


def test_channels_of_a_receiver_count_where_there_are_no_sticks(flight: list[tuple[int, bytes]]) -> None:
    def with_channels() -> list[Entry]:
        found = []
        for at_us, frame in flight:
            if frame[7] != mavlink.MAVLINK_MSG_ID_MANUAL_CONTROL:
                found.append(Entry(at_us, frame, 0))
                continue
            x, y, z, r = (int.from_bytes(frame[at : at + 2], "little", signed=True) for at in (10, 12, 14, 16))
            raw = [1500 + y // 2, 1500 + x // 2, 1000 + z, 1500 + r // 2, *[1500] * 14]
            channels = mavlink.MAVLink_rc_channels_message(0, 18, *raw, 255)
            found.append(Entry(at_us, build(channels, system_id=1, component_id=1, sequence=0), 0))
        return found

    found = identify(table_of_tlog(iter(with_channels())))
    for name in SYSTEMS:
        one = found[name]
        assert one is not None
        assert one.gain == pytest.approx(SYSTEMS[name][0], rel=0.06)


def test_the_delay_of_a_known_system_is_found_in_a_black_box_of_100_hz() -> None:
    """Frames arrive up to 9 ms late, as serial lines and threads make them; the autopilot's stamps do not."""
    rng = np.random.default_rng(7)
    times, given, got = flown(100, gain=35.0, tau_s=0.15, delay_s=0.12, stick=doublets)
    entries: list[tuple[int, bytes]] = []
    for at, (at_s, stick, roll_deg) in enumerate(zip(times, given, got, strict=True)):
        boot_ms = 5_000 + round(at_s * 1000)
        raw = [1500 + round(500 * float(stick)), *[1500] * 17]
        channels = mavlink.MAVLink_rc_channels_message(boot_ms, 18, *raw, 255)
        outputs = mavlink.MAVLink_servo_output_raw_message(1000 * boot_ms, 0, *[1400 + at % 100] * 8)
        attitude = mavlink.MAVLink_attitude_message(boot_ms, math.radians(roll_deg), 0, 0, 0, 0, 0)
        late_us = 1_000_000_000 + round(at_s * 1e6) + int(rng.integers(1000, 9000))
        frames = (build(one, system_id=1, component_id=1, sequence=at % 256) for one in (channels, outputs, attitude))
        entries.extend((late_us, frame) for frame in frames)
    rows = CsvRows(clock_offset_us(entries))
    lines = [row for row in (rows.take(at_us, frame) for at_us, frame in entries) if row]
    stamps = np.array([float(line.split(",")[0]) for line in lines])
    assert len(lines) == len(times), "no row is left out"
    assert np.diff(stamps) == pytest.approx(0.01, abs=1e-6), "by the autopilot's clock"
    assert 1000.001 <= stamps[0] < 1000.0015, "on this computer's, but for the shortest way"
    assert lines[150].split(",")[26] == str(1400 + 50), "with the motors' outputs"
    found = identify(table_of_csv([HEADER, *lines]))["roll"]
    assert found is not None
    assert found.delay_s == pytest.approx(0.12, abs=0.01)
    assert found.tau_s == pytest.approx(0.15, abs=0.01)
    assert not found.is_patterned


def test_a_system_of_second_order_is_said_to_leave_a_pattern(tmp_path: Path) -> None:
    times = np.arange(0, 36, 0.02)
    given = np.array([doublets(at_s) for at_s in times])
    got, speed, angle = np.empty(len(times)), 0.0, 0.0
    for at, stick in enumerate(given):
        got[at] = 40.0 * angle
        for _ in range(20):
            speed += 0.001 * (64.0 * (stick - angle) - 8.0 * speed)
            angle += 0.001 * speed
    found = fit(manoeuvres_in(times, given, got))
    assert found is not None
    assert found.r_squared > 0.9
    assert found.is_patterned
    noise = fit(manoeuvres_in(*flown(50, gain=40, tau_s=0.3, delay_s=0.1, stick=doublets)))
    assert noise is not None
    assert not noise.is_patterned
    rows = zip(times, got, given, strict=True)
    names = HEADER.rstrip().split(",")
    values = [{"time_s": at_s, "roll_deg": roll, "rc1": 1500 + 500 * stick} for at_s, roll, stick in rows]
    zeros = dict.fromkeys(("pitch_deg", "yaw_rate_deg_s", "down_m_s"), 0.0) | dict.fromkeys(("rc2", "rc3", "rc4"), 1500)
    lines = [",".join(str((zeros | value).get(name, "")) for name in names) + "\n" for value in values]
    (table := tmp_path / "flight.csv").write_text(HEADER + "".join(lines))
    said = CliRunner().invoke(app, ["identify", str(table)]).output
    assert "roll: what the model leaves is no noise" in said


def test_residuals_of_noise_have_no_pattern() -> None:
    times, given, got = flown(50, gain=40, tau_s=0.3, delay_s=0.1, stick=doublets)
    noisy = got + np.random.default_rng(3).normal(0, 2.0, len(got))
    found = fit(manoeuvres_in(times, given, noisy))
    assert found is not None
    assert abs(found.residual_correlation) < 0.2
    assert not found.is_patterned


def test_a_file_that_is_no_black_box_is_refused(tmp_path: Path) -> None:
    with pytest.raises(NoColumns, match="no column roll_deg"):
        table_of_csv(["time_s,x\n", "1,2\n"])
    with pytest.raises(NoColumns, match="line 2"):
        table_of_csv([HEADER, "one," * 20])
    (file := tmp_path / "flight.csv").write_text(HEADER)
    ran = CliRunner().invoke(app, ["identify", str(file)])
    assert ran.exit_code == 1
    assert "no attitude" in str(ran.exception)
