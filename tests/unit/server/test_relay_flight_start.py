"""The start of a flight: a page opened in flight shows the flight's time, not its own."""

from datetime import UTC, datetime, timedelta

from hub_world import HubWorld

from server.live.flight_start import FlightStart
from server.live.live_drone import LiveDrone
from wire.control_messages import AutopilotState
from wire.ids import DroneId

NOON = datetime(2026, 6, 1, 12, tzinfo=UTC)
MINUTE = timedelta(minutes=1)
GROUND = AutopilotState(heard=True, armed=True, airborne=False)
AIR = AutopilotState(heard=True, armed=True, airborne=True)
UNHEARD = AutopilotState(heard=False, armed=False, airborne=False)


def since_after(*reports: AutopilotState | None) -> int | None:
    """Returns minutes after noon. There is one report a minute; None: the agent disconnects."""
    start = FlightStart()
    for minute, report in enumerate(reports):
        if report is None:
            start.lost()
        else:
            start.report(heard=report.heard, airborne=report.airborne, at=NOON + minute * MINUTE)
    return None if start.since is None else (start.since - NOON) // MINUTE


def test_a_flight_begins_when_a_drone_that_was_on_the_ground_is_in_the_air() -> None:
    assert since_after(GROUND) is None
    assert since_after(GROUND, AIR) == 1
    assert since_after(GROUND, AIR, AIR, AIR) == 1
    assert since_after(GROUND, AIR, GROUND) is None
    assert since_after(GROUND, AIR, GROUND, AIR) == 3


def test_nobody_knows_of_a_drone_that_is_in_the_air_when_it_is_first_heard() -> None:
    assert since_after(AIR) is None
    assert since_after(UNHEARD, AIR) is None
    assert since_after(GROUND, None, AIR) is None
    assert since_after(GROUND, UNHEARD, AIR) is None


def test_a_link_that_breaks_in_flight_does_not_begin_the_flight_anew() -> None:
    assert since_after(GROUND, AIR, None, AIR) == 1
    assert since_after(GROUND, AIR, UNHEARD, AIR) == 1
    assert since_after(GROUND, AIR, None, GROUND) is None


def test_everybody_who_sees_the_drone_is_told_while_it_flies() -> None:
    world = HubWorld()
    agent = world.agent(1)

    def drone() -> LiveDrone:
        found = world.hub.state.drones.get(DroneId(1))
        assert found is not None
        return found

    world.hub.reports.receive(agent.link, GROUND, at=NOON)
    assert drone().view().airborne_since is None
    world.hub.reports.receive(agent.link, AIR, at=NOON + MINUTE)
    assert drone().view().airborne_since == NOON + MINUTE
    world.hub.detach_link(agent.link)
    assert drone().view().airborne_since is None  # no longer known to be in the air
    world.hub.reports.receive(world.agent(1).link, AIR, at=NOON + 2 * MINUTE)
    assert drone().view().airborne_since == NOON + MINUTE
