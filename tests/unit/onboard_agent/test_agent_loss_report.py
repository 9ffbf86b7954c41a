"""Reports to the tower on the parameters and the radio that decide what happens on a loss."""

from typing import Any

from onboard_agent.autopilot.own_frames import FrameMaker, Sender
from onboard_agent.autopilot.parameters import ANSWER_WITHIN_S, NAMES, Parameters
from onboard_agent.autopilot.radio import LAPSE_S, Radio
from onboard_agent.failsafe.loss_report import LossReport
from wire.control_messages import LossParameters
from wire.dialect import mavlink

RECEIVER = mavlink.MAV_SYS_STATUS_SENSOR_RC_RECEIVER
OVERRIDES_LAST_S = 3.0


def param_value(name: str, number: float) -> bytes:
    return FrameMaker().make(mavlink.MAVLink_param_value_message(name.encode(), number, 9, 900, 1), Sender(1, 1))


def sys_status(present: int, health: int) -> Any:
    return mavlink.MAVLink_sys_status_message(present, present, health, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0)


def rc_channels(count: int, throttle: int) -> Any:
    return mavlink.MAVLink_rc_channels_message(0, count, *[throttle] * 4, *[0] * 14, 255)


class RadioBench(Radio):
    def status(self, present: int, health: int, now: float = 0.0) -> bool | None:
        self.sys_status(sys_status(present, health), now, overrides_last_s=OVERRIDES_LAST_S)
        return self.has_radio

    def channels(self, count: int, throttle: int, now: float = 0.0) -> bool | None:
        self.rc_channels(rc_channels(count, throttle), now, overrides_last_s=OVERRIDES_LAST_S)
        return self.has_radio


def test_nothing_is_known_at_first() -> None:
    assert Radio().has_radio is None


def test_the_receivers_health_tells() -> None:
    assert RadioBench().status(RECEIVER, RECEIVER) is True
    assert RadioBench().status(RECEIVER, 0) is False
    assert RadioBench().status(0, 0) is None


def test_the_channels_tell_where_the_health_does_not() -> None:
    assert RadioBench().channels(16, 1500) is True
    assert RadioBench().channels(16, 0) is False
    assert RadioBench().channels(0, 65535) is False
    radio = RadioBench()
    radio.status(RECEIVER, 0)
    assert radio.channels(16, 1500) is False, "the better source has spoken"


def test_our_own_sticks_are_no_radio() -> None:
    radio = RadioBench()
    radio.sticks_sent(10.0)
    assert radio.channels(16, 1500, 11.0) is None
    assert radio.status(RECEIVER, RECEIVER, 10.0 + OVERRIDES_LAST_S + LAPSE_S - 0.1) is None
    assert radio.status(RECEIVER, RECEIVER, 10.0 + OVERRIDES_LAST_S + LAPSE_S) is True
    radio.sticks_sent(20.0)
    assert radio.status(RECEIVER, 0, 21.0) is True, "what was known stays known"


def read_all(parameters: Parameters, values: dict[str, float]) -> None:
    for n in range(100):
        parameters.due(float(n), vehicle_system_id=1)
        for name, number in values.items():
            parameters.value(param_value(name, number))


def test_it_is_told_when_all_are_read_then_on_each_change_and_to_each_new_link() -> None:
    report, parameters = LossReport(), Parameters(FrameMaker())

    def reported(has_radio: bool | None = None) -> LossParameters | None:
        return report.changed(parameters, autopilot_kind=3, has_radio=has_radio)

    parameters.ask_all(3)
    assert reported() is None, "not read yet"
    values = {"FS_GCS_ENABLE": 1.0, "FS_THR_ENABLE": 1.0, "RC_OVERRIDE_TIME": 3.0, "SYSID_MYGCS": 255.0}
    read_all(parameters, values)
    expected = LossParameters(autopilot="ardupilot", values=values, complete=True)
    assert reported() == expected
    assert reported() is None
    parameters.value(param_value("FS_GCS_ENABLE", 2.0))
    changed = reported()
    assert changed is not None
    assert changed.values == values | {"FS_GCS_ENABLE": 2.0}
    with_radio = reported(True)
    assert with_radio is not None
    assert with_radio.has_radio is True
    report.resend()
    assert reported(True) == with_radio


def test_the_autopilot_is_named() -> None:
    for kind, name in ((12, "px4"), (8, "")):
        parameters = Parameters(FrameMaker())
        parameters.ask_all(kind)
        read_all(parameters, {})
        report = LossReport().changed(parameters, autopilot_kind=kind, has_radio=None)
        assert report == LossParameters(autopilot=name, values={}, complete=False)
    assert set(NAMES) == {1, 3, 12}


def test_what_decides_and_was_not_answered_is_not_known_and_asked_for_again() -> None:
    """A narrow line has lost three requests: the check before flight must not report the absence of danger."""
    report, parameters = LossReport(), Parameters(FrameMaker())
    parameters.ask_all(3)
    some = {"FS_GCS_ENABLE": 1.0, "RC_OVERRIDE_TIME": 3.0, "SYSID_MYGCS": 255.0}
    now = 0.0
    while parameters.due(now, vehicle_system_id=1) is not None or not parameters.all_read:
        for name, number in some.items():
            parameters.value(param_value(name, number))
        now += ANSWER_WITHIN_S
    reported = report.changed(parameters, autopilot_kind=3, has_radio=False)
    assert reported is not None
    assert not reported.complete
    asked: list[bytes] = []
    while now < 200.0:
        now += ANSWER_WITHIN_S
        asked += filter(None, [parameters.due(now, vehicle_system_id=1)])
    assert any(b"FS_THR_ENABLE" in frame for frame in asked)
    assert not any(b"FS_GCS_ENABLE" in frame for frame in asked)
    parameters.value(param_value("FS_THR_ENABLE", 0.0))
    reported = report.changed(parameters, autopilot_kind=3, has_radio=False)
    assert reported is not None
    assert reported.complete
