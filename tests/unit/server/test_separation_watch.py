"""Warnings about two drones in the air: none too late, and none that flickers."""

from dataclasses import dataclass, replace
from math import cos, radians

import pytest

from server.airspace.core.separation.bounds import Level, SeparationBounds
from server.airspace.core.separation.motion import METRES_PER_DEGREE, Motion
from server.airspace.core.separation.watch import MAX_ENCOUNTERS, AirPicture, SeparationWatch
from wire.ids import DroneId

BOUNDS = SeparationBounds(horizontal_m=20.0, vertical_m=10.0, ahead_s=30.0)
TICK_S = 0.1


@dataclass
class Flown:
    """Position in metres and speed in metres a second; reported 5 times a second while `heard`."""

    north_m: float = 0.0
    east_m: float = 0.0
    up_m: float = 50.0
    north_m_s: float = 0.0
    east_m_s: float = 0.0
    up_m_s: float = 0.0
    airborne: bool = True
    heard: bool = True
    reported: Motion | None = None


class SkyWorld:
    """Flies drones and runs the watch; `told` holds the results: (second, pair, level, why)."""

    def __init__(self, *drones: Flown, bounds: SeparationBounds = BOUNDS) -> None:
        self.drones = {DroneId(number): drone for number, drone in enumerate(drones, 1)}
        self.watch = SeparationWatch(AirPicture(self._flying, self._motion), bounds)
        self.reported: list[tuple[float, tuple[int, int], str, str]] = []
        self.now = 0.0
        self.ticks = 0
        self._report_positions()

    def _report_positions(self) -> None:
        for drone in self.drones.values():
            if drone.heard:
                scale = METRES_PER_DEGREE * cos(radians(47.0))
                lat, lon = 47.0 + drone.north_m / METRES_PER_DEGREE, 8.0 + drone.east_m / scale
                speeds = (drone.north_m_s, drone.east_m_s, drone.up_m_s)
                drone.reported = Motion(lat, lon, 400 + drone.up_m, *speeds, self.now)

    def _flying(self, now: float) -> dict[DroneId, Motion]:
        return {
            number: drone.reported
            for number, drone in self.drones.items()
            if drone.airborne and drone.reported and now - drone.reported.at <= 3.0
        }

    def _motion(self, drone_id: DroneId) -> Motion | None:
        drone = self.drones[drone_id]
        return drone.reported if drone.airborne else None

    def fly(self, for_s: float) -> None:
        for _ in range(round(for_s / TICK_S)):
            self.ticks += 1
            self.now = self.ticks * TICK_S
            for drone in self.drones.values():
                drone.north_m += drone.north_m_s * TICK_S
                drone.east_m += drone.east_m_s * TICK_S
                drone.up_m += drone.up_m_s * TICK_S
            if self.ticks % 2 == 0:
                self._report_positions()
            for one in self.watch.tick(self.now):
                self.reported.append((round(self.now, 1), one.pair, one.level.name.lower(), one.over))

    def levels(self) -> list[str]:
        return [level for _, _, level, _ in self.reported]


def test_two_that_fly_at_each_other_are_a_caution_then_a_warning_and_clear_when_they_have_passed() -> None:
    world = SkyWorld(Flown(north_m_s=10), Flown(north_m=800, up_m=52, north_m_s=-10))
    world.fly(60)
    assert world.levels() == ["caution", "warning", "caution", "clear"]
    caution, warning, _, clear = world.reported
    # They are nearest after 40 s: half a minute before, plus the time to be sure, a quarter of what is left.
    assert 40 - 30 + 5 <= caution[0] <= 40 - 30 + 8
    assert 40 - 10.6 <= warning[0] <= 40 - 10 + 3.5
    assert 43 <= clear[0] <= 48
    assert clear[3] == "apart"
    assert world.watch.encounters == []


def test_what_is_predicted_is_what_happens() -> None:
    world = SkyWorld(Flown(north_m_s=8), Flown(north_m=300, east_m=9, up_m=54, east_m_s=-0.5))
    world.fly(20)
    (one,) = world.watch.encounters
    assert one.judged is not None and one.seen is not None
    _, in_s, horizontal_m, vertical_m = one.judged.approach
    nearest = min((abs(9 - 0.5 * t) ** 2 + (300 - 8 * t) ** 2, t) for t in (step / 100 for step in range(6000)))
    assert world.now + in_s == pytest.approx(nearest[1], abs=0.5)  # checked twice a second
    assert horizontal_m == pytest.approx(nearest[0] ** 0.5, abs=0.3)
    assert vertical_m == pytest.approx(4, abs=0.1)
    assert one.seen.distance_m == pytest.approx(140, abs=4.1)


