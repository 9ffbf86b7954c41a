"""The console's table of autopilots equals the profiles."""

import importlib.util
from pathlib import Path

SCRIPT = Path(__file__).resolve().parents[3] / "web" / "scripts" / "generate_autopilots.py"


def test_the_table_is_current() -> None:
    spec = importlib.util.spec_from_file_location("generate_autopilots", SCRIPT)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module.TABLE.read_text(encoding="utf-8") == module.typescript()
