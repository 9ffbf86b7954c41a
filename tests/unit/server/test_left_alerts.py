"""Alerts of a tower that is gone for good: closed with a reason where no tower will see their end, and no others."""

from dataclasses import replace

import pytest
from hub_world import NOW, HubWorld, record

from server.alerts.core.alert import Alert
from server.alerts.core.left_alerts import (
    GONE_FOR_S,
    REMOVED_FOR_S,
    LeftAlerts,
    LeftDrone,
    OpenAlert,
    Why,
    why_left,
)
from server.alerts.core.rules import BY_NAME
from server.alerts.core.views import AlertView
from server.towers.core.place import Place
from wire.control_messages import AutopilotState
from wire.ids import DroneId

LOW = OpenAlert(1, "battery-low", "", DroneId(7))
DISK = OpenAlert(2, "tower-disk-low", "folder-a", None)
UNHEARD = LeftDrone("Kestrel", Place.HERE, was_heard=False, on_hold=False)
BOTH = frozenset({"folder-a", "folder-b"})
ONLY_B = frozenset({"folder-b"})
WHY_UNHEARD = "The tower that saw it is gone, and no tower has heard Kestrel for 12 hours since."


def why(alert: OpenAlert, drone: LeftDrone | None = None, towers: frozenset[str] | None = BOTH, first: bool = True):
    found = why_left(alert, drone, towers, is_first=first)
    return None if found is None else found.words


def test_a_drone_that_no_tower_has_heard_since() -> None:
    assert why_left(LOW, UNHEARD, BOTH, is_first=False) == Why(WHY_UNHEARD, GONE_FOR_S)
    assert why(LOW, UNHEARD._replace(was_heard=True)) is None
    for elsewhere in (Place.ELSEWHERE, Place.OUT_OF_REACH):
        assert why(LOW, UNHEARD._replace(place=elsewhere)) is None
    nowhere = UNHEARD._replace(place=Place.NOWHERE)
    assert (why(LOW, nowhere), why(LOW, nowhere, first=False)) == (WHY_UNHEARD, None)


def test_what_lasts_while_the_drone_is_not_heard_stays_open() -> None:
    for rule in ("link-lost", "link-lost-on-ground", "hold-unconfirmed"):
        assert rule in BY_NAME
        assert why(LOW._replace(rule=rule), UNHEARD) is None
    on_hold = LOW._replace(rule="on-hold")
    assert "on-hold" in BY_NAME
    assert why(on_hold, UNHEARD._replace(on_hold=True)) is None
    assert why(on_hold, UNHEARD) == WHY_UNHEARD


def test_a_drone_that_was_removed() -> None:
    assert why_left(LOW, None, BOTH, is_first=True) == Why("The drone was removed.", REMOVED_FOR_S)
    assert why(LOW, None, first=False) is None


def test_alerts_of_a_tower_itself() -> None:
    assert why(DISK, towers=ONLY_B) == "The tower that it is about has been gone for 12 hours."
    assert why(DISK, towers=BOTH) is None
    assert why(DISK, towers=None) is None, "one of the running towers may be that one"
    assert why(DISK, towers=ONLY_B, first=False) is None


def test_it_is_closed_only_after_its_time_and_counts_anew_when_it_was_found_again() -> None:
    alerts, left = LeftAlerts(), {1: Why("gone", 100.0), 2: Why("removed", 10.0)}
    assert alerts.due(left, 1000.0) == {}
    assert alerts.due(left, 1009.9) == {}
    assert alerts.due(left, 1010.0) == {2: "removed"}
    assert alerts.due({1: left[1]}, 1099.9) == {}
    assert alerts.due({}, 1099.95) == {}
    assert alerts.due(left, 1101.0) == {}
    assert alerts.due(left, 1201.0) == {1: "gone", 2: "removed"}


@pytest.mark.parametrize("rule", ["battery-low", "failsafe"])
def test_the_end_says_why_once_and_nothing_of_it_is_left_when_the_drone_is_back(rule: str) -> None:
    world = HubWorld()
    world.apply(record(1, (1,)))
    watcher = world.browser(1)
    stored: list[Alert] = []
    alert = Alert(5, BY_NAME[rule], "", DroneId(1), "It is low.", NOW)
    world.hub.alerts.restore([alert], 0.0)
    world.hub.alerts.listeners.append(lambda one: stored.append(replace(one)))
    world.hub.alerts.end(5, "gone")
    world.hub.alerts.end(5, "again")
    world.hub.alerts.end(6, "unknown")
    assert [(one.id, one.closed_at, one.closed_why) for one in stored] == [(5, NOW, "gone")]
    assert AlertView.of(alert).closed_why == "gone"
    assert watcher.events()
    agent = world.agent(1)
    world.hub.reports.receive(agent.link, AutopilotState(heard=True, armed=True, airborne=True), NOW)
    for tenth in range(1, 100):
        world.hub.tick(tenth / 10)
    assert [one for one in world.hub.alerts.live() if one.rule.name == rule and one.closed_at is None] == []
