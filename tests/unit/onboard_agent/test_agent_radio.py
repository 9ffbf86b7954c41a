"""Whether a receiver is on board: a row for each case measured on ArduCopter, overridden or not."""

import pytest

from onboard_agent.autopilot.radio import LAPSE_S, SILENT_S, SWITCHED_S, Radio
from wire.dialect import mavlink

RECEIVER = mavlink.MAV_SYS_STATUS_SENSOR_RC_RECEIVER
LASTS_S = 3.0
LONG_AGO, NOW = 10.0, 100.0


def say(radio: Radio, *, count: int, values: tuple[int, int, int, int], healthy: bool, now: float) -> None:
    sensors = RECEIVER if healthy else 0
    status = mavlink.MAVLink_sys_status_message(sensors, sensors, sensors, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0)
    channels = mavlink.MAVLink_rc_channels_message(0, count, *values, *([0] * 14), 255)
    for _ in range(2):  # whichever comes first
        radio.sys_status(status, now, overrides_last_s=LASTS_S)
        radio.rc_channels(channels, now, overrides_last_s=LASTS_S)


LOW, CENTRED, SILENT, OURS = (1500, 1500, 1000, 1500), (1500,) * 4, (0,) * 4, (1500,) * 4


@pytest.mark.parametrize(
    ("count", "values", "healthy", "sticks_at", "expected"),
    [
        (8, LOW, True, None, True),
        (16, CENTRED, True, None, True),
        (0, SILENT, False, None, False),
        (0, OURS, True, NOW, False),  # no receiver, and the health bit reflects our own sticks
        (0, OURS, False, NOW - LASTS_S, False),
        (0, OURS, True, NOW - 60.0, False),  # FS_THR_ENABLE 0: healthy for ever
        (8, LOW, True, NOW - LASTS_S - LAPSE_S - 0.1, True),
    ],
)
def test_the_number_of_channels_tells(
    count: int, values: tuple[int, int, int, int], healthy: bool, sticks_at: float | None, expected: bool
) -> None:
    radio = Radio()
    assert radio.has_radio is None
    if sticks_at is not None:
        radio.sticks_sent(sticks_at)
    say(radio, count=count, values=values, healthy=healthy, now=NOW)
    assert radio.has_radio is expected


@pytest.mark.parametrize("had", [True, False])
def test_what_is_known_stays_known_while_our_own_sticks_come(had: bool) -> None:
    radio = Radio()
    say(radio, count=16 if had else 0, values=LOW if had else SILENT, healthy=had, now=LONG_AGO)
    radio.sticks_sent(NOW)
    say(radio, count=16 if had else 0, values=OURS, healthy=True, now=NOW)
    assert radio.has_radio is had


def test_a_transmitter_that_is_switched_off_is_told_by_the_receivers_health() -> None:
    radio = Radio()
    say(radio, count=16, values=LOW, healthy=True, now=LONG_AGO)
    status = mavlink.MAVLink_sys_status_message(RECEIVER, RECEIVER, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0)
    radio.sys_status(status, NOW, overrides_last_s=LASTS_S)
    assert radio.has_radio is False


def test_where_channels_are_sent_only_with_a_receiver_their_silence_tells() -> None:
    radio = Radio()
    radio.check(NOW)
    assert radio.has_radio is None, "nobody has asked for them"
    radio.asked(NOW)
    radio.check(NOW + SILENT_S - 0.1)
    assert radio.has_radio is None
    radio.check(NOW + SILENT_S)
    assert radio.has_radio is False
    say(radio, count=8, values=LOW, healthy=True, now=NOW + SILENT_S + 1.0)
    assert radio.has_radio is True


def test_sticks_hide_whether_a_receiver_still_receives() -> None:
    radio = Radio()
    say(radio, count=16, values=LOW, healthy=True, now=LONG_AGO)
    assert not radio.hidden(NOW, overrides_last_s=LASTS_S)
    radio.sticks_sent(NOW)
    assert radio.hidden(NOW + LASTS_S, overrides_last_s=LASTS_S)
    assert not radio.hidden(NOW + LASTS_S + LAPSE_S, overrides_last_s=LASTS_S)


def test_sticks_hide_nothing_where_there_is_no_receiver() -> None:
    radio = Radio()
    say(radio, count=0, values=SILENT, healthy=False, now=LONG_AGO)
    radio.sticks_sent(NOW)
    assert not radio.hidden(NOW, overrides_last_s=LASTS_S)


@pytest.mark.parametrize(("moved_us", "seen"), [(0, False), (20, False), (400, True)])
def test_a_switch_of_the_transmitter_is_seen_through_our_sticks(moved_us: int, seen: bool) -> None:
    radio = Radio()
    for at, fifth in ((NOW - 1.0, 1200), (NOW, 1200 + moved_us)):
        radio.sticks_sent(at)
        message = mavlink.MAVLink_rc_channels_message(0, 16, *OURS, fifth, *([1000] * 13), 255)
        radio.rc_channels(message, at, overrides_last_s=LASTS_S)
    assert radio.switched(NOW) is seen
    assert not radio.switched(NOW + SWITCHED_S)
