"""The mission protocol's server half, in fair weather and with named failures."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from simulator.dialect import mavlink
from simulator.failure_modes import Failure
from simulator.geodesy import e7
from simulator.mission_plan import Item, PlanKind
from simulator.mission_storage import PLACED, take
from simulator.modes import Mode
from simulator.px4.flavour import PX4

from_item = ("frame", "command", "autocontinue", "param1", "param2", "param3", "param4", "x", "y", "z")


def item(seq: int, command: int = 16, *, frame: int = 3, x: int = 473977420, y: int = 85455940, z: float = 10.0,
         kind: int = 0, params: tuple[float, ...] = (1, 0, 0, 0)):  # fmt: skip
    return mavlink.MAVLink_mission_item_int_message(1, 1, seq, frame, command, 0, 1, *params, x + seq, y, z, kind)


def mission(count: int = 5, kind: int = 0) -> list:
    command = {0: 16, 1: 5001, 2: 5100}[kind]
    params = (count, 0, 0, 0) if kind == 1 else (1, 0, 0, 0)
    return [item(seq, command, kind=kind, params=params) for seq in range(count)]


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


def stored(message, kind: int = 0) -> tuple:
    """As an ArduPilot gives back an item of `mission`."""
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
    # The second copy of the last item comes when there is no upload any more: an error, as on a real one.
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
    """A plan that is read and put back is the same but for that: single precision, and cut instead of rounded."""
    station = ground().ready()
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
    """Taken for an old ground station that clears the fence; the second time it stays."""
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
    """Jumps count home here."""
    command, frame, params, x, y, z, autocontinue = row
    first, *rest = (math.nan if value is None else value for value in params)
    return Item(command, frame, (first + jump_by * (command == 177), *rest), x, y, z, autocontinue)


def test_each_item_is_stored_as_a_real_arducopter_did_it():
    for kind, sent, back in MEASURED["kept"]:
        assert take(item_of(sent, jump_by=1), KINDS[kind]) == item_of(back, jump_by=1), sent
    for kind, sent, code in MEASURED["refused"]:
        if sent[0] != 177 and code != "MAV_MISSION_ERROR":
            result = take(item_of(sent, jump_by=1), KINDS[kind])
            assert result == getattr(mavlink, code), sent


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
    assert upload(station, [item(0, 16, params=(0, 0, 0, 1e30))]) == 0  # at once, however often that goes round
    assert upload(station, [item(0, 20)]) == mavlink.MAV_MISSION_UNSUPPORTED
    assert upload(station, [item(0, 16, frame=2)]) == mavlink.MAV_MISSION_UNSUPPORTED
    assert upload(station, [item(0, 16, frame=10)]) == mavlink.MAV_MISSION_UNSUPPORTED_FRAME
    assert upload(station, mission(3, 1), 1) == 0
    assert {(m.frame, m.param1, m.z, m.autocontinue) for m in download(station, 1)} == {(5, 3, 10, 0)}
