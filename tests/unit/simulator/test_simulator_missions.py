"""The mission protocol's server half, without faults and with named ones."""

from __future__ import annotations

import math

import pytest
from mission_client import download, fields, item, mission, upload

from simulator.dialect import mavlink
from simulator.failure_modes import Failure
from simulator.geodesy import e7
from simulator.modes import Mode
from simulator.px4.flavour import PX4


def stored(message, kind: int = 0) -> tuple:
    """Returns the item of `mission` as an ArduPilot returns it."""
    frame, command, _, param1, *rest, z = fields(message)
    if kind == 0:
        return fields(message)
    return (0 if kind == 1 else frame, command, 0, param1 if kind == 1 else 0, *rest, 0 if kind == 1 else z)


@pytest.mark.parametrize("kind", [0, 1, 2])
def test_what_goes_up_comes_down(ground, kind):
    station = ground().ready()
    items = mission(7, kind)
    assert upload(station, items, kind) == mavlink.MAV_MISSION_ACCEPTED
    back = download(station, kind)
    first = 1 if kind == 0 else 0  # slot 0 of a mission is home
    assert [fields(m) for m in back[first:]] == [stored(m, kind) for m in items[first:]]
    assert [m.seq for m in back] == list(range(7))


def test_slot_zero_is_home_whatever_was_uploaded(ground):
    station = ground().ready()
    upload(station, mission())
    home = download(station)[0]
    place = station.flight.home
    assert (home.command, home.frame) == (16, 0)
    assert (home.x, home.y) == (e7(place.lat_deg), e7(place.lon_deg))
    assert home.z == pytest.approx(place.alt_amsl_m)


@pytest.mark.parametrize(
    "failure",
    [
        Failure.FIRST_MISSION_REQUEST_IGNORED,
        Failure.DROP_EVERY_TENTH,
        Failure.OLD_MISSION_REQUESTS,
        Failure.MISSION_WRONG_SEQUENCE,
        Failure.MISSION_REQUESTS_TWICE,
        Failure.MISSION_WRITTEN_IN_PLACE,
    ],
)
def test_a_careful_client_gets_through_failures(ground, failure):
    station = ground(failures={failure}).ready()
    items = mission(30)
    assert upload(station, items) == mavlink.MAV_MISSION_ACCEPTED
    assert [fields(m) for m in download(station)[1:]] == [fields(m) for m in items[1:]]


def test_a_missing_final_acknowledgement_leaves_the_new_mission_stored(ground):
    station = ground(failures={Failure.MISSION_FINAL_ACK_MISSING}).ready()
    assert upload(station, mission(4), resend=False) is None
    assert len(download(station)) == 4


def test_no_space(ground):
    station = ground(failures={Failure.MISSION_FULL}).ready()
    assert upload(station, mission(4)) == mavlink.MAV_MISSION_NO_SPACE
    assert upload(ground().ready(), [item(i) for i in range(725)]) == mavlink.MAV_MISSION_NO_SPACE


def test_an_upload_that_stops_half_way_times_out_and_leaves_the_old_mission(ground):
    station = ground().ready()
    upload(station, mission(4))
    old = [fields(m) for m in download(station)]
    station.send(mavlink.MAVLink_mission_count_message(1, 1, 9, 0))
    station.run(0.1)
    station.send(item(0))
    asked = [m.seq for m in station.run(9) if m.get_type() == "MISSION_REQUEST_INT"]
    assert asked.count(1) >= 5  # requested repeatedly before giving up
    assert station.of("MISSION_ACK")[-1].type == mavlink.MAV_MISSION_OPERATION_CANCELLED
    assert [fields(m) for m in download(station)] == old


@pytest.mark.parametrize(
    ("bad", "result"),
    [
        (item(2, 31999), mavlink.MAV_MISSION_UNSUPPORTED),
        (item(2, frame=9), mavlink.MAV_MISSION_UNSUPPORTED_FRAME),
        (item(2, x=900_000_100), mavlink.MAV_MISSION_INVALID_PARAM5_X),
        (item(2, y=1_800_000_001), mavlink.MAV_MISSION_INVALID_PARAM6_Y),
        (item(2, z=float("nan")), mavlink.MAV_MISSION_INVALID_PARAM7),
        (item(2, params=(0, float("inf"), 0, 0)), mavlink.MAV_MISSION_INVALID_PARAM2),
    ],
)
def test_a_bad_item_is_named_and_leaves_the_old_mission(ground, bad, result):
    station = ground().ready()
    upload(station, mission(4))
    old = [fields(m) for m in download(station)]
    items = mission(5)
    items[2] = bad
    assert upload(station, items) == result
    assert [fields(m) for m in download(station)] == old


