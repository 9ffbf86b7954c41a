"""The tracker: confirmed by k of n pictures, smoothed, lost by time, not led astray by what jumps."""

from __future__ import annotations

import math

import pytest

from onboard_agent.vision.square_target import SquareTarget
from onboard_agent.vision.target_tracker import TargetTracker, Track, TrackerSettings, TrackState

DT_S = 0.1


def target(
    x: float = 100.0, y: float = 80.0, side: float = 50.0, heading: float = 0.0, sure: float = 0.8
) -> SquareTarget:
    half = side / 2
    corners = ((x - half, y - half), (x + half, y - half), (x + half, y + half), (x - half, y + half))
    headings = (heading % 360, heading + 90, heading + 180, heading + 270)
    return SquareTarget((x, y), side, headings, corners, (1.0, 0.7, 0.4), sure)


def fed(tracker: TargetTracker, pictures: list[list[SquareTarget]], start_s: float = 0.0) -> list[Track | None]:
    return [tracker.update(seen, start_s + number * DT_S) for number, seen in enumerate(pictures)]


@pytest.mark.parametrize(
    ("seen", "states"),
    [
        ("111", "TTC"),
        ("10101", "TTTTC"),
        ("11001", "TTTTC"),
        ("1001000", "TTTTTTT"),
        ("01110", "STTCC"),
        ("100000", "TTTTTS"),
    ],
)
def test_three_of_five_confirm(seen: str, states: str) -> None:
    tracker = TargetTracker(TrackerSettings(confirm_of=3, window=5, lose_after_s=10.0))
    tracks = fed(tracker, [[target()] if one == "1" else [] for one in seen])
    letters = {TrackState.TENTATIVE: "T", TrackState.CONFIRMED: "C"}
    assert "".join(letters[track.state] if track else "S" for track in tracks) == states


def test_it_is_lost_after_the_time_and_the_next_is_another() -> None:
    tracker = TargetTracker(TrackerSettings(lose_after_s=0.5))
    fed(tracker, [[target()]] * 3)
    assert tracker.state is TrackState.CONFIRMED
    assert tracker.update([], 0.69) is not None
    assert tracker.update([], 0.71) is None
    assert tracker.state is TrackState.SEARCHING
    again = tracker.update([target()], 0.8)
    assert again is not None
    assert (again.number, again.state) == (2, TrackState.TENTATIVE)


def test_a_target_seen_too_late_begins_a_new_track() -> None:
    tracker = TargetTracker(TrackerSettings(lose_after_s=0.5))
    fed(tracker, [[target()]] * 3)
    late = tracker.update([target()], 3.0)
    assert late is not None
    assert late.number == 2


def test_smoothing_takes_noise_out_and_reaches_a_step() -> None:
    tracker = TargetTracker(TrackerSettings(time_constant_s=0.3))
    track = None
    for number in range(40):
        track = tracker.update([target(x=100.0 + 4.0 * (-1) ** number)], number * DT_S)
    assert track is not None
    assert abs(track.centre_px[0] - 100.0) < 1.0
    for number in range(40, 70):
        track = tracker.update([target(x=110.0, side=55.0)], number * DT_S)
    assert track is not None
    assert track.centre_px[0] == pytest.approx(110.0, abs=0.01)
    assert track.side_px == pytest.approx(55.0, abs=0.01)


def test_one_time_constant_covers_63_percent_of_a_step() -> None:
    tracker = TargetTracker(TrackerSettings(time_constant_s=0.2))
    tracker.update([target(x=100.0)], 0.0)
    track = tracker.update([target(x=110.0)], 0.2)
    assert track is not None
    assert track.centre_px[0] == pytest.approx(100.0 + 10.0 * (1.0 - math.exp(-1.0)))


def test_without_smoothing_it_is_the_latest() -> None:
    tracker = TargetTracker(TrackerSettings(time_constant_s=0.0))
    track = fed(tracker, [[target()], [target(x=117.0, heading=20.0)]])[-1]
    assert track is not None
    assert (track.centre_px, track.heading_deg) == ((117.0, 80.0), pytest.approx(20.0))


def test_a_heading_goes_the_short_way_over_the_quarter() -> None:
    tracker = TargetTracker(TrackerSettings(time_constant_s=0.1))
    track = fed(tracker, [[target(heading=44.0)], [target(heading=-44.0)]])[-1]
    assert track is not None
    assert track.heading_deg == pytest.approx(44.0 + 2.0 * (1.0 - math.exp(-1.0)) - 90.0)


def test_what_jumps_or_grows_does_not_move_the_track() -> None:
    tracker = TargetTracker(TrackerSettings(gate=0.5, lose_after_s=5.0))
    fed(tracker, [[target()]] * 3)
    for other in (target(x=300.0), target(side=150.0)):
        track = tracker.update([other], 0.3)
        assert track is not None
        assert (track.centre_px, track.side_px, track.seen_s) == ((100.0, 80.0), 50.0, 0.2)


def test_the_gate_grows_while_it_is_unseen() -> None:
    tracker = TargetTracker(TrackerSettings(gate=0.5, lose_after_s=5.0))
    fed(tracker, [[target()]] * 3 + [[]] * 3)
    track = tracker.update([target(x=190.0)], 0.7)
    assert track is not None
    assert track.seen_s == 0.7


def test_it_begins_with_the_surest_and_follows_the_nearest() -> None:
    tracker = TargetTracker()
    near, sure = target(x=100.0, sure=0.5), target(x=130.0, sure=0.9)
    track = tracker.update([near, sure], 0.0)
    assert track is not None
    assert track.latest is sure
    track = tracker.update([target(x=112.0, sure=0.99), target(x=128.0, sure=0.1)], 0.1)
    assert track is not None
    assert track.latest.centre_px == (128.0, 80.0)


@pytest.mark.parametrize(
    "wrong", [{"confirm_of": 6}, {"confirm_of": 0}, {"lose_after_s": 0.0}, {"time_constant_s": -1.0}]
)
def test_settings_have_limits(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="is to be"):
        TrackerSettings(**wrong)  # type: ignore[arg-type]
