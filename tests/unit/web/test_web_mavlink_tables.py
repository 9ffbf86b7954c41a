"""The browser's MAVLink tables and golden vectors match the dialect of the installed pymavlink."""

import importlib.util
import json
from pathlib import Path
from types import ModuleType

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

SCRIPT = Path(__file__).resolve().parents[3] / "web" / "scripts" / "generate_mavlink.py"


@pytest.fixture(scope="module")
def generator() -> ModuleType:
    spec = importlib.util.spec_from_file_location("generate_mavlink", SCRIPT)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_tables_are_current(generator: ModuleType) -> None:
    assert generator.TABLES.read_text(encoding="utf-8") == generator.typescript()
    assert generator.ALL_TABLES.read_text(encoding="utf-8") == generator.every_message()


def test_vectors_are_current(generator: ModuleType) -> None:
    assert generator.VECTORS.read_text(encoding="utf-8") == generator.vectors()


def test_vectors_are_what_pymavlink_reads(generator: ModuleType) -> None:
    """The vectors prove nothing unless pymavlink itself reads them as stated."""
    rows = json.loads(generator.VECTORS.read_text(encoding="utf-8"))
    assert rows
    for row in rows:
        message = dialect.MAVLink(None).decode(bytearray.fromhex(row["frame"]))
        assert message.get_type() == row["name"]
        assert (message.get_srcSystem(), message.get_srcComponent()) == (row["sysid"], row["compid"])
        if row["version"] == 2:
            for field, value in row["fields"].items():
                got = getattr(message, field)
                expected = [int(one) for one in value] if isinstance(got, list) and isinstance(value[0], str) else value
                assert got == (int(value) if isinstance(got, int) and isinstance(value, str) else expected), field
