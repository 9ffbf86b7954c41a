"""Where the drone was when a picture was taken."""

import pytest

from onboard_agent.autonomy.core.lines import Seen
from onboard_agent.autonomy.pose_history import MAX_AHEAD_S, PoseHistory


def seen(position_at_s: float, attitude_at_s: float, *, lat: float = 47.0, yaw: float = 0.0, up: float = 10.0) -> Seen:
    return Seen(
        position_at_s,
        lat,
        8.0,
        up,
        0.0,
        0.0,
        0.0,
        yaw,
        armed=True,
        airborne=True,
        position_at_s=position_at_s,
        roll_deg=yaw / 10,
        yaw_deg=yaw,
        attitude_at_s=attitude_at_s,
    )


def test_between_two_samples_each_by_its_own_time() -> None:
    history = PoseHistory()
    history.add(seen(10.0, 10.02, lat=47.0, yaw=10.0, up=10.0))
    history.add(seen(10.1, 10.12, lat=47.001, yaw=20.0, up=12.0))
    pose = history.at(10.07)
    assert pose is not None
    assert pose.lat_deg == pytest.approx(47.0007)
    assert pose.height_m == pytest.approx(11.4)
    assert pose.yaw_deg == pytest.approx(15.0)
    assert pose.roll_deg == pytest.approx(1.5)


def test_yaw_takes_the_short_way_round() -> None:
    history = PoseHistory()
    history.add(seen(10.0, 10.0, yaw=350.0))
    history.add(seen(10.1, 10.1, yaw=10.0))
    pose = history.at(10.05)
    assert pose is not None
    assert pose.yaw_deg % 360.0 == pytest.approx(0.0, abs=1e-6)


def test_a_picture_may_be_a_little_newer_than_the_telemetry() -> None:
    history = PoseHistory()
    history.add(seen(10.0, 10.0, lat=47.0))
    history.add(seen(10.1, 10.1, lat=47.001))
    pose = history.at(10.2)
    assert pose is not None
    assert pose.lat_deg == pytest.approx(47.002)
    assert history.at(10.1 + MAX_AHEAD_S + 0.01) is None


def test_what_is_not_known() -> None:
    history = PoseHistory()
    assert history.at(10.0) is None
    history.add(seen(10.0, 0.0))
    assert history.at(10.0) is None, "no attitude came"
    history.add(seen(10.1, 10.1))
    assert history.at(9.9) is None, "before the first sample"


def test_telemetry_without_news_counts_once() -> None:
    history = PoseHistory()
    for _ in range(100):
        history.add(seen(10.0, 10.0))
    history.add(seen(10.1, 10.1))
    assert history.at(10.0) is not None
