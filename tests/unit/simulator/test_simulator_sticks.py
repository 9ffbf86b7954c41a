"""Stick semantics channel by channel: 0, 65535, 65534, expiry, MANUAL_CONTROL, the parameters that change them."""

from __future__ import annotations

import pytest

from simulator.parameters import Parameters
from simulator.receiver import Receiver
from simulator.sticks import Sticks

LEAVE, RELEASE_HIGH = 65535, 65534
REST = [1500, 1500, 1000, 1500, 1800, 1000, 1000, 1800]


def make(receiver: Receiver = Receiver.LOW, **parameters: float) -> Sticks:
    sticks = Sticks(Parameters(parameters.items()), receiver)
    sticks.update(0.0, transmitter_lost=False)
    return sticks


def channels(**values: int) -> list[int]:
    raw = [LEAVE] * 8 + [0] * 10
    for name, value in values.items():
        raw[int(name[1:]) - 1] = value
    return raw


def test_65535_leaves_alone_and_0_gives_back_on_the_first_eight():
    sticks = make()
    sticks.override(channels(c1=1600, c2=1700, c8=1100), 0.0)
    sticks.override(channels(c1=0, c2=LEAVE), 0.1)
    sticks.update(0.1, transmitter_lost=False)
    assert sticks.pwm[:8] == [1500, 1700, 1000, 1500, 1800, 1000, 1000, 1100]


def test_0_and_65535_leave_alone_and_65534_gives_back_on_the_others():
    sticks = make()
    sticks.override(channels(c9=1600, c18=1900), 0.0)
    for value in (0, LEAVE):
        sticks.override(channels(c9=value, c18=value), 0.1)
        sticks.update(0.1, transmitter_lost=False)
        assert (sticks.pwm[8], sticks.pwm[17]) == (1600, 1900)
    sticks.override(channels(c9=RELEASE_HIGH, c18=RELEASE_HIGH), 0.2)
    sticks.update(0.2, transmitter_lost=False)
    assert (sticks.pwm[8], sticks.pwm[17]) == (0, 0)


def test_each_channel_lapses_by_itself():
    sticks = make()
    sticks.override(channels(c1=1600, c2=1600), 0.0)
    sticks.override(channels(c2=1700), 2.0)
    sticks.update(2.99, transmitter_lost=False)
    assert sticks.pwm[:2] == [1600, 1700]
    sticks.update(3.0, transmitter_lost=False)
    assert sticks.pwm[:2] == [1500, 1700]
    sticks.update(5.0, transmitter_lost=False)
    assert sticks.pwm[:8] == REST


@pytest.mark.parametrize(("lasts_s", "after_s", "pwm"), [(0, 0.0, 1500), (-1, 1e6, 1600), (1, 0.99, 1600)])
def test_override_time_of_zero_is_off_and_minus_one_is_for_ever(lasts_s, after_s, pwm):
    sticks = make(RC_OVERRIDE_TIME=lasts_s)
    sticks.override(channels(c1=1600), 0.0)
    sticks.update(after_s, transmitter_lost=False)
    assert sticks.pwm[0] == pwm


def test_without_a_receiver_the_last_values_stay():
    sticks = make(Receiver.NONE)
    assert sticks.pwm == [0] * 18
    assert not sticks.ever_heard
    assert (sticks.roll, sticks.pitch, sticks.yaw, sticks.throttle) == (0, 0, 0, 0)
    sticks.override(channels(c1=1600, c3=1500), 0.0)
    sticks.update(0.0, transmitter_lost=False)
    sticks.update(3.5, transmitter_lost=False)
    assert sticks.pwm[:3] == [1600, 0, 1500]
    assert sticks.silent_for_s(4.0) == pytest.approx(4.0)


def test_manual_control_scales_to_the_range_and_skips_invalid_axes():
    sticks = make(RC1_MIN=1100, RC1_MAX=1900, RC3_MIN=1000, RC3_MAX=2000)
    sticks.manual_control(x=0, y=1000, z=500, r=32767, now_s=0.0)
    sticks.update(0.0, transmitter_lost=False)
    assert sticks.pwm[:4] == [1900, 1500, 1500, 1500]
    assert sticks.climb_mps == 0.0
    sticks.manual_control(x=1000, y=-1000, z=1000, r=-1000, now_s=0.0)
    sticks.update(0.0, transmitter_lost=False)
    assert sticks.pwm[:4] == [1100, 1000, 2000, 1000]
    assert sticks.pitch == -1.0


def test_the_middle_of_the_throttle_is_of_the_range_not_the_trim():
    sticks = make(RC3_MIN=1100, RC3_MAX=1900, RC3_TRIM=1100)
    for pwm, climbs in ((1500, 0.0), (1900, 2.5), (1100, -2.5), (1540, 0.0), (1460, 0.0)):
        sticks.override(channels(c3=pwm), 0.0)
        sticks.update(0.0, transmitter_lost=False)
        assert sticks.climb_mps == pytest.approx(climbs)


def test_dead_zones_reversal_and_channel_maps():
    sticks = make(RC1_REVERSED=1, RCMAP_ROLL=2, RCMAP_PITCH=1)
    sticks.override(channels(c1=1515, c2=2000), 0.0)
    sticks.update(0.0, transmitter_lost=False)
    assert sticks.pitch == 0.0
    assert sticks.roll == 1.0
    sticks.override(channels(c1=2000), 0.0)
    sticks.update(0.0, transmitter_lost=False)
    assert sticks.pitch == -1.0


@pytest.mark.parametrize(
    ("pwm", "position"),
    [(899, None), (1000, 1), (1230, 1), (1231, 2), (1400, 3), (1500, 4), (1700, 5), (1800, 6), (65534, None)],
)
def test_mode_switch_positions(pwm, position):
    sticks = make()
    sticks.override(channels(c5=pwm), 0.0)
    sticks.update(0.0, transmitter_lost=False)
    assert sticks.mode_switch == position
