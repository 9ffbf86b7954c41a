"""The agent's smaller dialect packs, reads and names every message as the one it was made from."""

import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from pymavlink.dialects.v20 import ardupilotmega as whole

sys.path.insert(0, str(Path(__file__).parents[3] / "deploy" / "packages" / "agent"))

from small_dialect import licence, small_dialect


@pytest.fixture(scope="module")
def source() -> str:
    return small_dialect()


@pytest.fixture(scope="module")
def small(source: str) -> ModuleType:
    module = ModuleType("small_ardupilotmega")
    exec(compile(source, "small_ardupilotmega.py", "exec"), module.__dict__)
    return module


def _message(dialect: Any, number: int) -> Any:
    """A message with a different value in each field."""
    kind = dialect.mavlink_map[number]
    types = dict(zip(kind.fieldnames, kind.fieldtypes, strict=True))
    lengths = dict(zip(kind.ordered_fieldnames, kind.array_lengths, strict=True))
    return kind(**{name: _value(types[name], lengths[name], place) for place, name in enumerate(kind.fieldnames)})


def _value(type_: str, length: int, place: int) -> Any:
    if type_ == "char":
        return b"text"[: max(length, 1)] if length else b"c"
    one = place + 0.5 if type_ in {"float", "double"} else place + 1
    return [one] * length if length else one


def test_every_message_becomes_the_same_bytes_and_is_read_again(small: ModuleType) -> None:
    assert small.mavlink_map.keys() == whole.mavlink_map.keys()
    for number in whole.mavlink_map:
        frames = [
            bytes(_message(dialect, number).pack(dialect.MAVLink(None, srcSystem=7, srcComponent=9)))
            for dialect in (whole, small)
        ]
        assert frames[0] == frames[1], whole.mavlink_map[number].msgname
        decoded = [dialect.MAVLink(None).parse_char(frames[0]).to_dict() for dialect in (whole, small)]
        assert decoded[0] == decoded[1]


def test_constants_enums_and_checksums_are_the_same(small: ModuleType) -> None:
    constants = {name: value for name, value in vars(whole).items() if isinstance(value, int | str) and name.isupper()}
    assert len(constants) > 2000
    assert {name: getattr(small, name, None) for name in constants} == constants
    assert small.enums.keys() == whole.enums.keys()
    for name, entries in whole.enums.items():
        assert {n: one.name for n, one in small.enums[name].items()} == {n: one.name for n, one in entries.items()}
    assert {n: one.crc_extra for n, one in small.mavlink_map.items()} == {
        n: one.crc_extra for n, one in whole.mavlink_map.items()
    }


def test_it_is_half_the_size_and_goes_with_its_licence(source: str) -> None:
    assert whole.__file__ is not None
    assert len(source) < 0.55 * Path(whole.__file__).stat().st_size
    assert "GNU LESSER GENERAL PUBLIC LICENSE" in licence().upper()
