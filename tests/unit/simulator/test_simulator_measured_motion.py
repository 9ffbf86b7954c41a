"""Facts measured on ArduCopter: coasting, braking, climbing, landing."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from measured_facts import ACCEPTED, Make, centre, fact_table, in_mode, sink_rate

from simulator.modes import Mode

FACTS, fact = fact_table()


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


@pytest.mark.parametrize("check", FACTS)
def test_it_does_what_was_measured(check: Callable[[Make], None], ground: Make) -> None:
    check(ground)
