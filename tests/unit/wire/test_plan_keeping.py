"""What an autopilot keeps of a plan: compared with what a real one returned, and with every possible fault."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from worlds.tiers import examples

from wire.autopilots.ardupilot_plans import ArduPilot
from wire.autopilots.px4_plans import Px4
from wire.dialect import mavlink
from wire.plan_fields import Effect, KeptFields, fields_of, item_of
from wire.plan_keeping import (
    COUNT,
    as_kept,
    change_words,
    changes_ahead,
    differences,
    keeping_of,
    same_plan,
    to_send,
)
from wire.plans import Plan, PlanItem, PlanKind

MISSION, FENCE, RALLY = PlanKind.MISSION, PlanKind.FENCE, PlanKind.RALLY
MEASURED: Final = Path(__file__).parent / "golden" / "kept_by_arducopter.json"


class Measured(msgspec.Struct):
    of: str
    kept: list[tuple[PlanKind, PlanItem, PlanItem]]
    refused: list[tuple[PlanKind, PlanItem, str]]


@pytest.fixture(scope="module")
def measured() -> Measured:
    return msgspec.json.decode(MEASURED.read_bytes(), type=Measured)


def test_the_table_says_of_each_item_what_a_real_arducopter_gave_back(measured: Measured) -> None:
    assert len(measured.kept) > 300
    for kind, sent, back in measured.kept:
        kept = ArduPilot().kept(kind, sent).fields
        assert item_of({name: one.value for name, one in kept.items()}) == back, sent
        going = to_send(ArduPilot(), kind, [sent])
        if going == (sent,):
            assert differences(ArduPilot(), kind, [sent], [back], exactly=True) == [], sent


@given(st.integers(-50_000, 1_000_000))
def test_a_height_of_whole_centimetres_is_what_comes_back_of_an_ardupilot(centimetres: int) -> None:
    """One height in four is truncated to the centimetre below if sent unchanged."""
    item = but(WAYPOINT, z=centimetres / 100)
    (back,) = as_kept(ArduPilot(), MISSION, [item])
    assert round(back.z, 2) == round(item.z, 2)
    (going,) = to_send(ArduPilot(), MISSION, [item])
    assert abs(going.z - item.z) < 0.005
    assert item_of({name: one.value for name, one in ArduPilot().kept(MISSION, going).fields.items()}).z == back.z
    assert as_kept(ArduPilot(), MISSION, [back]) == (back,)
    assert to_send(Px4(), MISSION, [item]) == (item,)


def test_a_height_between_two_centimetres_goes_to_the_nearer_one() -> None:
    assert round(as_kept(ArduPilot(), MISSION, [but(WAYPOINT, z=20.126)])[0].z, 2) == 20.13
    assert round(as_kept(ArduPilot(), MISSION, [but(WAYPOINT, z=-20.126)])[0].z, 2) == -20.13


def test_what_a_real_arducopter_refused_is_told_beforehand(measured: Measured) -> None:
    reported = {code: 0 for _, _, code in measured.refused}
    for kind, item, code in measured.refused:
        is_known = any(one.effect is Effect.REFUSED for one in changes_ahead(ArduPilot(), kind, [item]))
        jumps_nowhere = item.command == 177  # which depends on the plan around it
        unknown = code in ("MAV_MISSION_UNSUPPORTED", "MAV_MISSION_INVALID") and kind is MISSION
        assert is_known or jumps_nowhere or unknown, (item, code)
        reported[code] += 1
    assert min(reported.values()) > 0 and len(reported) > 6


# A plan returned with any other difference is another plan.

number = st.floats(width=32, allow_nan=False, allow_infinity=False)
usual = st.one_of(st.integers(0, 250).map(float), st.floats(-120, 250, width=32), st.none())
USED: Final[dict[int, tuple[int, ...]]] = {
    16: (0,),
    19: (0,),
    93: (0, 1),
    112: (0,),
    115: (0, 1),
    177: (0, 1),
    178: (0, 1),
    183: (0, 1),
    203: (0,),
    206: (0,),
    211: (0, 1),
    1000: (0, 1),
    2000: (1, 2),
}
"""Maps a command to some of the parameters that affect the flight."""
PLACED: Final = (16, 17, 19, 21, 22, 31, 84, 85, 195)
OF_PX4: Final = frozenset({*PLACED, 20, 93, 112, 177, 178, 203, 206, 211, 1000, 2000})
BYTES: Final = st.integers(1, 120).map(float)


@st.composite
def plans(draw: st.DrawFn, keeping: KeptFields) -> Plan:
    """Generates plans that the autopilot accepts, with distinct items."""
    commands = sorted({*USED, *PLACED, 20} if isinstance(keeping, ArduPilot) else OF_PX4)
    items = []
    for at in range(draw(st.integers(2, 8))):
        command = draw(st.sampled_from(commands))
        frame = draw(st.sampled_from([0, 3, 5, 6])) if command in PLACED else 2
        params: list[float | None] = [0.0, 0.0, 0.0, 0.0]
        for used in USED.get(command, ()):
            params[used] = draw(BYTES)
        if command == 177:
            params[0] = float(draw(st.integers(0, 7)))
        place = (
            (473_977_000 + 100 * at, draw(st.integers(-1_800_000_000, 1_800_000_000))) if command in PLACED else (0, 0)
        )
        z = draw(st.integers(-50_000, 500_000)) / 100 if command in PLACED else 0.0
        items.append(PlanItem(command, frame, tuple(params), *place, z))  # type: ignore[arg-type]
    return tuple(items)


COMMANDS: Final = [*range(16, 32), *range(177, 224), 1000, 2000, 5000, 5001, 5003, 5100]
KEEPINGS: Final = [ArduPilot(), Px4()]


@pytest.mark.parametrize("keeping", KEEPINGS, ids=lambda one: one.name)
@settings(max_examples=examples(200, long=1200), deadline=None)
@given(data=st.data())
def test_another_number_in_any_field_of_what_came_back_is_caught(keeping: KeptFields, data: st.DataObject) -> None:
    plan = data.draw(plans(keeping))
    assert all(one.effect is not Effect.REFUSED for one in changes_ahead(keeping, MISSION, plan))
    back = list(as_kept(keeping, MISSION, plan))
    assert same_plan(keeping, MISSION, plan, back)
    at = data.draw(st.integers(0, len(back) - 1))
    name = data.draw(st.sampled_from(["command", "frame", "x", "y", "z", "autocontinue", 0, 1, 2, 3]))
    if isinstance(name, int):
        params = list(back[at].params)
        params[name] = data.draw(st.one_of(number, st.none(), st.just((params[name] or 0.0) + 1.0)))
        is_heading = name == 3 and back[at].params[3] is not None
        other = msgspec.structs.replace(back[at], params=tuple(params))
        near = is_heading and params[3] is not None and abs(params[3] - (back[at].params[3] or 0.0)) % 360.0 < 2e-3
        if other == back[at] or near or (is_heading and params[3] is not None and abs(params[3]) % 360.0 > 359.9):
            return
    elif name == "z":
        off = data.draw(st.floats(0.015625, 5000, width=32)) * data.draw(st.sampled_from([-1, 1]))
        other = msgspec.structs.replace(back[at], z=back[at].z + off)
    else:
        most = {"x": 2**31 - 1, "y": 2**31 - 1, "command": 0xFFFF}.get(name, 0xFF)
        value = data.draw(st.integers(0, most).filter(lambda one: one != getattr(back[at], name)))
        other = msgspec.structs.replace(back[at], **{name: value})
    back[at] = other
    assert not same_plan(keeping, MISSION, plan, back)


@pytest.mark.parametrize("keeping", KEEPINGS, ids=lambda one: one.name)
@settings(max_examples=examples(200, long=1200), deadline=None)
@given(data=st.data())
def test_another_plan_that_the_autopilot_would_keep_is_caught(keeping: KeptFields, data: st.DataObject) -> None:
    """Changes frame, height, place, parameter, jump target, order or count: the stored plan is another one."""
    plan = list(data.draw(plans(keeping)))
    other, at = list(plan), data.draw(st.integers(0, len(plan) - 1))
    item = plan[at]
    ways = ["order", "count", "more"]
    ways += ["frame", "height", "place"] if item.command in PLACED else []
    ways += ["parameter"] if item.command in USED else []
    way = data.draw(st.sampled_from(ways))
    if way == "order":
        swapped = (at + 1) % len(plan)
        other[at], other[swapped] = other[swapped], other[at]
        if other == plan:
            return
    elif way == "count":
        del other[at]
    elif way == "more":
        other.append(item)
    elif way == "frame":
        absolute = item.frame in (0, 5)
        other[at] = msgspec.structs.replace(item, frame=data.draw(st.sampled_from([3, 6] if absolute else [0, 5])))
    elif way == "height":
        other[at] = msgspec.structs.replace(item, z=item.z + data.draw(st.sampled_from([-1, 1])) * 0.05)
    elif way == "place":
        off = data.draw(st.integers(1, 1000))
        other[at] = msgspec.structs.replace(item, **{data.draw(st.sampled_from(["x"])): item.x + off})
    else:
        params = list(item.params)
        params[data.draw(st.sampled_from(USED[item.command]))] = data.draw(BYTES)
        other[at] = msgspec.structs.replace(item, params=tuple(params))
        if other == plan:
            return
    assert not same_plan(keeping, MISSION, plan, as_kept(keeping, MISSION, other))


@settings(max_examples=examples(166, long=1000), deadline=None)
@given(
    kind=st.sampled_from(list(PlanKind)),
    command=st.one_of(st.sampled_from(COMMANDS), st.integers(0, 0xFFFF)),
    frame=st.sampled_from([0, 2, 3, 5, 6, 10, 11, 1, 8]),
    params=st.tuples(usual, usual, usual, usual),
    x=st.integers(-900_000_000, 900_000_000),
    z=st.floats(-50_000, 50_000, width=32),
    autocontinue=st.integers(0, 3),
)  # fmt: skip
def test_of_any_item_it_is_known_what_becomes_of_it(
    kind: PlanKind, command: int, frame: int, params: Any, x: int, z: float, autocontinue: int
) -> None:
    item = PlanItem(command, frame, params, x, x // 2, z, autocontinue)
    for keeping in KEEPINGS:
        (back,) = as_kept(keeping, kind, [item])
        assert same_plan(keeping, kind, [item], [back], exactly=True)
        changed = {one.field: one for one in changes_ahead(keeping, kind, [item])}
        sent, got = fields_of(item), fields_of(back)
        reported = {name for name, one in changed.items() if one.effect < Effect.REFUSED and one.sent != one.kept}
        unequal = {name for name in sent if sent[name] != got[name]}
        assert reported == unequal, keeping.name
        assert all(change_words(keeping, one) for one in changed.values())


# The reported changes, in particular.

WAYPOINT = PlanItem(16, 3, (0.0, 0.0, 0.0, None), 473977419, 85455939, 20.0)


def effects(keeping: KeptFields, item: PlanItem, kind: PlanKind = MISSION) -> dict[str, str]:
    return {one.field: one.effect.name for one in changes_ahead(keeping, kind, [item])}


def but(item: PlanItem, **fields: Any) -> PlanItem:
    return msgspec.structs.replace(item, **fields)


@pytest.mark.parametrize(
    ("item", "kind", "reported"),
    [
        (WAYPOINT, MISSION, {"param4": "QUIET"}),
        (but(WAYPOINT, params=(2.5, 0.0, 0.0, 0.0)), MISSION, {"param1": "FLIGHT"}),
        (but(WAYPOINT, params=(2.0, 0.0, 0.0, 90.0)), MISSION, {"param4": "FLIGHT"}),
        (but(WAYPOINT, params=(70_000.0, 0.0, 0.0, 0.0)), MISSION, {"param1": "REFUSED"}),
        (but(WAYPOINT, params=(None, 0.0, 0.0, 0.0)), MISSION, {"param1": "REFUSED"}),
        (but(WAYPOINT, params=(0.0,) * 4, frame=6, z=10.126), MISSION, {"frame": "QUIET", "z": "QUIET"}),
        (but(WAYPOINT, params=(0.0,) * 4, frame=2), MISSION, {"frame": "FLIGHT"}),
        (but(WAYPOINT, params=(0.0,) * 4, frame=1), MISSION, {"frame": "REFUSED"}),
        (but(WAYPOINT, params=(0.0,) * 4, autocontinue=0), MISSION, {"autocontinue": "FLIGHT"}),
        (PlanItem(20, 2), MISSION, {"frame": "QUIET"}),
        (PlanItem(205, 2), MISSION, {"frame": "QUIET", "z": "FLIGHT"}),
        (PlanItem(1000, 0, (0.0, 0.0, None, 0.0)), MISSION, {"param3": "REFUSED"}),
        (PlanItem(5001, 3, (4.0, 0.0, 0.0, 0.0), 1, 2, 30.0, 0), FENCE, {"frame": "QUIET", "z": "QUIET"}),
        (PlanItem(5003, 0, (50.5, 1.0, 0.0, 0.0), 1, 2, autocontinue=0), FENCE, {"param2": "FLIGHT"}),
        (PlanItem(5003, 0, (0.0, 0.0, 0.0, 0.0), 1, 2, autocontinue=0), FENCE, {"param1": "REFUSED"}),
        (PlanItem(5100, 3, x=1, y=2, z=20.9, autocontinue=0), RALLY, {"z": "FLIGHT"}),
        (PlanItem(31000, 5, (1.5, 2.5, 3.5, 4.5), 1, 2, 3.0), MISSION, {"frame": "QUIET"}),
    ],
)  # fmt: skip
def test_what_arducopter_does_not_keep(item: PlanItem, kind: PlanKind, reported: dict[str, str]) -> None:
    assert effects(ArduPilot(), item, kind) == reported


@pytest.mark.parametrize(
    ("item", "kind", "reported"),
    [
        (WAYPOINT, MISSION, {"frame": "QUIET"}),
        (but(WAYPOINT, frame=6, params=(2.5, 3.0, 0.0, -90.0)), MISSION, {"param4": "QUIET"}),
        (but(WAYPOINT, frame=6, params=(0.0, 0.0, 0.0, 1e30)), MISSION, {"param4": "REFUSED"}),
        (but(WAYPOINT, frame=10), MISSION, {"frame": "REFUSED"}),
        (PlanItem(20, 3), MISSION, {"frame": "REFUSED"}),
        (PlanItem(20, 2), MISSION, {}),
        (PlanItem(1000, 2, (None, 0.0, None, None)), MISSION, {}),
        (PlanItem(177, 2, (1.0, -1.0, 0.0, 0.0)), MISSION, {"param2": "REFUSED"}),
        (PlanItem(21, 6, (30.0, 0.0, 0.0, 0.0)), MISSION, {"param1": "FLIGHT"}),
        (PlanItem(5001, 3, (4.0, 0.0, 0.0, 0.0)), FENCE, {"frame": "QUIET", "autocontinue": "QUIET"}),
        (PlanItem(5100, 3, z=20.9), RALLY, {"frame": "QUIET"}),
    ],
)
def test_what_px4_does_not_keep(item: PlanItem, kind: PlanKind, reported: dict[str, str]) -> None:
    assert effects(Px4(), item, kind) == reported


def test_a_plane_packs_a_waypoint_otherwise_and_knows_no_splines() -> None:
    plane = keeping_of(mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, mavlink.MAV_TYPE_FIXED_WING)
    assert effects(plane, but(WAYPOINT, params=(3.0, 40.0, 300.0, 0.0))) == {"param1": "FLIGHT", "param3": "FLIGHT"}
    assert effects(plane, but(WAYPOINT, command=82, params=(0.0,) * 4)) == {"command": "REFUSED"}


VERSIONS: Final = {"4.5": 0x040507FF, "4.6": 0x040602FF, "4.7-dev": 0x04070000, "4.7": 0x040700FF, "unknown": 0}


@pytest.mark.parametrize(
    ("version", "lacking"),
    [
        ("4.5", {188, 195, 197, 534}),
        ("4.6", {195, 197}),
        ("4.7-dev", {195, 197}),
        ("4.7", set()),
        ("unknown", set()),
    ],
)
def test_a_release_of_ardupilot_lacks_commands_of_later_ones(version: str, lacking: set[int]) -> None:
    keeping = keeping_of(mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, mavlink.MAV_TYPE_QUADROTOR, VERSIONS[version])
    assert keeping.lacks == lacking
    for command in (16, 188, 195, 197, 201, 534):
        refused = effects(keeping, PlanItem(command, 3)).get("command") == "REFUSED"
        assert refused is (command in lacking), command


def test_4_5_takes_no_open_heading_of_a_loiter_and_returns_no_mode_of_the_legacy_gimbal() -> None:
    old, new = ArduPilot(release=(4, 5)), ArduPilot(release=(4, 6))
    loiter = PlanItem(17, 3, (0.0, 0.0, 0.0, None), 1, 2, 20.0)
    assert (effects(old, loiter), effects(new, loiter)) == ({"param4": "REFUSED"}, {"param4": "QUIET"})
    gimbal = PlanItem(205, 0, (-45.0, 0.0, 0.0, 0.0), z=2.0)
    assert (effects(old, gimbal), effects(new, gimbal)) == ({"z": "QUIET"}, {})
    (back,) = as_kept(old, MISSION, [gimbal])
    assert back.z == 0.0
    assert not same_plan(new, MISSION, [gimbal], [back])


def test_of_an_autopilot_that_is_not_known_every_bit_must_come_back() -> None:
    keeping = keeping_of(mavlink.MAV_AUTOPILOT_GENERIC, mavlink.MAV_TYPE_QUADROTOR)
    assert changes_ahead(keeping, MISSION, [WAYPOINT]) == []
    assert same_plan(keeping, MISSION, [WAYPOINT], [WAYPOINT])
    for other in (but(WAYPOINT, frame=6), but(WAYPOINT, z=20.01), but(WAYPOINT, params=(0.0,) * 4)):
        assert not same_plan(keeping, MISSION, [WAYPOINT], [other])


def test_a_height_is_off_by_a_step_only_where_the_autopilot_acknowledged_it() -> None:
    back = but(as_kept(ArduPilot(), MISSION, [WAYPOINT])[0], z=20.01)
    assert same_plan(ArduPilot(), MISSION, [WAYPOINT], [back])
    assert not same_plan(ArduPilot(), MISSION, [WAYPOINT], [back], exactly=True)


def test_the_words_name_the_item_the_parameter_and_both_numbers() -> None:
    (change,) = changes_ahead(ArduPilot(), MISSION, [but(WAYPOINT, params=(2.5, 0.0, 0.0, 0.0))])
    assert change_words(ArduPilot(), change) == "Item 1: ArduPilot keeps parameter 1 as 2, not 2.5."
    (change,) = changes_ahead(ArduPilot(), MISSION, [PlanItem(1000, 0, (0.0, 0.0, None, 0.0))])
    assert change_words(ArduPilot(), change) == "Item 1: ArduPilot does not take open as parameter 3."


OFFERED: Final = MEASURED.with_name("offered_items.json")


def test_a_new_item_of_each_kind_that_the_console_offers_is_flown_as_it_is_drawn() -> None:
    """The console's tests compare the file with its catalogue."""
    offered = msgspec.json.decode(OFFERED.read_bytes(), type=dict[str, list[PlanItem]])
    assert {name: len(items) for name, items in offered.items()} == {"ardupilot": 33, "px4": 25}
    for keeping, items in ((ArduPilot(), offered["ardupilot"]), (Px4(), offered["px4"])):
        reported = [one for one in changes_ahead(keeping, MISSION, items) if one.effect > Effect.QUIET]
        assert reported == [], keeping.name


ROOM: Final = MEASURED.with_name("plan_room.json")


def test_more_items_than_an_autopilot_has_room_for_are_told_before_they_are_sent() -> None:
    rooms = msgspec.json.decode(ROOM.read_bytes(), type=dict[str, dict[PlanKind, int]])
    assert rooms == {"ardupilot": dict(ArduPilot().room), "px4": dict(Px4().room)}
    for keeping, kind in ((ArduPilot(), MISSION), (Px4(), PlanKind.RALLY)):
        one = WAYPOINT if kind is MISSION else PlanItem(5100, 6, x=1, y=1)
        most = keeping.room[kind]
        assert not [change for change in changes_ahead(keeping, kind, [one] * most) if change.field == COUNT]
        change = changes_ahead(keeping, kind, [one] * (most + 1))[0]
        assert change == (most, COUNT, most + 1, most, Effect.REFUSED)
        assert change_words(keeping, change).startswith(f"{most + 1} items: {keeping.name} has room for {most} on")
