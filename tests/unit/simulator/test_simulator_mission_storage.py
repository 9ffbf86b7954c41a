"""Stored plans: packing, limits, refusals and the behaviour of a real ArduCopter."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
from mission_client import download, fields, item, mission, upload

from simulator.ardupilot import arducopter
from simulator.dialect import mavlink
from simulator.failure_modes import Failure
from simulator.mission_plan import Item, PlanKind
from simulator.mission_storage import ADDED, PLACED, accept_item
from simulator.px4.flavour import PX4


@pytest.mark.parametrize(("kind", "most"), [(1, 64), (2, 32)])
def test_px4_has_limits_of_its_own(ground, kind, most):
    station = ground(flavour=PX4).ready()
    assert upload(station, mission(most, kind), kind) == mavlink.MAV_MISSION_ACCEPTED
    assert upload(station, mission(most + 1, kind), kind) == mavlink.MAV_MISSION_NO_SPACE
    assert len(download(station, kind)) == most


@pytest.mark.parametrize(
    ("sent", "back"),
    [
        (item(1, 16, frame=6, z=12.349, params=(1.7, 2, 3, 4)), (3, 16, 1, 1.0, 0, 0, 0, 12.34)),
        (item(1, 16, frame=11, z=-3.5, params=(0, 0, 0, 0)), (10, 16, 1, 0, 0, 0, 0, -3.5)),
        (item(1, 18, z=20, params=(3, 1, -300, 1)), (3, 18, 1, 3, 0, -300, 1, 20)),
        (item(1, 18, z=20, params=(3, 1, 307, 0)), (3, 18, 1, 3, 0, 300, 0, 20)),
        (item(1, 19, z=20, params=(8, 5, 40, 0)), (3, 19, 1, 8, 0, 1, 0, 20)),
        (item(1, 21, frame=0, z=500, params=(0, 0, 0, 90)), (0, 21, 1, 0, 0, 0, 1, 500)),
        (item(1, 178, params=(1, 4.5, -1, 7)), (0, 178, 1, 1, 4.5, -1, 0, 0)),
        (item(1, 177, params=(1, -1, 9, 9)), (0, 177, 1, 1, -1, 0, 0, 0)),
    ],
)
def test_packed_items_come_back_as_ardupilot_keeps_them(ground, sent, back):
    station = ground().ready()
    assert upload(station, [item(0), sent]) == 0
    got = download(station)[1]
    names = ("frame", "command", "autocontinue", "param1", "param2", "param3", "param4", "z")
    assert tuple(getattr(got, name) for name in names) == pytest.approx(back, abs=1e-5)
    has_place = back[1] not in (177, 178)
    assert (got.x, got.y) == ((sent.x, sent.y) if has_place else (0, 0))


def test_packing_what_is_packed_changes_heights_by_a_centimetre_at_most_and_nothing_else(ground):
    """A plan that is read and written back differs only by single precision and truncation."""
    station = ground(flavour=arducopter("4.7")).ready()
    items = [item(0), *(item(i + 1, command, z=0.29 * i) for i, command in enumerate(sorted(PLACED)))]
    assert upload(station, items) == 0
    once = [fields(m) for m in download(station)]
    again = [
        mavlink.MAVLink_mission_item_int_message(1, 1, seq, frame, command, 0, *rest, 0)
        for seq, (frame, command, *rest) in enumerate(once)
    ]
    assert upload(station, again) == 0
    back = [fields(m) for m in download(station)]
    assert [row[:-1] for row in back] == [row[:-1] for row in once]
    differences = [abs(row[-1] - before[-1]) for row, before in zip(back, once, strict=True)]
    assert 0.005 < max(differences) < 0.0101


@pytest.mark.parametrize(("kind", "z"), [(1, 0), (2, 10)])
def test_packed_fences_and_rally_points(ground, kind, z):
    station = ground().ready()
    command = {1: 5003, 2: 5100}[kind]
    assert upload(station, [item(0, command, z=10.9, kind=kind, params=(25.5, 1, 1, 1))], kind) == 0
    got = download(station, kind)[0]
    assert (got.param1, got.param2, got.z, got.autocontinue) == (25.5 if kind == 1 else 0, 0, z, 0)
    assert (got.x, got.y) == (473977420, 85455940)


def test_what_is_stored_as_it_came_comes_back_in_every_bit(ground):
    station = ground(failures={Failure.MISSION_VERBATIM}).ready()
    sent = item(1, 19, frame=6, z=12.3125, params=(1.5, 2, 30, 4))
    assert upload(station, [item(0), sent]) == 0
    assert fields(download(station)[1]) == fields(sent)


@pytest.mark.parametrize(
    ("items", "result"),
    [
        (mission(3, 1), 0),
        ([*mission(3, 1), *(item(3 + n, 5002, kind=1, params=(3, 0, 0, 0)) for n in range(3))], 0),
        (mission(3, 1)[:2], mavlink.MAV_MISSION_ERROR),
        ([*mission(3, 1)[:2], item(2, 5002, kind=1, params=(3, 0, 0, 0))], mavlink.MAV_MISSION_ERROR),
        ([item(0, 5003, kind=1, params=(0, 0, 0, 0))], mavlink.MAV_MISSION_ERROR),
        ([item(0, 5000, kind=1), item(1, 5000, kind=1)], mavlink.MAV_MISSION_ERROR),
        ([item(0, 5001, kind=1, params=(256, 0, 0, 0))], mavlink.MAV_MISSION_INVALID_PARAM1),
    ],
)
def test_a_fence_that_is_not_whole_is_refused_at_its_end_and_the_old_one_stays(ground, items, result):
    station = ground().ready()
    assert upload(station, mission(5, 1), 1) == 0
    assert upload(station, items, 1) == result
    station.run(1.0)
    assert len(download(station, 1)) == (5 if result else len(items))


def test_a_fence_of_one_circle_after_a_polygon_is_dropped_as_on_a_real_one(ground):
    """ArduCopter mistakes it for an old ground station that clears the fence; the second time it stays."""
    station = ground().ready()
    assert upload(station, mission(5, 1), 1) == 0
    station.run(1.0)
    for stays in (0, 1):
        assert upload(station, [item(0, 5003, kind=1, params=(30, 0, 0, 0))], 1) == 0
        station.run(1.0)
        assert len(download(station, 1)) == stays


@pytest.mark.parametrize("target", [0, 3, -1])
def test_a_jump_to_home_or_past_the_end_is_refused(ground, target):
    station = ground().ready()
    assert upload(station, [item(0), item(1), item(2, 177, params=(target, 1, 0, 0))]) == mavlink.MAV_MISSION_ERROR


MEASURED = json.loads((Path(__file__).parent.parent / "wire" / "golden" / "kept_by_arducopter.json").read_text())
KINDS = {"mission": PlanKind.MISSION, "fence": PlanKind.FENCE, "rally": PlanKind.RALLY}


def item_of(row: list, *, jump_by: int) -> Item:
    """Returns the item. Jumps count home here."""
    command, frame, params, x, y, z, autocontinue = row
    first, *rest = (math.nan if value is None else value for value in params)
    return Item(command, frame, (first + jump_by * (command == 177), *rest), x, y, z, autocontinue)


def test_each_item_is_stored_as_a_real_arducopter_did_it():
    for kind, sent, back in MEASURED["kept"]:
        assert accept_item(item_of(sent, jump_by=1), KINDS[kind]) == item_of(back, jump_by=1), sent
    for kind, sent, code in MEASURED["refused"]:
        if sent[0] != 177 and code != "MAV_MISSION_ERROR":
            result = accept_item(item_of(sent, jump_by=1), KINDS[kind])
            assert result == getattr(mavlink, code), sent


def test_a_release_refuses_what_later_ones_brought(ground):
    newest, unsupported = (4, 7), int(mavlink.MAV_MISSION_UNSUPPORTED)
    for command, since in ADDED.items():
        for release in ((4, 5), (4, 6), newest):
            stored = accept_item(Item(command), PlanKind.MISSION, release)
            assert (stored == unsupported) is (release < since), (command, release)
    look_at = [item(0), item(1, 195, z=20, params=(0, 0, 0, 0))]
    for release, result in (("4.5", unsupported), ("4.6", unsupported), ("4.7", 0)):
        station = ground(flavour=arducopter(release)).ready()
        assert upload(station, look_at) == result, release
        station.command(mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
        version = station.of("AUTOPILOT_VERSION")[-1].flight_sw_version
        assert f"{version >> 24}.{version >> 16 & 0xFF}" == release


def test_4_5_refuses_an_open_heading_of_a_loiter_and_tells_no_mode_of_the_legacy_gimbal():
    open_heading = Item(17, 3, (0.0, 0.0, 0.0, math.nan), 1, 2, 20.0)
    assert accept_item(open_heading, PlanKind.MISSION, (4, 5)) == mavlink.MAV_MISSION_INVALID_PARAM4
    assert isinstance(accept_item(open_heading, PlanKind.MISSION, (4, 6)), Item)
    gimbal = Item(205, 2, (-45.0, 0.0, 0.0, 0.0), 0, 0, 2.0)
    modes = [accept_item(gimbal, PlanKind.MISSION, release).z for release in ((4, 5), (4, 6))]
    assert modes == [0.0, 2.0]


def test_px4_stores_places_in_frame_6_and_takes_each_command_in_one_frame_only(ground):
    station = ground(flavour=PX4).ready()
    sent = [
        item(0, 16, params=(1.5, 2, 3, -90)),
        item(1, 1000, frame=2, x=-1, y=0, z=0, params=(-45, math.nan, math.nan, 0)),
    ]
    assert upload(station, sent) == 0
    first, second = download(station)
    assert fields(first)[:3] == (6, 16, 1)
    assert (first.param1, first.param2, first.param3) == (1.5, 2, 0)
    assert first.param4 == pytest.approx(270, abs=1e-3)
    assert (second.frame, second.param1) == (2, -45) and math.isnan(second.param2)
    assert upload(station, [item(0, 16, params=(0, 0, 0, 1e30))]) == 0  # at once, however often it loops
    assert upload(station, [item(0, 20)]) == mavlink.MAV_MISSION_UNSUPPORTED
    assert upload(station, [item(0, 16, frame=2)]) == mavlink.MAV_MISSION_UNSUPPORTED
    assert upload(station, [item(0, 16, frame=10)]) == mavlink.MAV_MISSION_UNSUPPORTED_FRAME
    assert upload(station, mission(3, 1), 1) == 0
    assert {(m.frame, m.param1, m.z, m.autocontinue) for m in download(station, 1)} == {(5, 3, 10, 0)}
