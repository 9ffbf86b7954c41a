"""The table of stream profiles: each rate is achievable, and each profile is thinner than the previous one."""

import pytest

from wire.dialect import mavlink
from wire.state_messages import state_key
from wire.stream_profiles import BEAT_S, StreamChoice, StreamProfile, beats_between, rate_hz

THIN, MINIMAL, FULL = StreamProfile.THIN, StreamProfile.MINIMAL, StreamProfile.FULL
EVERY_ID = sorted(mavlink.mavlink_map)
ATTITUDE, POSITION = mavlink.MAVLINK_MSG_ID_ATTITUDE, mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT


@pytest.mark.parametrize("by_hand", [False, True])
@pytest.mark.parametrize("profile", [THIN, MINIMAL])
def test_every_rate_is_a_whole_number_of_beats(profile: StreamProfile, by_hand: bool) -> None:
    for number in EVERY_ID:
        beats = beats_between(profile, number, by_hand=by_hand)
        assert beats >= 1
        assert beats * BEAT_S == pytest.approx(1 / rate_hz(profile, number, by_hand=by_hand))


def test_each_profile_is_thinner_than_the_one_before_and_none_is_silent() -> None:
    for number in EVERY_ID:
        full, thin, minimal = (rate_hz(profile, number, by_hand=False) for profile in StreamProfile)
        assert full > thin >= minimal > 0


@pytest.mark.parametrize("profile", [THIN, MINIMAL])
def test_a_pilot_has_attitude_and_place_five_times_a_second_in_any_profile(profile: StreamProfile) -> None:
    assert rate_hz(profile, ATTITUDE, by_hand=True) == rate_hz(profile, POSITION, by_hand=True) == 5.0
    for number in EVERY_ID:
        assert rate_hz(profile, number, by_hand=True) >= rate_hz(profile, number, by_hand=False)


def test_nothing_waits_for_a_beat_in_full() -> None:
    assert beats_between(FULL, ATTITUDE, by_hand=False) == 0


def test_whatever_has_a_rate_of_its_own_is_state() -> None:
    usual = [rate_hz(profile, -1, by_hand=by_hand) for profile in (THIN, MINIMAL) for by_hand in (False, True)]
    for number in EVERY_ID:
        own = [rate_hz(profile, number, by_hand=by_hand) for profile in (THIN, MINIMAL) for by_hand in (False, True)]
        if own != usual:
            header = bytes((0xFD, 0, 0, 0, 0, 1, 1, *number.to_bytes(3, "little"), 0, 0))
            assert state_key(header) is not None, mavlink.mavlink_map[number].msgname


def test_every_profile_can_be_chosen_by_its_name() -> None:
    assert {choice.value for choice in StreamChoice} == {"auto", *(profile.value for profile in StreamProfile)}
