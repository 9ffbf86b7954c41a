"""LANDING_TARGET at a fixed rate: each sighting once, the newest only, none that is old."""

from __future__ import annotations

import pytest

from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.landing.target_sender import MAX_AGE_S, TargetSender
from onboard_agent.vision.landing_target import landing_target
from wire.dialect import decode, mavlink


def target(number: int, time_us: int = 0):
    return landing_target((0.1, -0.2, 5.0), time_us=time_us, kind=2, number=number, distance_m=5.0, yaw_rad=0.3)


def sent(frames):
    return [decode(frame) for frame in frames]


def test_a_sighting_goes_out_once_with_the_time_of_its_picture() -> None:
    sender = TargetSender(FrameMaker())
    sender.saw(target(7, 12_345_678), 100.0)
    (message,) = sent(sender.due(42, 100.05))
    assert message.get_type() == "LANDING_TARGET"
    assert (message.get_srcSystem(), message.get_srcComponent()) == (42, 191)
    assert (message.time_usec, message.target_num, message.frame, message.position_valid) == (12_345_678, 7, 12, 1)
    assert (message.type, message.distance) == (mavlink.LANDING_TARGET_TYPE_VISION_FIDUCIAL, 5.0)
    assert sender.due(42, 100.2) == []
    assert sender.sent == 1


def test_the_rate_is_fixed_however_many_pictures_come() -> None:
    sender = TargetSender(FrameMaker(), rate_hz=20.0)
    out = []
    for tick in range(1000):  # two seconds, with a picture each 4 ms
        now = tick * 0.002
        if tick % 2 == 0:
            sender.saw(target(tick // 2 % 256), now)
        out += [(now, one) for one in sent(sender.due(1, now))]
    assert len(out) == 40
    assert all(one.target_num == round(now / 0.004 - 0.01) % 256 for now, one in out)  # the newest each time


def test_slow_pictures_are_not_repeated() -> None:
    sender = TargetSender(FrameMaker())
    out = []
    for tick in range(500):
        now = tick * 0.01
        if tick % 100 == 0:
            sender.saw(target(tick // 100), now)
        out += sent(sender.due(1, now))
    assert [one.target_num for one in out] == [0, 1, 2, 3, 4]


def test_what_is_old_or_older_than_the_last_is_dropped() -> None:
    sender = TargetSender(FrameMaker())
    sender.saw(target(1), 10.0)
    assert sender.due(1, 10.0 + MAX_AGE_S + 0.01) == []
    assert sender.late == 1
    sender.saw(target(3), 11.0)
    sender.saw(target(2), 10.9)
    (message,) = sent(sender.due(1, 11.0))
    assert message.target_num == 3


def test_a_pause_is_not_made_up_for() -> None:
    sender = TargetSender(FrameMaker(), rate_hz=20.0)
    sender.due(1, 0.0)
    count = 0
    for tick in range(10):
        now = 30.0 + tick * 0.005
        sender.saw(target(tick), now)
        count += len(sender.due(1, now))
    assert count <= 2


@pytest.mark.parametrize("rate_hz", [5.0, 20.0, 50.0])
def test_a_tick_that_is_late_does_not_slow_it(rate_hz: float) -> None:
    sender = TargetSender(FrameMaker(), rate_hz=rate_hz)
    count, tick_s = 0, 0.013
    for tick in range(round(4.0 / tick_s)):
        now = tick * tick_s
        sender.saw(target(0), now)
        count += len(sender.due(1, now))
    assert count == pytest.approx(4.0 * rate_hz, rel=0.03)