@pytest.mark.parametrize(
    "drones",
    [
        (Flown(north_m_s=10), Flown(north_m=400, up_m=75, north_m_s=-10)),
        (Flown(north_m_s=10), Flown(north_m=400, east_m=40, north_m_s=-10)),
        (Flown(airborne=False, up_m=0), Flown(east_m=5, airborne=False, up_m=0)),
        (Flown(airborne=False, up_m=0), Flown(east_m=5, up_m=3)),
        (Flown(north_m_s=10),),
    ],
    ids=["above", "beside", "a row on the ground", "one of a row has taken off", "alone"],
)
def test_nobody_is_bothered_without_need(drones: tuple[Flown, ...]) -> None:
    world = SkyWorld(*(replace(drone) for drone in drones))
    world.fly(60)
    assert world.reported == []


def test_a_turn_that_lasts_a_moment_is_no_alert() -> None:
    world = SkyWorld(Flown(north_m_s=5), Flown(east_m=60, north_m_s=5))
    for _ in range(5):
        world.fly(4)
        world.drones[DroneId(2)].east_m_s = -5  # towards the other, for as long as a turn at the end of a line takes
        world.fly(0.8)
        world.drones[DroneId(2)].east_m_s = 5
        world.fly(0.8)
        world.drones[DroneId(2)].east_m_s = 0
    assert world.reported == []


def test_a_swerve_towards_one_nearby_is_told_at_once() -> None:
    world = SkyWorld(Flown(north_m_s=5), Flown(east_m=40, north_m_s=5))
    world.fly(10)
    assert world.reported == []
    world.drones[DroneId(2)].east_m_s = -8
    world.fly(1.5)
    assert "warning" in world.levels()


def test_what_wavers_about_the_bound_does_not_flicker() -> None:
    world = SkyWorld(Flown(), Flown(east_m=19.5))
    for step in range(200):
        world.drones[DroneId(2)].east_m = 19.5 + (0.9 if step % 3 else -0.9)
        world.fly(0.3)
    assert world.levels() == ["caution"]


def test_an_alert_ends_when_one_of_them_has_landed() -> None:
    world = SkyWorld(Flown(), Flown(east_m=6))
    world.fly(5)
    assert world.levels()[-1] == "warning"
    world.drones[DroneId(1)].airborne = False
    world.fly(1)
    assert world.reported[-1][2:] == ("clear", "landed")
    world.fly(10)
    assert world.watch.encounters == []


def test_one_that_is_not_heard_any_more_did_not_go_away() -> None:
    world = SkyWorld(Flown(), Flown(east_m=6))
    world.fly(5)
    world.drones[DroneId(2)].heard = False
    world.fly(12)
    assert world.levels()[-1] == "warning"
    (one,) = world.watch.encounters
    assert one.seen is None
    world.fly(3)
    assert world.reported[-1][2:] == ("clear", "unheard")
    reported = len(world.reported)
    world.fly(20)
    assert len(world.reported) == reported


def test_heard_again_it_goes_on() -> None:
    world = SkyWorld(Flown(), Flown(east_m=6))
    world.fly(5)
    world.drones[DroneId(2)].heard = False
    world.fly(8)
    world.drones[DroneId(2)].heard = True
    world.fly(20)
    assert world.levels().count("warning") == 1
    assert "clear" not in world.levels()


def test_an_old_position_makes_the_bound_wider() -> None:
    """Two drones at the limit: 21 m apart is no warning while they report, and one without reports for 2.5 s."""
    fresh = SkyWorld(Flown(), Flown(east_m=21))
    fresh.fly(30)
    assert fresh.reported == []
    thin = SkyWorld(Flown(), Flown(east_m=21))
    for _ in range(10):
        thin.drones[DroneId(1)].heard = thin.drones[DroneId(2)].heard = False
        thin.fly(2.6)
        thin.drones[DroneId(1)].heard = thin.drones[DroneId(2)].heard = True
        thin.fly(0.4)
    assert "caution" in thin.levels()


def test_nothing_is_watched_where_the_distance_is_none() -> None:
    world = SkyWorld(Flown(), Flown(), bounds=SeparationBounds(horizontal_m=0.0))
    world.fly(10)
    assert world.reported == []


def test_a_crowd_is_bounded_and_said_to_be() -> None:
    world = SkyWorld(*(Flown(east_m=3.0 * number) for number in range(150)))
    world.fly(30)
    assert len(world.watch.encounters) == MAX_ENCOUNTERS
    assert world.watch.cut_short > 0
    assert {one.level for one in world.watch.encounters} <= {Level.CAUTION, Level.WARNING}