def test_a_second_client_cannot_disturb_an_upload(ground):
    station = ground().ready()
    station.send(mavlink.MAVLink_mission_count_message(1, 1, 3, 0))
    station.run(0.1)
    station.send(mavlink.MAVLink_mission_count_message(1, 1, 8, 0), 255, 1)
    station.send(item(0), 255, 1)
    acks = [m for m in station.run(0.1) if m.get_type() == "MISSION_ACK"]
    assert [(a.type, a.target_component) for a in acks] == [
        (mavlink.MAV_MISSION_DENIED, 1),
        (mavlink.MAV_MISSION_ERROR, 1),
    ]
    for seq in range(3):
        station.send(item(seq))
    assert [m.type for m in station.run(0.1) if m.get_type() == "MISSION_ACK"] == [0]


def test_items_that_come_twice_or_too_early(ground):
    station = ground().ready()
    station.send(mavlink.MAVLink_mission_count_message(1, 1, 3, 0))
    for seq in (0, 0, 2):
        station.send(item(seq))
    assert [m.type for m in station.run(0.1) if m.get_type() == "MISSION_ACK"] == [mavlink.MAV_MISSION_INVALID_SEQUENCE]
    station.send(item(1))
    station.send(item(2))
    assert [m.type for m in station.run(0.1) if m.get_type() == "MISSION_ACK"] == [0]


def test_clearing(ground):
    station = ground().ready()
    for kind in (0, 1, 2):
        upload(station, mission(3, kind), kind)
    station.send(mavlink.MAVLink_mission_clear_all_message(1, 1, 1))
    station.run(0.1)
    assert [len(download(station, kind)) for kind in (0, 1, 2)] == [3, 0, 3]
    station.send(mavlink.MAVLink_mission_clear_all_message(1, 1, 255))
    station.run(0.1)
    assert [len(download(station, kind)) for kind in (0, 1, 2)] == [0, 0, 0]


def test_what_is_not_there_and_what_is_not_known(ground):
    station = ground().ready()
    upload(station, mission(3))
    station.send(mavlink.MAVLink_mission_request_int_message(1, 1, 3, 0))
    station.send(mavlink.MAVLink_mission_count_message(1, 1, 3, 7))
    assert [m.type for m in station.run(0.1) if m.get_type() == "MISSION_ACK"] == [
        mavlink.MAV_MISSION_INVALID_SEQUENCE,
        mavlink.MAV_MISSION_UNSUPPORTED,
    ]


def test_old_style_items_in_floats(ground):
    station = ground().ready()
    upload(station, mission(3))
    station.send(mavlink.MAVLink_mission_request_message(1, 1, 1, 0))
    old = next(m for m in station.run(0.1) if m.get_type() == "MISSION_ITEM")
    assert old.x == pytest.approx(47.3977421, abs=1e-5)
    station.send(mavlink.MAVLink_mission_count_message(1, 1, 1, 1))
    station.send(mavlink.MAVLink_mission_item_message(1, 1, 0, 3, 5003, 0, 1, 9, 0, 0, 0, 47.5, 8.5, 0, 1))
    station.run(0.1)
    assert download(station, 1)[0].x == 475_000_000


def flown_heights(station) -> list[float]:
    return [m.z for m in download(station)[1:]]


@pytest.mark.parametrize("kind", [0, 2])
@pytest.mark.parametrize(("failures", "mixed"), [(set(), False), ({Failure.MISSION_WRITTEN_IN_PLACE}, True)])
def test_a_broken_upload_leaves_the_old_plan_or_written_in_place_a_mix(ground, kind, failures, mixed):
    station = ground(failures=failures).ready()
    command = {0: 16, 2: 5100}[kind]
    assert upload(station, [item(i, command, kind=kind, z=10) for i in range(8)], kind) == 0
    station.send(mavlink.MAVLink_mission_count_message(1, 1, 6, kind))
    for seq in range(3):
        station.send(item(seq, command, kind=kind, z=50))
    station.run(9)  # long enough for the server to give up
    heights = [m.z for m in download(station, kind)][1:]
    assert heights == ([50, 50, 10, 10, 10] if mixed else [10] * 7)


def test_a_fence_is_exchanged_whole_even_where_plans_are_written_in_place(ground):
    station = ground(failures={Failure.MISSION_WRITTEN_IN_PLACE}).ready()
    upload(station, mission(5, 1), 1)
    station.send(mavlink.MAVLink_mission_count_message(1, 1, 3, 1))
    station.send(item(0, 5001, kind=1, params=(3, 0, 0, 0)))
    station.run(9)
    assert [m.param1 for m in download(station, 1)] == [5] * 5


