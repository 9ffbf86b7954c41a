"""What controllers on board have found, as the tower keeps it."""

from datetime import UTC, datetime

from msgspec.structs import replace

from server.operations.core.findings import MAX_FINDINGS, MIN_APART_S, MIN_SIGHTINGS_APART_S, Findings
from wire.findings import InVideo, TargetFound

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


BOX = InVideo(x=0.5, y=0.25, width=0.1, height=0.2, age_s=0.3)


def test_a_finding_keeps_its_place_in_the_video() -> None:
    findings = Findings()
    added = findings.add(replace(found("A"), in_video=BOX), AT, 1.0)
    assert added is not None
    assert added.in_video is not None
    assert (added.in_video.x, added.in_video.height, added.in_video.age_s) == (0.5, 0.2, 0.3)
    assert findings.add(found("B"), AT, 2.0) is not None
    assert findings.newest[0].in_video is None


def test_a_sighting_is_told_at_a_bounded_rate_and_never_kept() -> None:
    findings = Findings()
    sighting = replace(found("A"), in_video=BOX, sighting=True)
    told = findings.sighted(sighting, 7, 10.0)
    assert told is not None
    assert (told.drone_id, told.letter, told.in_video.width) == (7, "A", 0.1)
    assert findings.sighted(sighting, 7, 10.0 + MIN_SIGHTINGS_APART_S / 2) is None
    assert findings.sighted(sighting, 7, 10.01 + MIN_SIGHTINGS_APART_S) is not None
    assert findings.sighted(found("A"), 7, 20.0) is None, "no video shows it"
    assert findings.newest == []
