"""What controllers on board have found, as the tower keeps it."""

from datetime import UTC, datetime

from server.live.operations.findings import MAX_FINDINGS, MIN_APART_S, Findings
from wire.findings import TargetFound

AT = datetime(2026, 1, 1, tzinfo=UTC)


def found(letter: str) -> TargetFound:
    return TargetFound(id=1, letter=letter, confidence=0.5, lat_deg=47.0, lon_deg=8.0, thumbnail=b"\xff\xd8")


def test_the_newest_come_first_and_the_oldest_make_room() -> None:
    findings = Findings()
    for number in range(MAX_FINDINGS + 5):
        assert findings.add(found("A"), AT, number * 1.0) is not None
    assert [one.number for one in findings.newest] == list(range(MAX_FINDINGS + 5, 5, -1))
    assert findings.newest[0].thumbnail == "/9g="


def test_one_that_comes_too_soon_is_left_out() -> None:
    findings = Findings()
    assert findings.add(found("A"), AT, 10.0) is not None
    assert findings.add(found("B"), AT, 10.0 + MIN_APART_S / 2) is None
    assert findings.add(found("C"), AT, 10.01 + MIN_APART_S) is not None
    assert [one.letter for one in findings.newest] == ["C", "A"]
