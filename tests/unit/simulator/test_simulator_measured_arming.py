"""Facts measured on ArduCopter: arming and disarming."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from measured_facts import ACCEPTED, FAILED, Make, centre, fact_table, stop_sticks

from simulator.dialect import mavlink
from simulator.modes import Mode

FACTS, fact = fact_table()


ARM = mavlink.MAV_CMD_COMPONENT_ARM_DISARM
LOW = (1500, 1500, 1000, 1500)


@fact("arm with centred sticks, no radio: GUIDED Throttle (RC3) is not neutral; STABILIZE Throttle too high")
def _(ground: Make) -> None:
    for receiver in ("none", "centred"):
        station = ground(receiver=receiver).ready()
        if receiver == "none":
            centre(station)
            station.run(0.5)
        for mode, reason in (
            (Mode.GUIDED, "Throttle (RC3) is not neutral"),
            (Mode.ALT_HOLD, "Throttle (RC3) is not neutral"),
            (Mode.LOITER, "Throttle (RC3) is not neutral"),
            (Mode.STABILIZE, "Throttle too high"),
        ):
            station.set_mode(mode)
            assert station.command(ARM, 1) == FAILED
            assert station.texts()[-1] == f"Arm: {reason}"


@fact("arm with a stick off its middle: Roll (RC1) is not neutral")
def _(ground: Make) -> None:
    station = ground().ready()
    for channel, axis in ((1, "Roll"), (2, "Pitch"), (4, "Yaw")):
        pwm = list(LOW)
        pwm[channel - 1] = 1600
        station.sticks = station.override(*pwm)
        station.run(0.3)
        assert station.command(ARM, 1) == FAILED
        assert station.texts()[-1] == f"Arm: {axis} (RC{channel}) is not neutral"


@fact("arm with centred MANUAL_CONTROL is refused, with the throttle fully down accepted, in each mode")
def _(ground: Make) -> None:
    station = ground(receiver="none").ready()
    station.set_mode(Mode.GUIDED)
    for z, answer in ((500, FAILED), (0, ACCEPTED)):
        station.sticks = mavlink.MAVLink_manual_control_message(1, 0, 0, z, 0, 0)
        station.run(0.5)
        assert station.command(ARM, 1) == answer
    for mode in (Mode.STABILIZE, Mode.ALT_HOLD, Mode.LOITER, Mode.GUIDED):
        assert station.command(ARM, 0) == ACCEPTED
        station.set_mode(mode)
        assert station.command(ARM, 1) == ACCEPTED


@fact("throttle fully down by override over a centred receiver is accepted")
def _(ground: Make) -> None:
    station = ground(receiver="centred").ready()
    station.set_mode(Mode.GUIDED)
    station.sticks = station.override(*LOW)
    station.run(0.3)
    assert station.command(ARM, 1) == ACCEPTED


@fact("arm with no radio and no sticks: RC not found; after sticks that have stopped: Radio failsafe on")
def _(ground: Make) -> None:
    station = ground(receiver="none").ready()
    for mode in (Mode.STABILIZE, Mode.GUIDED):
        station.set_mode(mode)
        assert station.command(ARM, 1) == FAILED
        assert station.texts()[-1] == "Arm: RC not found"
    assert station.command(mavlink.MAV_CMD_RUN_PREARM_CHECKS) == ACCEPTED
    assert station.texts()[-1] == "PreArm: RC not found"
    station.sticks = station.override(*LOW)
    station.run(1)
    stop_sticks(station)
    station.run(1.5)
    assert station.command(ARM, 1) == FAILED
    assert station.texts()[-1] == "Arm: Radio failsafe on"
    station.run(1)
    assert station.of("HEARTBEAT")[-1].system_status == mavlink.MAV_STATE_CRITICAL


@fact("arm with no radio, no sticks, FS_THR_ENABLE 0: accepted")
def _(ground: Make) -> None:
    station = ground(receiver="none", parameters={"FS_THR_ENABLE": 0}).ready()
    assert station.command(ARM, 1) == ACCEPTED


@fact("heartbeats come once a second: the armed flag is up to 1 s old")
def _(ground: Make) -> None:
    station = ground().ready()
    station.until(lambda: bool(station.heard) and station.heard[-1][1].get_type() == "HEARTBEAT")
    assert station.command(ARM, 1) == ACCEPTED
    station.run(0.7)
    assert not station.of("HEARTBEAT")[-1].base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED
    station.run(0.3)
    assert station.of("HEARTBEAT")[-1].base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED


@fact("armed on the ground, throttle down: disarmed after 10 s; with the throttle centred never; sticks stop: at once")
def _(ground: Make) -> None:
    station = ground(receiver="none").ready()
    station.set_mode(Mode.GUIDED)
    station.sticks = station.override(*LOW)
    station.run(0.5)
    assert station.command(ARM, 1) == ACCEPTED
    assert station.until(lambda: not station.flight.armed, 15) == pytest.approx(10, abs=0.5)
    assert station.command(ARM, 1) == ACCEPTED
    centre(station)
    station.run(20)
    assert station.flight.armed
    stop_sticks(station)
    assert station.until(lambda: not station.flight.armed, 5) == pytest.approx(1.0, abs=0.12)
    assert "Radio Failsafe - Disarming" in station.texts()


@pytest.mark.parametrize("check", FACTS)
def test_it_does_what_was_measured(check: Callable[[Make], None], ground: Make) -> None:
    check(ground)
