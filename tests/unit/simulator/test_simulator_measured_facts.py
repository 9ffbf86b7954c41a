"""One test for each line of what was measured on ArduCopter through the tower (AUTOPILOTS.md) and beside it
(docs/simulator.md) that a simulator can express. The id of each test is the line.

"Radio low": a receiver whose throttle rests at 1000. "No radio": none. Parameters as they come unless said otherwise.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest

from simulator.dialect import mavlink
from simulator.failure_modes import Failure
from simulator.geodesy import e7
from simulator.mission_plan import Item, PlanKind
from simulator.modes import Mode
from simulator.parameters import Parameters

ACCEPTED, FAILED = 0, 4
ARM = mavlink.MAV_CMD_COMPONENT_ARM_DISARM
SET_MODE = mavlink.MAV_CMD_DO_SET_MODE
RECEIVER = mavlink.MAV_SYS_STATUS_SENSOR_RC_RECEIVER
CENTRED = (1500, 1500, 1500, 1500)
LOW = (1500, 1500, 1000, 1500)
GUIDED_GOES_ON, MISSION_GOES_ON, LANDING_GOES_ON = 4, 1, 8

Make = Callable[..., Any]
FACTS: list[Any] = []


def fact(line: str) -> Callable[[Callable[[Make], None]], Callable[[Make], None]]:
    def keep(check: Callable[[Make], None]) -> Callable[[Make], None]:
        FACTS.append(pytest.param(check, id=line))
        return check

    return keep


def centre(station: Any) -> None:
    station.sticks = station.override(*CENTRED)


def in_mode(ground: Make, mode: Mode, alt_m: float = 20.0, **options: Any) -> Any:
    """In the air, centred sticks streaming, in `mode` and settled."""
    station = ground(**options).take_off(alt_m)
    centre(station)
    assert station.set_mode(mode) == ACCEPTED
    station.run(3)
    return station


def stop_sticks(station: Any) -> None:
    station.sticks = None


def mode_after(station: Any, seconds: float) -> Mode:
    station.run(seconds)
    mode: Mode = station.flight.mode
    return mode


def sink_rate(station: Any) -> float:
    return float(station.body.vd_mps)


def asked(station: Any, message_id: int, name: str) -> Any:
    assert station.command(mavlink.MAV_CMD_REQUEST_MESSAGE, message_id) == ACCEPTED
    return station.of(name)[-1]


def receiver_bits(station: Any) -> tuple[bool, bool, bool]:
    """Present, enabled, healthy."""
    status = asked(station, 1, "SYS_STATUS")
    return (
        bool(status.onboard_control_sensors_present & RECEIVER),
        bool(status.onboard_control_sensors_enabled & RECEIVER),
        bool(status.onboard_control_sensors_health & RECEIVER),
    )


def channel_count(station: Any) -> int:
    return int(asked(station, 65, "RC_CHANNELS").chancount)


def ekf_flags(station: Any) -> int:
    return int(asked(station, 193, "EKF_STATUS_REPORT").flags)


# Sticks stop.


@fact("centred sticks stop in ALT_HOLD, radio low: sinks at 2.5 m/s until it hits the ground")
def _(ground: Make) -> None:
    station = in_mode(ground, Mode.ALT_HOLD)
    stop_sticks(station)
    station.run(2.8)
    assert station.body.alt_m == pytest.approx(20, abs=0.1)
    station.run(3)
    assert sink_rate(station) == pytest.approx(2.5, abs=0.1)
    station.until(lambda: station.body.on_ground, 10)
    assert station.flight.mode is Mode.ALT_HOLD


@fact("centred sticks stop in LOITER, radio low: sinks at 2.5 m/s until it hits the ground")
def _(ground: Make) -> None:
    station = in_mode(ground, Mode.LOITER)
    stop_sticks(station)
    station.run(6)
    assert sink_rate(station) == pytest.approx(2.5, abs=0.1)
    station.until(lambda: station.body.on_ground, 10)


@fact("centred sticks stop in ALT_HOLD, receiver centred: stays at its height")
def _(ground: Make) -> None:
    station = in_mode(ground, Mode.ALT_HOLD, receiver="centred")
    stop_sticks(station)
    assert mode_after(station, 10) is Mode.ALT_HOLD
    assert station.body.alt_m == pytest.approx(20, abs=0.1)


@fact("the same, no radio: radio failsafe about 1 s after the last stick: return to launch")
def _(ground: Make) -> None:
    for mode in (Mode.ALT_HOLD, Mode.LOITER):
        station = in_mode(ground, mode, receiver="none")
        stop_sticks(station)
        assert station.until(lambda s=station: s.flight.mode is Mode.RTL, 5) == pytest.approx(1.0, abs=0.12)
        assert "Radio Failsafe" in station.texts()
        assert station.body.alt_m == pytest.approx(20, abs=0.1)


@fact("BRAKE, then no sticks at all, radio low: stays, 0.15 m/s after 5 s")
def _(ground: Make) -> None:
    station = in_mode(ground, Mode.LOITER, alt_m=39.4)
    station.sticks = station.override(1500, 1300, 1500, 1500)
    station.run(5)
    assert station.body.ground_speed_mps() > 3.0
    assert station.set_mode(Mode.BRAKE) == ACCEPTED
    stop_sticks(station)
    station.run(5)
    assert station.body.ground_speed_mps() < 0.2
    assert mode_after(station, 43) is Mode.BRAKE
    assert station.body.alt_m == pytest.approx(39.4, abs=0.2)
    assert station.body.ground_speed_mps() < 0.05


@fact("BRAKE uses nobody's sticks")
def _(ground: Make) -> None:
    station = in_mode(ground, Mode.BRAKE)
    place = (station.body.north_m, station.body.east_m)
    station.sticks = station.override(2000, 1000, 1000, 2000)
    station.run(5)
    assert math.dist(place, (station.body.north_m, station.body.east_m)) < 0.1
    assert station.body.alt_m == pytest.approx(20, abs=0.1)


@fact("ALT_HOLD, then GUIDED, then no sticks for 60 s, radio low: stays at 20.0 m")
def _(ground: Make) -> None:
    station = in_mode(ground, Mode.ALT_HOLD)
    assert station.set_mode(Mode.GUIDED) == ACCEPTED
    stop_sticks(station)
    assert mode_after(station, 60) is Mode.GUIDED
    assert station.body.alt_m == pytest.approx(20, abs=0.1)
    assert station.body.ground_speed_mps() < 0.05


@fact("ALT_HOLD, then BRAKE or GUIDED, then sticks stop, no radio: radio failsafe 1 s later, RTL out of either")
def _(ground: Make) -> None:
    for mode in (Mode.BRAKE, Mode.GUIDED):
        station = in_mode(ground, Mode.ALT_HOLD, receiver="none")
        assert station.set_mode(mode) == ACCEPTED
        station.run(1)
        stop_sticks(station)
        assert station.until(lambda s=station: s.flight.mode is Mode.RTL, 5) == pytest.approx(1.0, abs=0.12)


@fact(
    "no radio, FS_OPTIONS bit 2: Radio Failsafe - Continuing Guided Mode, GUIDED stays 60 s at 20.0 m, BRAKE does not"
)
def _(ground: Make) -> None:
    parameters = {"FS_OPTIONS": GUIDED_GOES_ON}
    station = in_mode(ground, Mode.GUIDED, receiver="none", parameters=parameters)
    stop_sticks(station)
    assert mode_after(station, 60) is Mode.GUIDED
    assert "Radio Failsafe - Continuing Guided Mode" in station.texts()
    assert station.body.alt_m == pytest.approx(20, abs=0.1)
    station = in_mode(ground, Mode.BRAKE, receiver="none", parameters=parameters)
    stop_sticks(station)
    assert mode_after(station, 2) is Mode.RTL


@fact("no radio, FS_THR_ENABLE 0: BRAKE and GUIDED stay 60 s at 20.0 m, and ALT_HOLD flies on by the last sticks")
def _(ground: Make) -> None:
    for mode in (Mode.BRAKE, Mode.GUIDED, Mode.ALT_HOLD):
        station = in_mode(ground, mode, receiver="none", parameters={"FS_THR_ENABLE": 0})
        stop_sticks(station)
        assert mode_after(station, 60) is mode
        assert station.body.alt_m == pytest.approx(20, abs=0.1)


@fact("in RTL, sticks that had come stop for 1 s, no radio: radio failsafe, and the return goes on")
def _(ground: Make) -> None:
    station = in_mode(ground, Mode.RTL, receiver="none")
    stop_sticks(station)
    station.run(1.2)
    assert "Radio Failsafe" in station.texts()
    assert station.flight.mode is Mode.RTL


def with_mission(station: Any) -> Any:
    places = [station.flight.origin.to_place(north_m, 0, 0) for north_m in (0.0, 20.0, 300.0)]
    items = [Item(16, x=e7(place.lat_deg), y=e7(place.lon_deg), z=20.0, frame=3) for place in places]
    station.flight.plans.store(PlanKind.MISSION, items, None)
    return station


@fact("in AUTO, sticks that had come stop for 1 s, no radio: a new return, unless FS_OPTIONS bit 0")
def _(ground: Make) -> None:
    for bits, mode, text in (
        (16, Mode.RTL, "Radio Failsafe"),
        (MISSION_GOES_ON, Mode.AUTO, "Radio Failsafe - Continuing Auto"),
    ):
        station = with_mission(ground(receiver="none", parameters={"FS_OPTIONS": bits}).take_off(20))
        assert station.set_mode(Mode.AUTO) == ACCEPTED
        station.run(3)
        stop_sticks(station)
        assert mode_after(station, 2) is mode
        assert text in station.texts()


@fact("in LAND, sticks stop, no radio: RTL, unless FS_OPTIONS bit 3")
def _(ground: Make) -> None:
    for bits, mode in ((16, Mode.RTL), (LANDING_GOES_ON, Mode.LAND)):
        station = in_mode(ground, Mode.LAND, receiver="none", parameters={"FS_OPTIONS": bits})
        stop_sticks(station)
        assert mode_after(station, 2) is mode
    assert "Radio Failsafe - Continuing Landing" in station.texts()


@fact("in the last descent of RTL, sticks stop, no radio, FS_OPTIONS bit 3: LAND, after 4 s at the same height")
def _(ground: Make) -> None:
    station = in_mode(ground, Mode.RTL, receiver="none", parameters={"FS_OPTIONS": LANDING_GOES_ON})
    station.until(lambda: station.body.alt_m < 9, 60)
    stop_sticks(station)
    station.until(lambda: station.flight.mode is Mode.LAND, 2)
    station.run(1)
    alt_m = station.body.alt_m
    station.run(2.5)
    assert station.body.alt_m == pytest.approx(alt_m, abs=0.1)
    station.run(3)
    assert station.body.alt_m < alt_m - 0.5


@fact("sticks pause 1.1 s between two pilots, no radio: RTL instead of the mode that was commanded; 0.85 s do nothing")
def _(ground: Make) -> None:
    for pause_s, mode in ((0.85, Mode.LOITER), (1.15, Mode.RTL)):
        station = in_mode(ground, Mode.LOITER, receiver="none")
        stop_sticks(station)
        station.run(pause_s)
        centre(station)
        assert mode_after(station, 2) is mode


@fact("every mode can be commanded in a radio failsafe, and stays; the last sticks are not flown")
def _(ground: Make) -> None:
    station = in_mode(ground, Mode.ALT_HOLD, receiver="none")
    station.sticks = station.override(1500, 1000, 2000, 2000)
    station.run(0.5)
    stop_sticks(station)
    station.until(lambda: station.flight.mode is Mode.RTL, 5)
    for mode in (Mode.GUIDED, Mode.BRAKE, Mode.LOITER, Mode.ALT_HOLD):
        assert station.set_mode(mode) == ACCEPTED
    alt_m = station.body.alt_m
    assert mode_after(station, 12) is Mode.ALT_HOLD
    assert station.body.alt_m == pytest.approx(alt_m, abs=3.0)
    assert station.tilt_deg() < 1


@fact("override 0 on all sticks, no radio: the last values stay, radio failsafe 1 s later though messages come")
def _(ground: Make) -> None:
    station = in_mode(ground, Mode.ALT_HOLD, receiver="none")
    station.sticks = station.override(0, 0, 0, 0)
    assert station.until(lambda: station.flight.mode is Mode.RTL, 5) == pytest.approx(1.0, abs=0.15)
    assert station.flight.sticks.pwm[:4] == list(CENTRED)


@fact("an axis of MANUAL_CONTROL at 32767 is given back to the receiver; a negative throttle makes the message void")
def _(ground: Make) -> None:
    station = ground().ready()
    station.send(mavlink.MAVLink_manual_control_message(1, 1000, 1000, 700, 0, 0))
    station.run(0.1)
    assert station.flight.sticks.pwm[:3] == [2000, 1000, 1700]
    station.send(mavlink.MAVLink_manual_control_message(1, 0, 0, -1, 0, 0))
    station.run(0.1)
    assert station.flight.sticks.pwm[:3] == [2000, 1000, 1700]
    station.send(mavlink.MAVLink_manual_control_message(1, 32767, 32767, 32767, 32767, 0))
    station.run(0.1)
    assert station.flight.sticks.pwm[:3] == [1500, 1500, 1000]


@fact("sticks that come, transmitter lost in the air: nothing; then they stop: RTL after 0.94 s")
def _(ground: Make) -> None:
    station = in_mode(ground, Mode.ALT_HOLD)
    station.vehicle.failures.add(Failure.RADIO_LOST)
    assert mode_after(station, 3) is Mode.ALT_HOLD
    stop_sticks(station)
    assert station.until(lambda: station.flight.mode is Mode.RTL, 5) == pytest.approx(1.0, abs=0.12)


# Arming.


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


# How it moves.


@fact("TAKE (ALT_HOLD) during RTL, radio low, nothing else done: touches down at 2.5 m/s instead of 0.5")
def _(ground: Make) -> None:
    station = ground().take_off(14)
    assert station.set_mode(Mode.RTL) == ACCEPTED
    station.run(1)
    assert station.set_mode(Mode.ALT_HOLD) == ACCEPTED
    fastest = 0.0
    while not station.body.on_ground:
        fastest = sink_rate(station)
        station.run(0.02)
    assert fastest == pytest.approx(2.5, abs=0.1)


@fact("full climb into ALT_HOLD: 2.2 m from the moment of the mode (2.5 to 3.8 with a link between)")
def _(ground: Make) -> None:
    _overshoot(ground, 2000, 1.0)


@fact("full descent into ALT_HOLD: 2.2 m from the moment of the mode (2.3 to 3.8 with a link between)")
def _(ground: Make) -> None:
    _overshoot(ground, 1000, -1.0)


def _overshoot(ground: Make, throttle: int, sign: float) -> None:
    for mode in (Mode.ALT_HOLD, Mode.LOITER):
        station = in_mode(ground, mode, alt_m=30)
        station.sticks = station.override(1500, 1500, throttle, 1500)
        station.run(4)
        assert -sign * sink_rate(station) == pytest.approx(2.5, abs=0.1)
        centre(station)
        station.send(station.sticks)
        assert station.set_mode(Mode.ALT_HOLD) == ACCEPTED
        alt_m = station.body.alt_m
        station.run(0.9)
        assert -sign * sink_rate(station) == pytest.approx(0.9, abs=0.3)
        station.run(3)
        assert sign * (station.body.alt_m - alt_m) == pytest.approx(2.1, abs=0.4)
        assert sink_rate(station) == pytest.approx(0, abs=0.05)


@fact("full forward coasts 19-25 m, 1.4 m/s after 5 s")
def _(ground: Make) -> None:
    station = in_mode(ground, Mode.LOITER, alt_m=30)
    station.sticks = station.override(1500, 1000, 1500, 1500)
    station.run(10)
    assert station.body.ground_speed_mps() == pytest.approx(10.2, abs=0.6)
    centre(station)
    station.send(station.sticks)
    assert station.set_mode(Mode.ALT_HOLD) == ACCEPTED
    start_m = station.from_home_m()
    station.run(4.9)
    assert station.body.ground_speed_mps() == pytest.approx(1.5, abs=0.25)
    assert 19 < station.from_home_m() - start_m < 25
    station.run(10)
    assert station.body.ground_speed_mps() == pytest.approx(0.17, abs=0.15)


@fact("BRAKE from full speed: still after 5 to 6 s and 21 m; from 5.5 m/s after 10 m")
def _(ground: Make) -> None:
    for coasting_s, speed_mps, length_m in ((0.0, 10.2, 21.0), (1.5, 5.5, 10.0)):
        station = in_mode(ground, Mode.ALT_HOLD, alt_m=30)
        station.sticks = station.override(1500, 1000, 1500, 1500)
        station.run(10)
        centre(station)
        station.run(coasting_s)
        assert station.body.ground_speed_mps() == pytest.approx(speed_mps, rel=0.1)
        start_m = station.from_home_m()
        assert station.set_mode(Mode.BRAKE) == ACCEPTED
        station.run(5)
        assert station.body.ground_speed_mps() < 0.3
        station.run(3)
        assert station.from_home_m() - start_m == pytest.approx(length_m, rel=0.12)
        assert station.body.ground_speed_mps() < 0.05


@fact("LOITER from full speed: still after 4 s and 21 m")
def _(ground: Make) -> None:
    station = in_mode(ground, Mode.ALT_HOLD, alt_m=30)
    station.sticks = station.override(1500, 1000, 1500, 1500)
    station.run(10)
    centre(station)
    station.send(station.sticks)
    start_m = station.from_home_m()
    assert station.set_mode(Mode.LOITER) == ACCEPTED
    station.run(5)
    assert station.body.ground_speed_mps() < 0.5
    assert station.from_home_m() - start_m == pytest.approx(21, rel=0.15)


@fact("on the ground in ALT_HOLD, throttle down: landed 2 s after the touch, disarmed 10 s after that")
def _(ground: Make) -> None:
    station = ground().take_off(5)
    assert station.set_mode(Mode.ALT_HOLD) == ACCEPTED
    station.until(lambda: station.body.on_ground, 20)
    assert station.until(lambda: station.flight.landed, 5) == pytest.approx(1.9, abs=0.2)
    assert station.until(lambda: not station.flight.armed, 15) == pytest.approx(10, abs=0.5)


@fact(
    "sinking at 2.5 m/s from 3 m, sticks end: touches the ground before it is arrested; centred at once it stops at 0.7"
)
def _(ground: Make) -> None:
    for late_s, touches in ((0.0, False), (0.5, True)):
        station = in_mode(ground, Mode.ALT_HOLD)
        station.sticks = station.override(1500, 1500, 1000, 1500)
        station.until(lambda s=station: s.body.alt_m < 3.0, 20)
        station.run(late_s)
        centre(station)
        station.send(station.sticks)
        touched = False
        for _ in range(150):
            station.run(0.02)
            touched |= station.body.on_ground
        assert touched is touches
        if not touches:
            assert station.body.alt_m == pytest.approx(0.75, abs=0.3)


# GPS.


@fact("GPS lost, armed: LOITER, GUIDED and BRAKE still accepted for about 6 s, then requires position, and so is RTL")
def _(ground: Make) -> None:
    station = in_mode(ground, Mode.ALT_HOLD)
    station.vehicle.failures.add(Failure.GPS_LOST)
    station.run(5)
    for mode in (Mode.LOITER, Mode.GUIDED, Mode.BRAKE, Mode.ALT_HOLD):
        assert station.set_mode(mode) == ACCEPTED
    station.run(1)
    for mode in (Mode.LOITER, Mode.GUIDED, Mode.BRAKE, Mode.RTL):
        assert station.set_mode(mode) == FAILED
        assert station.texts()[-1] == f"Mode change to {mode.name} failed: requires position"


@fact("GPS lost in a mode that needs a position: EKF failsafe LAND 1 s after it is gone, 4 s at the same height first")
def _(ground: Make) -> None:
    for mode in (Mode.GUIDED, Mode.BRAKE, Mode.LOITER):
        station = in_mode(ground, mode)
        station.vehicle.failures.add(Failure.GPS_LOST)
        assert station.until(lambda s=station: s.flight.mode is Mode.LAND, 12) == pytest.approx(7.0, abs=0.2)
        assert "EKF variance" in station.texts()
        assert "EKF Failsafe: changed to LAND Mode" in station.texts()
        station.run(3.8)
        assert station.body.alt_m == pytest.approx(20, abs=0.2)
        station.run(4)
        assert station.body.alt_m < 19


@fact("GPS lost in ALT_HOLD: EKF Failsafe, and the mode stays")
def _(ground: Make) -> None:
    station = in_mode(ground, Mode.ALT_HOLD)
    station.vehicle.failures.add(Failure.GPS_LOST)
    assert mode_after(station, 15) is Mode.ALT_HOLD
    assert "EKF Failsafe" in station.texts()
    station.vehicle.failures.discard(Failure.GPS_LOST)
    station.run(1.5)
    assert "EKF Failsafe Cleared" in station.texts()


@fact("GPS lost in a hold without a radio: RTL refused, LAND when the sticks stop")
def _(ground: Make) -> None:
    station = in_mode(ground, Mode.ALT_HOLD, receiver="none")
    station.vehicle.failures.add(Failure.GPS_LOST)
    station.run(8)
    assert station.set_mode(Mode.RTL) == FAILED
    stop_sticks(station)
    assert mode_after(station, 1.5) is Mode.LAND
    assert "Mode change to RTL failed: requires position" in station.texts()


@fact("EKF_STATUS_REPORT: 167 before the first position, 831 with it, 37 after a loss and 167 again 8 s later")
def _(ground: Make) -> None:
    station = ground(boot_s=10)
    station.run(5)
    assert ekf_flags(station) == 167
    station.ready()
    assert ekf_flags(station) == 831
    station.take_off()
    station.set_mode(Mode.ALT_HOLD)
    centre(station)
    station.vehicle.failures.add(Failure.GPS_LOST)
    station.run(5)
    assert ekf_flags(station) == 831
    station.run(2)
    assert ekf_flags(station) == 37
    station.run(8)
    assert ekf_flags(station) == 167
    station.vehicle.failures.discard(Failure.GPS_LOST)
    station.run(0.1)
    assert ekf_flags(station) == 831


# What it tells.


@fact("no radio, no sticks yet: SYS_STATUS without a receiver, RC_CHANNELS with chancount 0 and zeros")
def _(ground: Make) -> None:
    station = ground(receiver="none").ready()
    assert receiver_bits(station) == (False, False, False)
    assert channel_count(station) == 0
    assert station.of("RC_CHANNELS")[-1].chan1_raw == 0


@fact("no radio, sticks come: a receiver is present, enabled and healthy, but chancount stays 0")
def _(ground: Make) -> None:
    station = ground(receiver="none").ready()
    centre(station)
    station.run(1)
    assert receiver_bits(station) == (True, True, True)
    assert channel_count(station) == 0
    assert station.of("RC_CHANNELS")[-1].chan3_raw == 1500
    stop_sticks(station)
    station.run(2)
    assert receiver_bits(station) == (True, True, False)
    assert station.of("HEARTBEAT")[-1].system_status == mavlink.MAV_STATE_CRITICAL


@fact("no radio, FS_THR_ENABLE 0, sticks have stopped: the receiver is healthy all the same")
def _(ground: Make) -> None:
    station = ground(receiver="none", parameters={"FS_THR_ENABLE": 0}).ready()
    centre(station)
    station.run(1)
    stop_sticks(station)
    station.run(10)
    assert receiver_bits(station) == (True, True, True)
    assert channel_count(station) == 0


@fact("a receiver: present, enabled, healthy, chancount 8; its transmitter lost: not healthy, chancount 8")
def _(ground: Make) -> None:
    station = ground().ready()
    assert receiver_bits(station) == (True, True, True)
    assert channel_count(station) == 8
    station.vehicle.failures.add(Failure.RADIO_LOST)
    station.run(1.5)
    assert receiver_bits(station) == (True, True, False)
    assert channel_count(station) == 8
    assert station.of("RC_CHANNELS")[-1].chan3_raw == 1000


@fact("battery_remaining falls with use")
def _(ground: Make) -> None:
    station = ground(battery_mah=1000).take_off()
    before = asked(station, 1, "SYS_STATUS").battery_remaining
    station.run(30)
    assert 8 <= before - asked(station, 1, "SYS_STATUS").battery_remaining <= 20


@fact("set home here in the air: heights over home jump, and are negative after landing")
def _(ground: Make) -> None:
    station = ground().take_off(25)
    assert asked(station, 33, "GLOBAL_POSITION_INT").relative_alt == pytest.approx(25_000, abs=200)
    assert station.command(mavlink.MAV_CMD_DO_SET_HOME, 1) == ACCEPTED
    assert asked(station, 33, "GLOBAL_POSITION_INT").relative_alt == pytest.approx(0, abs=100)
    station.set_mode(Mode.LAND)
    station.until(lambda: not station.flight.armed, 90)
    assert asked(station, 33, "GLOBAL_POSITION_INT").relative_alt == pytest.approx(-25_000, abs=200)


@fact("channel 5 overridden, or its override lapsing, changes the mode by itself, in the air too")
def _(ground: Make) -> None:
    station = in_mode(ground, Mode.ALT_HOLD)
    station.sticks = station.override(*CENTRED, 1300)
    station.run(0.5)
    assert station.flight.mode is Mode.LAND
    centre(station)
    assert mode_after(station, 4) is Mode.STABILIZE


@fact("a board may refuse a mission of a size that its documents allow")
def _(ground: Make) -> None:
    station = ground(failures={Failure.MISSION_FULL}).ready()
    station.send(mavlink.MAVLink_mission_count_message(1, 1, 724, 0))
    station.run(0.5)
    assert station.of("MISSION_ACK")[-1].type == mavlink.MAV_MISSION_NO_SPACE


@fact("parameters: about 1,391")
def _(_ground: Make) -> None:
    assert abs(sum(1 for _ in Parameters()) - 1391) < 10


@fact("a mode may be acknowledged and come late: mode-change-slow")
def _(ground: Make) -> None:
    station = in_mode(ground, Mode.ALT_HOLD)
    station.vehicle.failures.add(Failure.MODE_CHANGE_SLOW)
    assert station.set_mode(Mode.BRAKE) == ACCEPTED
    assert mode_after(station, 1.0) is Mode.ALT_HOLD
    assert mode_after(station, 0.6) is Mode.BRAKE


@pytest.mark.parametrize("check", FACTS)
def test_it_does_what_was_measured(check: Callable[[Make], None], ground: Make) -> None:
    check(ground)
