"""What towers seal for each other: opened once, by the one that it is for, in order."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from server.towers.io.bus_seal import OVERHEAD_BYTES, BusSeal, NotOfATower

A, B, C = ("0a" * 16, "0b" * 16, "0c" * 16)
OLD, NEW = b"o" * 32, b"n" * 32


def seal_of(me: str, *keys: bytes, purpose: str = "sticks") -> BusSeal:
    return BusSeal(me, lambda: keys or (OLD,), purpose)


def test_it_is_opened_by_the_other_tower_once_and_in_order() -> None:
    a, b = seal_of(A), seal_of(B)
    first, second, third = (a.seal(text, B) for text in (b"", b"one", b"two"))
    assert (b.open(first), b.open(third)) == (b"", b"two")
    for repeated in (first, second, third):
        with pytest.raises(NotOfATower, match="repeated"):
            b.open(repeated)
    assert len(second) == len(b"one") + OVERHEAD_BYTES


@given(st.integers(0, 8 * (OVERHEAD_BYTES + 5) - 1))
def test_no_bit_of_it_can_be_changed(bit: int) -> None:
    sealed = bytearray(seal_of(A).seal(b"order", B))
    sealed[bit // 8] ^= 1 << bit % 8
    with pytest.raises(NotOfATower):
        seal_of(B).open(bytes(sealed))


@pytest.mark.parametrize(
    "opener",
    [seal_of(C), seal_of(B, NEW), seal_of(B, purpose="video")],
    ids=["another tower", "another key", "another connection"],
)
def test_it_is_for_one_tower_one_key_and_one_connection(opener: BusSeal) -> None:
    with pytest.raises(NotOfATower):
        opener.open(seal_of(A).seal(b"order", B))
    for short in (b"", b"x" * (OVERHEAD_BYTES - 1)):
        with pytest.raises(NotOfATower, match="short"):
            opener.open(short)


def test_keys_are_changed_tower_by_tower() -> None:
    """First the new one is added behind the old one everywhere, then they change places."""
    before, middle, after = (OLD,), (OLD, NEW), (NEW, OLD)
    for one, other in ((before, middle), (middle, middle), (middle, after), (after, after), (after, (NEW,))):
        assert seal_of(B, *other).open(seal_of(A, *one).seal(b"x", B)) == b"x"
        assert seal_of(A, *one).open(seal_of(B, *other).seal(b"x", A)) == b"x"


def test_a_forged_packet_costs_nothing_of_what_comes_after_it() -> None:
    a, b = seal_of(A), seal_of(B)
    with pytest.raises(NotOfATower):
        b.open(seal_of(A, NEW).seal(b"forged", B))
    assert b.open(a.seal(b"order", B)) == b"order"
    b.forget(A)
    a.forget(B)
    assert b.open(seal_of(A).seal(b"again", B)) == b"again"
