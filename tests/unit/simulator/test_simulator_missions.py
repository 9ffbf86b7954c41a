"""The mission protocol's server half, in fair weather and with named failures."""

from __future__ import annotations

import pytest

from simulator.dialect import mavlink
from simulator.failure_modes import Failure
from simulator.geodesy import e7

from_item = ("frame", "command", "autocontinue", "param1", "param2", "param3", "param4", "x", "y", "z")


def item(seq: int, command: int = 16, *, frame: int = 3, x: int = 473977420, y: int = 85455940, z: float = 10.0,
         kind: int = 0, params: tuple[float, ...] = (1, 2, 3, 0)):  # fmt: skip
    return mavlink.MAVLink_mission_item_int_message(1, 1, seq, frame, command, 0, 1, *params, x + seq, y, z, kind)


def mission(count: int = 5, kind: int = 0) -> list:
    command = {0: 16, 1: 5001, 2: 5100}[kind]
    return [item(seq, command, kind=kind) for seq in range(count)]


def upload(station, items: list, kind: int = 0, *, resend: bool = True) -> int | None:
    """The result in the acknowledgement, as a careful client gets it: it repeats what gets no answer."""
    for _ in range(3):
        station.send(mavlink.MAVLink_mission_count_message(1, 1, len(items), kind))
        for _ in range(200):
            for message in station.run(0.02):
                if message.get_type() in ("MISSION_REQUEST", "MISSION_REQUEST_INT"):
                    assert message.mission_type == kind
                    station.send(items[message.seq])
                elif message.get_type() == "MISSION_ACK":
                    return int(message.type)
        if not resend:
            return None
    return None


def download(station, kind: int = 0, compid: int = 190) -> list:
    def ask(question, answer: str):
        for _ in range(5):
            station.send(question, 255, compid)
            for message in station.run(0.1):
                if message.get_type() == answer:
                    return message
        raise AssertionError(f"no {answer}")

    count = ask(mavlink.MAVLink_mission_request_list_message(1, 1, kind), "MISSION_COUNT").count
    return [
        ask(mavlink.MAVLink_mission_request_int_message(1, 1, seq, kind), "MISSION_ITEM_INT") for seq in range(count)
    ]


def fields(message) -> tuple:
    return tuple(getattr(message, name) for name in from_item)


@pytest.mark.parametrize("kind", [0, 1, 2])
def test_what_goes_up_comes_down(ground, kind):
    station = ground().ready()
    items = mission(7, kind)
    assert upload(station, items, kind) == mavlink.MAV_MISSION_ACCEPTED
    back = download(station, kind)
    first = 1 if kind == 0 else 0  # slot 0 of a mission is home
    assert [fields(m) for m in back[first:]] == [fields(m) for m in items[first:]]
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
    [Failure.FIRST_MISSION_REQUEST_IGNORED, Failure.DROP_EVERY_TENTH, Failure.OLD_MISSION_REQUESTS],
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
    assert asked.count(1) >= 5  # asked again and again before giving up
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
    station.send(mavlink.MAVLink_mission_item_message(1, 1, 0, 3, 5001, 0, 1, 0, 0, 0, 0, 47.5, 8.5, 0, 1))
    station.run(0.1)
    assert download(station, 1)[0].x == 475_000_000
