"""Plans: the same item in JSON, in MISSION_ITEM_INT and in the bytes of the hash."""

import json
from pathlib import Path
from typing import Any

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from worlds.tiers import examples

from wire.dialect import build, decode, mavlink
from wire.frames import payload
from wire.plans import (
    MAX_ITEMS_ANY,
    PlanItem,
    PlanKind,
    as_float32,
    item_message,
    pack_plan,
    plan_from_json,
    plan_hash,
    plan_to_json,
    read_item,
    unpack_plan,
)

GOLDEN = json.loads((Path(__file__).parent / "golden" / "plans.json").read_text())

NUMBERS = st.floats(width=32, allow_nan=False, allow_infinity=False)
PARAMS = st.tuples(*[st.none() | NUMBERS] * 4)
PLACES = st.integers(-(2**31), 2**31 - 1)
BYTES = st.integers(0, 255)
ITEMS = st.builds(PlanItem, st.integers(0, 0xFFFF), BYTES, PARAMS, PLACES, PLACES, NUMBERS, BYTES)
PLANS = st.lists(ITEMS, max_size=12).map(tuple)


def frame_of(item: PlanItem, kind: PlanKind, seq: int) -> bytes:
    message = item_message(item, seq=seq, kind=kind, target_system=1, target_component=1)
    return build(message, system_id=1, component_id=191, sequence=seq)


@settings(max_examples=examples(166, long=1000), deadline=None)
@given(kind=st.sampled_from(PlanKind), plan=PLANS)
def test_a_plan_survives_mavlink_json_and_its_bytes_bit_for_bit(kind: PlanKind, plan: tuple[PlanItem, ...]) -> None:
    frames = [frame_of(item, kind, seq) for seq, item in enumerate(plan)]
    received = tuple(read_item(decode(frame)) for frame in frames)
    assert pack_plan(kind, received) == pack_plan(kind, plan)
    assert [frame_of(item, kind, seq) for seq, item in enumerate(received)] == frames
    reported = plan_from_json(plan_to_json(plan))
    assert plan_to_json(reported) == plan_to_json(plan)
    assert pack_plan(kind, reported) == pack_plan(kind, plan)
    assert unpack_plan(pack_plan(kind, plan)) == (kind, plan) == (kind, received) == (kind, reported)


def test_the_frame_is_what_pymavlink_packs_by_itself() -> None:
    item = PlanItem(16, 6, (1.5, 0.0, None, -90.25), 473977419, 85455939, 12.34, 1)
    ours = frame_of(item, PlanKind.FENCE, 7)
    theirs: Any = mavlink.MAVLink_mission_item_int_message(
        1, 1, 7, 6, 16, 0, 1, 1.5, 0, float("nan"), -90.25, 473977419, 85455939, 12.34, 1
    )
    assert payload(ours) == payload(build(theirs, system_id=1, component_id=191, sequence=7))


@pytest.mark.parametrize("golden", GOLDEN, ids=lambda golden: golden["name"])
def test_bytes_and_hash_are_those_that_the_console_makes(golden: dict[str, Any]) -> None:
    kind = PlanKind(golden["kind"])
    plan = plan_from_json(json.dumps(golden["items"]))
    assert pack_plan(kind, plan).hex() == golden["packed"]
    assert plan_hash(kind, plan) == golden["hash"]
    assert unpack_plan(bytes.fromhex(golden["packed"])) == (kind, plan)


def test_json_is_an_array_of_arrays_with_null_for_nan() -> None:
    assert plan_to_json([PlanItem(16, 3, (0.0, 2.5, 0.0, None), 1, -2, 20.0)]) == (
        b"[[16,3,[0.0,2.5,0.0,null],1,-2,20.0,1]]"
    )
    assert plan_from_json("[[16, 3, [0, 2.5, 0, null], 1, -2, 20, 1]]")[0].params == (0.0, 2.5, 0.0, None)


@pytest.mark.parametrize(
    "text",
    [
        "[[70000]]",
        "[[16, 256]]",
        "[[16, 3, [0, 0, 0]]]",
        "[[16, 3, [0, 0, 0, 1e39]]]",
        "[[16, 3, [0, 0, 0, 0], 2147483648]]",
        "[[16, 3, [0, 0, 0, 0], 0, 0, 3.5e38]]",
        "[[16, 3, [0, 0, 0, 0], 0, 0, null]]",
        "[[16, 3, [0, 0, 0, 0], 0, 0, 0, 1, 9]]",
        "[" + ",".join(["[16]"] * (MAX_ITEMS_ANY + 1)) + "]",
        "{}",
    ],
)
def test_what_is_no_plan_is_refused(text: str) -> None:
    with pytest.raises(msgspec.DecodeError):
        plan_from_json(text)


def test_floats_are_rounded_to_32_bits_and_minus_zero_is_zero() -> None:
    assert PlanItem(16, z=0.1).z == as_float32(0.1) != 0.1
    assert str(PlanItem(16, z=-0.0, params=(-0.0, 0.0, 0.0, 0.0))) == str(PlanItem(16))
    for bad in (float("nan"), float("inf"), 3.5e38):
        with pytest.raises(ValueError, match="no number"):
            PlanItem(16, z=bad)


@pytest.mark.parametrize("packed", [b"", b"\0\1", b"\x03\0\0", b"\0\1\0", b"\0\0\0\0"])
def test_bytes_that_are_no_plan_are_refused(packed: bytes) -> None:
    with pytest.raises(ValueError, match="plan"):
        unpack_plan(packed)
