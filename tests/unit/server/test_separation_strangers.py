"""What a warning may reveal of another owner's drone: rounded figures, of known drones only, at a limited rate."""

import itertools
from typing import Final

import pytest

from server.airspace.core.separation.approach import Approach
from server.airspace.core.separation.bounds import Level
from server.airspace.core.separation.motion import Relative
from server.airspace.core.separation.strangers import (
    ALERT_BURST,
    ALERT_EVERY_S,
    FIGURES_EVERY_S,
    Rounded,
    StrangerAlert,
    StrangerAlerts,
    rounded,
)
from wire.ids import DroneId

PAIR: Final = (DroneId(1), DroneId(2))
NEAR: Final = Rounded(Level.CAUTION, 10, 90, 20, 5)


def alerts() -> StrangerAlerts:
    return StrangerAlerts(itertools.count(100).__next__)


def look(
    of: StrangerAlerts, now: float, *, level: Level = Level.CAUTION, qualifies: bool | None = True, encounter: int = 1
) -> StrangerAlert | None:
    return of.check(encounter, PAIR, level, lambda: NEAR._replace(level=level), qualifies=qualifies, now=now)


@pytest.mark.parametrize(
    ("east_m", "north_m", "up_m", "in_s", "expected"),
    [
        (6.0, 0.0, 3.0, 0.0, (0, 90, 10, 5)),
        (0.4, 0.0, 0.0, 4.9, (0, 90, 10, 0)),
        (0.0, 26.0, -7.0, 5.0, (5, 0, 30, -5)),
        (-1.0, 100.0, 8.0, 29.9, (25, 0, 100, 10)),
        (-50.0, -50.0, -2.4, 12.0, (10, 240, 70, 0)),
    ],
)
def test_figures_are_rounded(
    east_m: float, north_m: float, up_m: float, in_s: float, expected: tuple[int, ...]
) -> None:
    reported = rounded(Level.WARNING, Approach(in_s, in_s, 1.0, 1.0), Relative(east_m, north_m, up_m, 0, 0, 0))
    assert reported[1:] == expected


def test_places_that_differ_by_less_than_a_step_are_told_as_one() -> None:
    reported = {
        rounded(Level.CAUTION, None, Relative(40.0 + east, north, up, 1.0, 2.0, 3.0))
        for east in (-4.0, 0.0, 4.0)
        for north in (-5.0, 0.0, 5.0)
        for up in (-2.0, 0.0, 2.0)
    }
    assert reported == {Rounded(Level.CAUTION, None, 90, 40, 0)}


def test_a_silent_one_begins_nothing_and_ends_nothing() -> None:
    of = alerts()
    assert look(of, 0, qualifies=None) is None
    began = look(of, 1)
    assert began is not None and began.number == 100
    assert look(of, 2, qualifies=None) is None
    assert of.last(1, 1) == began
    assert look(of, 2 + FIGURES_EVERY_S, qualifies=None) is not None


def test_an_unfit_one_begins_nothing_and_ends_what_was_told_without_a_reason() -> None:
    of = alerts()
    assert look(of, 0, qualifies=False) is None
    assert look(of, 1) is not None
    assert look(of, 2, qualifies=False) == StrangerAlert(100, Rounded(Level.CLEAR))
    assert of.last(1, 1) is None
    assert look(of, 3, qualifies=False) is None


def test_a_worse_level_is_told_at_once_and_figures_seldom() -> None:
    of = alerts()
    reported = [now / 10 for now in range(301) if look(of, now / 10) is not None]
    assert reported == [n * FIGURES_EVERY_S for n in range(7)]
    worse = look(of, 30.1, level=Level.WARNING)
    assert worse is not None and worse.about.level is Level.WARNING
    assert look(of, 30.2, level=Level.CAUTION) is None


def test_of_the_same_two_alerts_begin_only_so_often() -> None:
    of = alerts()
    begun = 0
    for second in range(600):
        begun += look(of, second, encounter=second) is not None
        look(of, second + 0.5, level=Level.CLEAR, encounter=second)
    assert begun == ALERT_BURST + int(599 // ALERT_EVERY_S)


def test_encounters_that_ended_in_silence_are_forgotten() -> None:
    of = alerts()
    look(of, 0, encounter=1)
    look(of, 0, encounter=2)
    of.forget_all_but([2])
    assert (of.last(1, 1), of.last(2, 1)) == (None, StrangerAlert(101, NEAR))
