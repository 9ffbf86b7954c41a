"""Facts measured on ArduCopter: sticks stop. Receiver "radio low": its throttle rests at 1000."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest
from measured_facts import (
    ACCEPTED,
    CENTRED,
    Make,
    centre,
    fact_table,
    in_mode,
    mode_after,
    sink_rate,
    stop_sticks,
)

from simulator.dialect import mavlink
from simulator.failure_modes import Failure
from simulator.geodesy import e7
from simulator.mission_plan import Item, PlanKind
from simulator.modes import Mode

FACTS, fact = fact_table()


SET_MODE = mavlink.MAV_CMD_DO_SET_MODE

GUIDED_GOES_ON, MISSION_GOES_ON, LANDING_GOES_ON = 4, 1, 8


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


@pytest.mark.parametrize("check", FACTS)
def test_it_does_what_was_measured(check: Callable[[Make], None], ground: Make) -> None:
    check(ground)
