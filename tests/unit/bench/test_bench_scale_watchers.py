"""The scale benchmark's conclusions from what its browsers received."""

import time

import pytest

from bench.load_frames import EVENT_KINDS, STATE_KINDS, stamped_frame
from bench.scale import slope
from bench.scale_watchers import EventsOnly, Everything
from wire.ids import DroneId
from wire.tagged import tag


def event(drone_id: int, number: int) -> bytes:
    return tag(DroneId(drone_id), stamped_frame(EVENT_KINDS[3], 0, number, number))


def state(drone_id: int, age_s: float) -> bytes:
    return tag(DroneId(drone_id), stamped_frame(STATE_KINDS[0], int((time.monotonic() - age_s) * 1e6), 0, 1))


@pytest.mark.parametrize("make", [EventsOnly, Everything])
def test_a_missing_and_a_repeated_event_are_noticed_for_each_drone(make: type[EventsOnly]) -> None:
    watcher = make()
    watcher.came(event(1, 1) + state(2, 0.0) + event(2, 1) + event(1, 2))
    assert (watcher.events, watcher.out_of_order) == (3, 0)
    watcher.came(event(1, 4) + event(2, 2))
    assert (watcher.events, watcher.out_of_order) == (5, 1)
    watcher.came(event(2, 2))
    assert (watcher.events, watcher.out_of_order) == (6, 2)
    watcher.reported(b'{"type":"lost","drone_id":1,"count":2}')
    watcher.reported(b'{"type":"links","links":[]}')
    assert watcher.losses_reported == 1


def test_the_age_of_state_is_told_and_that_of_the_picture() -> None:
    watcher = Everything()
    watcher.came(state(1, 0.5) + state(1, 0.1) + state(2, 0.2))
    assert watcher.ages_ms() == pytest.approx([100, 200, 500], abs=50)
    assert watcher.stalest_ms() == pytest.approx(500, abs=50)
    watcher.begin()
    assert watcher.ages_ms() == []


def test_a_slope_is_that_of_the_line_through_the_points() -> None:
    assert slope([(0.0, 5.0), (1.0, 7.0), (2.0, 9.0)]) == pytest.approx(2.0)
    assert slope([(0.0, 5.0), (10.0, 5.0)]) == 0.0
    assert slope([(3.0, 5.0)]) == 0.0
