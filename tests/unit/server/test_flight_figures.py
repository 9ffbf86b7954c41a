"""The figures of a flight: every one against an answer that is known from how the flight was made."""

import json
import struct
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from worlds.flight_files import EVENTS_S, SPEED_M_S, write_flight

from server.flights.core.figures import FiguresReader, FlightFigures
from server.flights.core.tlog import Entry
from server.flights.store.files import FlightFiles
from wire.dialect import build, mavlink

BEGAN = datetime(2026, 5, 1, 12, tzinfo=UTC)
SECOND = 1_000_000
ALICE, BOB = {"id": 1, "name": "alice"}, {"id": 2, "name": "bob"}


def entry(at_s: float, message: Any, component_id: int = 1) -> Entry:
    return Entry(round(at_s * SECOND), build(message, system_id=1, component_id=component_id, sequence=0), 0)


def landed(at_s: float, state: int) -> Entry:
    return entry(at_s, mavlink.MAVLink_extended_sys_state_message(0, state))


def heartbeat(at_s: float, *, armed: bool, kind: int = mavlink.MAV_TYPE_QUADROTOR) -> Entry:
    return entry(at_s, mavlink.MAVLink_heartbeat_message(kind, 3, 128 if armed else 0, 5, 4, 3))


def status(at_s: float, volts: float, amperes: float = 0.0) -> Entry:
    about = (1, 1, 1, 300, round(volts * 1000), round(amperes * 100), 90, 0, 0, 0, 0, 0, 0)
    return entry(at_s, mavlink.MAVLink_sys_status_message(*about))


def battery(at_s: float, mah: int, number: int = 0) -> Entry:
    return entry(at_s, mavlink.MAVLink_battery_status_message(number, 0, 0, 0, [3700] * 10, 0, mah, -1, 90))


def position(at_s: float, height_m: float, north_m_s: float = 0.0, east_m_s: float = 0.0) -> Entry:
    at = 470_000_000, 80_000_000, 520_000, round(height_m * 1000)
    speeds = round(north_m_s * 100), round(east_m_s * 100), 0
    return entry(at_s, mavlink.MAVLink_global_position_int_message(0, *at, *speeds, 0))


def line(at_s: float, kind: str, **about: Any) -> dict[str, Any]:
    return {"at_us": round(at_s * SECOND), "kind": kind, **about}


def read(
    entries: list[tuple[Entry, float]] | list[Entry],
    index: list[dict[str, Any]] | None = None,
    *,
    began_s: float = 0,
    ended_s: float | None = 100,
) -> FlightFigures:
    ended_us = None if ended_s is None else round(ended_s * SECOND)
    reader = FiguresReader(index or [], round(began_s * SECOND), ended_us)
    for one in entries:
        if isinstance(one, Entry):
            reader.take(one, 0.0)
        else:
            reader.take(*one)
    return reader.figures(max_height_m=None)


def test_time_in_the_air_is_between_take_off_and_landing() -> None:
    found = read([landed(5, 1), landed(10, 3), landed(12, 2), landed(40, 4), landed(45, 1), landed(60, 2)])
    assert (found.air_s, found.landings) == (35 + 40, 1), "the second time ends with the flight, in the air"


def test_height_tells_where_the_autopilot_does_not_say_it() -> None:
    heights = [position(0, 0.1), position(10, 0.8), position(11, 3), position(30, 0.8), position(50, 0.2)]
    assert read(heights).air_s == 39
    # The landed state counts from its first word on, whatever the height.
    assert read([*heights[:3], landed(20, 1), position(25, 9)]).air_s == 9


@pytest.mark.parametrize("kind", [mavlink.MAV_TYPE_GROUND_ROVER, mavlink.MAV_TYPE_SURFACE_BOAT, 12])
def test_what_drives_or_dives_is_not_in_the_air_on_a_hill(kind: int) -> None:
    drive = [position(1, 0), heartbeat(2, armed=True, kind=kind), position(10, 30), landed(20, 2), position(90, 0)]
    early = [position(0, 30), *drive]
    for entries in (drive, early):
        found = read(entries)
        assert (found.air_s, found.landings, found.flown_s) == (None, 0, 100)
    copter = read([heartbeat(2, armed=True), position(10, 30), position(90, 0)])
    assert (copter.air_s, copter.landings, copter.flown_s) == (80, 1, 80)


