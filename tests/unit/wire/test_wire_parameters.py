"""Parameter tables: bytes, hash, and refusals."""

import zlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wire.parameters import MAX_ENTRIES, MAX_TABLE_BYTES, Parameter, by_name, pack_table, table_hash, unpack_table
from wire.transactions import MAX_PACKED_TABLE_BYTES

NAMES = st.text("ABCDEFGHIJKLMNOPQRSTUVWXYZ_0123456789", min_size=1, max_size=16)
PARAMETERS = st.builds(Parameter, NAMES, st.floats(allow_nan=False, allow_infinity=False, width=32), st.integers(1, 10))
TABLES = st.lists(PARAMETERS, max_size=60, unique_by=lambda one: one.name).map(by_name)


@given(TABLES)
def test_a_table_survives_its_bytes(table):
    assert unpack_table(pack_table(table)) == table
    assert table_hash(unpack_table(pack_table(table))) == table_hash(table)


@given(TABLES.filter(bool), st.data())
def test_the_hash_is_of_every_name_value_and_kind(table, data):
    at = data.draw(st.integers(0, len(table) - 1))
    one = table[at]
    others = [other for other in table if other is not one]
    assert table_hash(
        by_name([*others, Parameter(one.name, one.value + 1.0 + abs(one.value), one.kind)])
    ) != table_hash(table)
    assert table_hash(by_name([*others, Parameter(one.name, one.value, one.kind % 10 + 1)])) != table_hash(table)
    assert table_hash(tuple(others)) != table_hash(table)


def test_order_and_the_sign_of_zero_say_nothing():
    one, two = Parameter("A", 0.0, 9), Parameter("B", 1.0, 9)
    assert table_hash(by_name([two, one])) == table_hash(by_name([one, two]))
    assert table_hash((Parameter("A", -0.0, 9),)) == table_hash((one,))


def test_a_real_copters_table_fits_into_a_message():
    table = by_name(Parameter(f"GROUP{i % 40}_NAME{i}"[:16], i * 0.37 - 100, 1 + i % 9) for i in range(1400))
    assert len(pack_table(table)) < MAX_PACKED_TABLE_BYTES


@pytest.mark.parametrize(
    "packed",
    [
        b"",
        b"nonsense",
        zlib.compress(b'[["A", 1.0, 9]]')[:-3],
        zlib.compress(b'[["A", 1.0, 9]]') + b"more",
        zlib.compress(b'[["A", 1e999, 9]]'),
        zlib.compress(b'[["A", 1.0, 11]]'),
        zlib.compress(b'[["A B", 1.0, 9]]'),
        zlib.compress(b'[["A", 1.0, 9], ["A", 2.0, 9]]'),
        zlib.compress(b"[" * 100_000),
        zlib.compress(b"\xff\xfe"),
        zlib.compress(b" " * (MAX_TABLE_BYTES + 1)),
        zlib.compress(b"[" + b",".join(b'["A%d", 1.0, 9]' % i for i in range(MAX_ENTRIES + 1)) + b"]"),
    ],
)
def test_what_is_no_table_is_refused(packed):
    with pytest.raises(ValueError):
        unpack_table(packed)
