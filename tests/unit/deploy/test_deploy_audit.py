"""The audit's reading of responses: a missing list is not a list that reports none."""

import json

import pytest
from audit import Found, read_npm_audit, read_pip_audit, say

WEAK = {
    "name": "flask",
    "version": "0.5",
    "vulns": [{"id": "PYSEC-2019-179", "fix_versions": ["1.0"], "aliases": [], "description": ""}],
}
FINE = {"name": "anyio", "version": "4.16.0", "vulns": []}
SKIPPED = {"name": "av", "skip_reason": "not found"}


def pip(*packages: object) -> str:
    return json.dumps({"dependencies": list(packages), "fixes": []})


def npm(severity: str) -> str:
    return json.dumps(
        {
            "vulnerabilities": {"left": {"severity": severity, "range": "<1.2"}},
            "metadata": {"vulnerabilities": {severity: 1}, "dependencies": {"total": 40}},
        }
    )


@pytest.mark.parametrize(
    ("found", "fine", "words"),
    [
        (read_pip_audit(pip(FINE, FINE)), True, "2 packages, no known weakness"),
        (read_pip_audit(pip(FINE, WEAK)), False, "flask 0.5: PYSEC-2019-179 (fixed in 1.0)"),
        (read_pip_audit(pip(FINE, SKIPPED)), True, "1 of 2 packages were NOT checked"),
        (read_pip_audit(pip(WEAK, SKIPPED)), False, "1 of 2 packages were NOT checked"),
        (read_pip_audit(""), True, "nothing was checked"),
        (read_npm_audit(npm("high")), False, "left: high (<1.2)"),
        (read_npm_audit(npm("critical")), False, "left: critical"),
        (read_npm_audit(npm("moderate")), True, "40 packages"),
        (read_npm_audit('{"message": "405 Method Not Allowed"}'), True, "nothing was checked"),
        (read_npm_audit("<html>"), True, "nothing was checked"),
    ],
)
def test_what_is_fatal_and_what_is_said(
    found: Found, fine: bool, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert say("Packages", found) is fine
    assert words in capsys.readouterr().out