def test_a_disarmed_drone_is_not_in_the_air() -> None:
    found = read([landed(10, 2), heartbeat(30, armed=False), landed(31, 2)])
    assert (found.air_s, found.landings) == (20, 1)


def test_nothing_heard_is_not_known() -> None:
    found = read([], [line(0, "armed", holder=ALICE)])
    assert (found.air_s, found.max_speed_m_s, found.battery_start_v, found.used_mah) == (None, None, None, None)
    assert (found.pilots[0].held_s, found.pilots[0].air_s) == (100, None)


def test_a_flight_that_begins_in_the_air_counts_from_its_beginning() -> None:
    assert read([landed(-20, 2), landed(30, 1)], began_s=0).air_s == 30


def test_frames_of_a_camera_and_after_the_end_do_not_count() -> None:
    other = entry(12, mavlink.MAVLink_extended_sys_state_message(0, 1), component_id=100)
    assert read([landed(10, 2), other, landed(101, 1), status(102, 9.9)]).air_s == 90


def test_greatest_speed_is_over_ground_and_of_the_flight() -> None:
    found = read([position(-5, 0, 50), position(5, 2, 3, 4), position(6, 2, 1, 1), position(7, 2, 300, 0)])
    assert found.max_speed_m_s == pytest.approx(5.0), "before arming, and 300 m/s, are no speeds of the flight"


def test_voltage_at_start_and_end() -> None:
    resting = [status(-9, 17.0), status(-3, 16.9), status(-0.2, 16.3)]
    flying = [status(0, 16.2), status(50, 15.1), status(99, 14.8), status(100.5, 16.0)]
    found = read([*resting, *flying])
    assert (found.battery_start_v, found.battery_end_v) == (16.9, 14.8), "as it rested, within 5 s of arming"
    assert read(flying).battery_start_v == 16.2


def test_voltage_at_the_start_of_a_drone_that_arms_as_soon_as_it_comes_online() -> None:
    flying = [status(0.1, 15.9), status(0.6, 16.4), status(1.1, 16.3), status(30, 15.1), status(31, 16.9)]
    assert read(flying).battery_start_v == 16.4, "the first report is of the motors' start"
    assert read([status(-0.3, 15.8), *flying]).battery_start_v == 16.4, "the tower hears of arming late"
    assert read([status(-20, 17.1), status(-8, 16.8), *flying]).battery_start_v == 16.8, "reports come seldom"
    assert read([status(30, 15.1), status(31, 16.9)]).battery_start_v == 15.1
    assert read([status(-8, 16.8)]).battery_start_v == 16.8


def test_used_charge_is_what_the_autopilot_counts_of_its_first_battery() -> None:
    counts = [battery(1, 120), battery(1, 0, number=1), battery(50, 800), battery(90, 1370), battery(91, 9, number=1)]
    assert read([*counts, status(2, 16, 30), status(5, 16, 30)]).used_mah == 1250


def test_used_charge_is_summed_up_without_a_counter() -> None:
    """10 A for 36 s are 100 mAh. A hole of 20 s is not known, and adds nothing."""
    first = [status(at, 16, 10) for at in range(37)]
    later = [status(at, 16, 10) for at in range(56, 93)]
    assert read(first).used_mah == pytest.approx(100)
    assert read([*first, *later]).used_mah == pytest.approx(200)
    assert read([battery(0, 900), battery(9, 3), *first]).used_mah == pytest.approx(100), "the counter was reset"


def test_each_pilot_has_their_own_part() -> None:
    index = [
        line(0, "armed", holder=ALICE),
        line(40, "control", event="given", holder=None),
        line(50, "control", event="taken", holder=BOB),
        line(50, "control", event="assisted", holder=BOB),
        line(80, "control", event="taken", holder=ALICE),
    ]
    entries = [(landed(10, 2), 0.0), (position(30, 5), 7.0), (position(45, 5), 1.0), (position(60, 5), 30.0)]
    found = read([*entries, (landed(90, 1), 0.0)], index)
    assert found.hand_overs == 2, "from alice to bob, and back; nobody in between is no person"
    alice, bob = found.pilots
    assert (alice.name, alice.held_s, alice.air_s, alice.distance_m, alice.landings) == ("alice", 60, 40, 7.0, 1)
    assert (bob.user_id, bob.held_s, bob.air_s, bob.distance_m, bob.landings) == (2, 30, 30, 30.0, 0)