def test_a_wrong_item_is_asked_for_once_and_not_kept(ground):
    station = ground(failures={Failure.MISSION_WRONG_SEQUENCE}).ready()
    assert upload(station, mission(6)) == 0
    asked = [m.seq for m in station.of("MISSION_REQUEST_INT")]
    assert asked == [0, 1, 2, 4, 3, 4, 5]


def test_requests_that_come_twice(ground):
    station = ground(failures={Failure.MISSION_REQUESTS_TWICE}).ready()
    assert upload(station, mission(3)) == 0
    station.run(0.1)
    assert [m.seq for m in station.of("MISSION_REQUEST_INT")] == [0, 0, 1, 1, 2, 2]
    # The second copy of the last item arrives after the upload: an error, as on a real one.
    assert [m.type for m in station.of("MISSION_ACK")] == [0, 0, mavlink.MAV_MISSION_ERROR]


def test_an_upload_that_is_said_to_be_done_after_half_of_it(ground):
    station = ground(failures={Failure.MISSION_ENDS_EARLY}).ready()
    assert upload(station, mission(9)) == mavlink.MAV_MISSION_ACCEPTED
    assert len(download(station)) == 5


@pytest.mark.parametrize(("in_place", "kept"), [(False, [10] * 3), (True, [50, 50, 10])])
def test_a_reboot_in_the_middle_of_an_upload_happens_once(ground, in_place, kept):
    failures = {Failure.REBOOT_DURING_UPLOAD} | ({Failure.MISSION_WRITTEN_IN_PLACE} if in_place else set())
    station = ground().ready()
    assert upload(station, [item(i) for i in range(4)]) == 0
    station.vehicle.failures |= failures
    new = [item(i, z=50) for i in range(6)]
    assert upload(station, new[:6], resend=False) is None
    assert station.texts().count("ArduCopter V4.6.2 (simulated)") == 2  # it has started twice
    station.ready()
    assert flown_heights(station) == kept
    assert upload(station, new) == 0
    assert flown_heights(station) == [50] * 5


def test_an_armed_vehicle_does_not_reboot_in_the_middle_of_an_upload(ground):
    station = ground(failures={Failure.REBOOT_DURING_UPLOAD}).take_off()
    assert upload(station, mission(6)) == 0
    assert station.flight.armed


def test_mission_current_tells_how_many_and_what_state(ground):
    station = ground().ready()

    def current() -> tuple[int, int, int, int]:
        station.command(mavlink.MAV_CMD_REQUEST_MESSAGE, 42)
        now = station.of("MISSION_CURRENT")[-1]
        return now.seq, now.total, now.mission_state, now.mission_mode

    assert current() == (0, 0, mavlink.MISSION_STATE_NO_MISSION, 2)
    takeoff = item(1, 22, x=0, y=0)
    assert upload(station, [item(0), takeoff, item(2, x=473980000), item(3)]) == 0
    assert current() == (1, 3, mavlink.MISSION_STATE_NOT_STARTED, 2)
    station.take_off()
    station.set_mode(Mode.AUTO)
    station.until(lambda: station.flight.plans.current == 2)
    assert current() == (2, 3, mavlink.MISSION_STATE_ACTIVE, 1)
    station.command(mavlink.MAV_CMD_DO_PAUSE_CONTINUE, 0)
    assert current() == (2, 3, mavlink.MISSION_STATE_PAUSED, 1)
    station.set_mode(Mode.LOITER)
    assert current() == (2, 3, mavlink.MISSION_STATE_PAUSED, 2)
    station.set_mode(Mode.AUTO)
    station.until(lambda: "Mission complete" in station.texts(), 120)
    assert current()[2] == mavlink.MISSION_STATE_COMPLETE


def test_px4_keeps_no_home_slot_and_hands_back_what_is_not_a_number(ground):
    station = ground(flavour=PX4).ready()
    items = [item(i, params=(0, 0, 0, float("nan"))) for i in range(3)]
    assert upload(station, items) == 0
    back = download(station)
    assert [m.x for m in back] == [m.x for m in items]
    assert all(math.isnan(m.param4) for m in back)
    station.command(mavlink.MAV_CMD_REQUEST_MESSAGE, 42)
    now = station.of("MISSION_CURRENT")[-1]
    assert (now.seq, now.total, now.mission_state) == (0, 3, mavlink.MISSION_STATE_NOT_STARTED)
