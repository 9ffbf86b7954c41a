"""`server/kernel` alone decides what a role permits: no other code compares roles."""

import re
from pathlib import Path

import pytest

SERVER = Path(__file__).resolve().parents[3] / "server"
COMPARES = re.compile(
    r"(?<!Team)Role\.[A-Z]{2}"  # a role by its name
    r"|\brole\s*(==|!=|in\b|not in\b|is\b(?! not None\b)(?! None\b))"
    r"|role\.value\s*(==|!=)"
)
ALLOWED = {
    "accounts/store/users.py": "the rows are the object itself: the last admin stays one",
    "accounts/store/views.py": "the role of a new account that names none",
    "app/commands/first_start.py": "the role of the first account",
    "app/commands/users.py": "the role of a new account that names none",
}
"""Files that may name a role, and the reason."""
OTHER_ROLES = re.compile(r"TeamRole|file\.role|about\.role|member\.role|one\.role|role (is not|!=) [\w.]+\.role:")
"""Lines about the role in a team, of a map layer, or a changed one: other questions."""


def _compares(text: str) -> list[str]:
    return [line.strip() for line in text.splitlines() if COMPARES.search(line) and not OTHER_ROLES.search(line)]


def test_nobody_outside_the_kernel_compares_roles() -> None:
    found = {
        str(path.relative_to(SERVER)): lines
        for path in sorted(SERVER.rglob("*.py"))
        if path.relative_to(SERVER).parts[0] != "kernel" and (lines := _compares(path.read_text()))
    }
    assert {name: lines for name, lines in found.items() if name not in ALLOWED} == {}
    assert set(ALLOWED) == set(found), "an exception that is needed no more"


@pytest.mark.parametrize(
    "line",
    [
        "if principal.role is Role.ADMIN:",
        "if principal.role is not Role.ADMIN and theirs:",
        "UserRow.role == wanted",
        "if role in (one, other):",
        'row.role != "admin"',
    ],
)
def test_the_test_sees_a_comparison(line: str) -> None:
    assert _compares(line) == [line]