def test_a_pilot_who_takes_the_controls_again_is_no_hand_over() -> None:
    index = [line(0, "armed", holder=ALICE), line(5, "control", holder=None), line(9, "control", holder=ALICE)]
    assert read([], index).hand_overs == 0


def test_what_happened_is_counted_from_the_index() -> None:
    hold = {"epoch": 5, "cause": "order"}
    index = [
        line(10, "hold", step="ordered", **hold),
        line(11, "hold", step="confirmed", **hold),
        line(30, "hold", step="sticks_centred", epoch=6, cause="loss"),
        line(40, "alert", state="opened", severity="critical", what="a"),
        line(41, "alert", state="acknowledged", severity="critical", what="a"),
        line(42, "alert", state="opened", severity="notice", what="b"),
        line(43, "alert", what="RttTooLong"),
        line(50, "link", rtt_ms=40.0, loss=0.0),
        line(55, "link", rtt_ms=80.0, loss=0.02),
        line(60, "link", rtt_ms=None, loss=None),
        line(70, "link_lost"),
        line(73.5, "link_back"),
        line(98, "link_lost"),
    ]
    found = read([], index)
    assert (found.holds, found.alerts, found.critical_alerts) == (2, 2, 1)
    assert (found.link_losses, found.link_lost_s) == (2, 3.5 + 2)
    assert (found.rtt_mean_ms, found.rtt_max_ms, found.loss_mean) == (60, 80, 0.01)


def test_a_whole_flight_of_two_minutes(tmp_path: Path) -> None:
    """Take-off at 7 s, a circle from 17 s on at 9 m/s; taken over at 40 s; disarmed at 118 s of 120 s."""
    people = {"drone": "kestrel", "pilot": "alice", "admin": "root"}
    file = write_flight(tmp_path, drone_id=7, began_at=BEGAN, lasts_s=120.0, **people)
    found = FlightFiles(tmp_path).figures(7, file)
    lasts_s = 120 - 2 - EVENTS_S["armed"]
    assert (found.ended_us - found.began_us) / SECOND == lasts_s
    # EXTENDED_SYS_STATE once a second: above 0.5 m, so from 8 s on, until the heartbeat at 118 s.
    assert found.air_s == pytest.approx(110, abs=1.01)
    assert found.distance_m == pytest.approx(SPEED_M_S * 101, rel=0.02)
    assert found.max_height_m == 40.0
    assert (found.holds, found.hand_overs, found.alerts, found.link_losses) == (1, 1, 1, 1)
    assert found.link_lost_s == pytest.approx(3)
    # 16.8 V, and half a millivolt less a second; 15 A.
    assert found.battery_start_v == pytest.approx(16.8)
    assert found.battery_end_v == pytest.approx(16.741, abs=0.002)
    assert found.used_mah == pytest.approx(15_000 * lasts_s / 3600, rel=0.02)
    alice, root = found.pilots
    assert (alice.held_s, root.held_s) == (pytest.approx(35), pytest.approx(78))
    assert alice.distance_m + root.distance_m == pytest.approx(found.distance_m)
    assert alice.distance_m == pytest.approx(SPEED_M_S * 23, rel=0.05)


def test_a_torn_file_has_the_figures_of_what_is_whole(tmp_path: Path) -> None:
    people = {"drone": "kestrel", "pilot": "alice", "admin": "root"}
    file = write_flight(tmp_path, drone_id=7, began_at=BEGAN, lasts_s=60.0, **people)
    files = FlightFiles(tmp_path)
    index = files.path(7, file, ".jsonl")
    lines = [one for one in index.read_text().splitlines() if json.loads(one)["kind"] not in ("disarmed", "end")]
    index.write_text("".join(one + "\n" for one in lines) + '{"kind": "li')
    tlog = files.path(7, file, ".tlog")
    begun_us = round((BEGAN.timestamp() - EVENTS_S["armed"]) * SECOND)
    content = tlog.read_bytes()
    tlog.write_bytes(content[: content.index(struct.pack(">Q", begun_us + 30 * SECOND)) + 5])
    found = files.figures(7, file)
    assert found.ended_us == pytest.approx(begun_us + 30 * SECOND, abs=200_000), "the last frame ends it"
    assert found.air_s == pytest.approx(22, abs=1.2)
