"""The list of the long tier in tests/README.md is what the tests say."""

import ast
import re
from pathlib import Path

TESTS = Path(__file__).resolve().parents[1]


def marked() -> set[tuple[str, str]]:
    """The modules that mark tests as long, each with its reasons."""
    found = set()
    for module in TESTS.rglob("test_*.py"):
        text = module.read_text()
        if "pytest.mark.long" not in text and "thinned(" not in text:
            continue
        for call in ast.walk(ast.parse(text)):
            if isinstance(call, ast.Call) and ast.unparse(call.func) == "pytest.mark.long":
                (reason,) = call.args
                found.add((str(module.relative_to(TESTS)), str(ast.literal_eval(reason))))
            elif isinstance(call, ast.Call) and ast.unparse(call.func) == "thinned":
                (reason,) = (one.value for one in call.keywords if one.arg == "why")
                found.add((str(module.relative_to(TESTS)), str(ast.literal_eval(reason))))
    return found


def test_every_test_of_the_long_tier_is_listed_with_its_reason() -> None:
    rows = re.findall(r"^\| `([^`]+\.py)` \| (.+) \|$", (TESTS / "README.md").read_text(), re.M)
    assert set(rows) == marked()
    assert len(rows) == len(set(rows)), "a row twice"
