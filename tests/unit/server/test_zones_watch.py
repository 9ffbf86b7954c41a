"""A drone in flight near zones: told before it gets there, held when it could no longer stop, free to leave."""

import pytest
from test_zones_geometry import SQUARE, M, at, spot, zone

from server.airspace.core.separation.motion import Motion
from server.airspace.core.zones.watch import CLEAR, ZoneWatch
from wire.zones.index import ZoneIndex
from wire.zones.kinds import ZoneKind, ZoneRule
from wire.zones.zone import Zone


class Flight:
    """Flown by hand at a height of 20 m, five positions a second."""

    def __init__(self, *zones: Zone, by_hand: bool = True) -> None:
        self.index, self.watch, self.by_hand = ZoneIndex(zones), ZoneWatch(), by_hand
        self.held: list[str] = []

    def be(self, east_m: float, north_m: float, *, east_m_s: float = 0.0, up_m: float = 20.0, up_m_s: float = 0.0):
        motion = Motion(*at(east_m, north_m), 0.0, 0.0, east_m_s, up_m_s, 0.0)
        held = self.watch.check(self.index, spot(east_m, north_m, up_m), motion, by_hand=self.by_hand)
        if held is not None:
            self.held.append(held.name)
        return self.watch.situation

    def fly_east(self, start_m: float, end_m: float, *, m_s: float = 10.0, north_m: float = 50.0) -> float | None:
        """Until it is held; where that was."""
        step_m = m_s / 5 * (1 if end_m > start_m else -1)
        at_m, before = start_m, len(self.held)
        while (at_m < end_m) == (step_m > 0):
            self.be(at_m, north_m, east_m_s=5 * step_m)
            if len(self.held) > before:
                return at_m
            at_m += step_m
        return None


def test_it_is_told_first_with_time_and_distance_and_then_held_in_front_of_the_edge() -> None:
    flight = Flight(zone())
    assert flight.be(-400, 50, east_m_s=10) == CLEAR
    near = flight.be(-120, 50, east_m_s=10)
    assert near.near == "reaches the no-fly zone Airport in about 10 s, 120 m ahead"
    assert near.breach == ""
    assert flight.held == []
    held_at = flight.fly_east(-110, 100)
    assert held_at is not None
    # 10 m/s: a second, and the way to brake by 2.5 m/s².
    assert -32 <= held_at <= -25


def test_it_is_held_once_and_again_when_it_is_flown_on() -> None:
    flight = Flight(zone())
    flight.fly_east(-60, 0)
    for at_m, speed in ((-28, 9.0), (-20, 6.0), (-12, 3.0), (-10, 1.0)):
        flight.be(at_m, 50, east_m_s=speed)
    assert flight.held == ["Airport"], "one hold while it brakes"
    flight.be(-10, 50)
    flight.be(-9.5, 50, east_m_s=6.0)
    assert flight.held == ["Airport"] * 2


def test_flying_along_or_away_is_no_reason_to_hold() -> None:
    flight = Flight(zone())
    assert flight.be(-5, 50).near == "is within 10 m of the edge of the no-fly zone Airport"
    flight.be(-5, 50, east_m_s=-8.0)
    assert flight.held == []


def test_a_zone_drawn_around_a_drone_tells_it_and_lets_it_leave_and_not_go_deeper() -> None:
    flight = Flight(zone(reason="helicopter"))
    inside = flight.be(80, 50)
    assert inside.breach == "is in the no-fly zone Airport (helicopter)"
    assert flight.held == [], "it is told, and not stopped"
    assert flight.fly_east(80, 120) is None, "the way out is free"
    flight = Flight(zone())
    flight.be(80, 50)
    assert flight.fly_east(80, 20) == pytest.approx(74, abs=2.1), "5 m deeper"
    assert flight.fly_east(72, 20) == pytest.approx(68, abs=3), "and again after 5 m more"


def test_one_that_turned_in_too_late_to_stop_is_held_inside() -> None:
    flight = Flight(zone())
    flight.be(-8, 50)
    flight.be(1, 50, east_m_s=0.0)
    assert flight.held == ["Airport"]


def test_it_may_pass_above_or_below_what_is_forbidden() -> None:
    flight = Flight(zone(ceiling_m=15.0))
    assert flight.fly_east(-100, 150) is None
    assert flight.be(50, 50) == CLEAR
    assert "reaches" in flight.be(50, 50, up_m=20, up_m_s=-1.0).near


def test_climbing_to_a_height_limit() -> None:
    flight = Flight(zone(ZoneKind.HEIGHT_LIMIT, ceiling_m=50.0))
    assert flight.be(50, 50, up_m=20, up_m_s=3.0).near == "goes above the 50 m of the zone Airport in about 10 s"
    assert flight.held == []
    flight.be(50, 50, up_m=46, up_m_s=3.0)
    assert flight.held == ["Airport"]
    assert flight.be(50, 50, up_m=55).breach == "is above the 50 m of the zone Airport"


def test_leaving_a_corridor() -> None:
    flight = Flight(zone(ZoneKind.CORRIDOR, points=(at(0, 0), at(100, 0)), width_m=20, name="Road"))
    assert flight.be(50, 0) == CLEAR
    assert flight.fly_east(50, 200, north_m=0) == pytest.approx(82, abs=4)
    assert flight.be(130, 0).breach == "is outside of the corridor Road"
    flight.be(136, 0)
    assert flight.held == ["Road", "Road"], "further out"


def test_a_zone_that_only_warns_holds_nobody() -> None:
    flight = Flight(zone(rule=ZoneRule.WARN))
    assert flight.fly_east(-100, 90) is None
    inside = flight.be(50, 50)
    assert (inside.near, inside.breach) == ("is in the no-fly zone Airport", "")


def test_what_flies_by_itself_is_told_and_not_held() -> None:
    flight = Flight(zone(), by_hand=False)
    assert flight.fly_east(-100, 90) is None
    assert flight.be(50, 50).breach
    flight.by_hand = True
    flight.be(50, 50)
    assert flight.held == [], "whoever takes the sticks inside is free to leave"


def test_words_do_not_change_with_every_metre() -> None:
    flight, said = Flight(zone(), by_hand=False), set()
    for number in range(100):
        said.add(flight.be(-150 + number, 50, east_m_s=10).near)
    assert len(said) < 25


def test_far_from_any_zone_nothing_is_kept() -> None:
    flight = Flight(zone(points=tuple((lat + 1000 * M, lon) for lat, lon in SQUARE)))
    assert flight.be(0, 0, east_m_s=20) == CLEAR
