"""What a page learns of a drone that fell silent before the page was opened."""

from dataclasses import replace
from datetime import datetime, timedelta

import pytest
from hub_world import NOW, FakeAgent, FakeBrowser, HubWorld, heartbeat, record

from server.fleet.core.views import LastHeardView
from server.kernel.fleet import TeamRecord
from server.kernel.people import Role, UserRef
from server.kernel.relations import TeamRole
from server.live import live_messages as live
from server.live.live_drone import LeaseView, LiveDrone
from wire.control_messages import AutopilotState
from wire.dialect import build, mavlink
from wire.ids import DroneId, Epoch, UserId

AIR = AutopilotState(heard=True, armed=True, airborne=True)
GROUND = AutopilotState(heard=True, armed=False, airborne=False)
UNHEARD = AutopilotState(heard=False, armed=False, airborne=False)
ALICE = UserId(1)


def position(lat_e7: int = 473_977_000) -> bytes:
    message = mavlink.MAVLink_global_position_int_message(1, lat_e7, 85_456_000, 500_000, 12_000, 0, 0, 0, 0)
    return build(message, system_id=1, component_id=1, sequence=0)


def flying(world: HubWorld, state: AutopilotState = AIR) -> FakeAgent:
    agent = world.agent(1)
    agent.send(position())
    world.hub.reports.receive(agent.link, state, at=NOW)
    return agent


def drone_of(world: HubWorld) -> LiveDrone:
    return world.hub.state.drones[DroneId(1)]


def last(world: HubWorld, user_id: int = ALICE) -> LastHeardView | None:
    role = Role.ADMIN if user_id == 9 else Role.OPERATOR
    return drone_of(world).view_for(UserId(user_id), role).last_heard


def test_a_drone_that_is_heard_or_never_was_has_none() -> None:
    world = HubWorld()
    assert last(world) is None
    agent = world.agent(1)
    world.hub.detach_link(agent.link)
    assert last(world) is None, "it never reported"
    flying(world)
    assert last(world) is None


def test_a_page_opened_after_the_loss_learns_what_it_did() -> None:
    world = HubWorld()
    world.hub.detach_link(flying(world).link)
    assert last(world) == LastHeardView(
        at=NOW,
        armed=True,
        airborne=True,
        autopilot=3,
        vehicle_type=2,
        custom_mode=5,
        lat=47.3977,
        lon=8.5456,
        height_m=12.0,
    )
    welcome = next(e for e in FakeBrowser(world.hub, ALICE).events() if isinstance(e, live.WelcomeBrowser))
    assert welcome.drones[0].last_heard == last(world)
    flying(world)
    assert last(world) is None, "it is back"
    world.hub.detach_link(flying(world, GROUND).link)
    seen = last(world)
    assert seen is not None and not seen.airborne and not seen.armed


def test_a_link_that_is_only_silent_counts_and_one_that_goes_on_ends_it() -> None:
    world = HubWorld()
    agent = flying(world)
    alice = world.browser(ALICE)
    world.hub.tick(60.0)
    told = [e.drone.last_heard for e in alice.events() if isinstance(e, live.DroneChanged)]
    assert [one and one.airborne for one in told] == [True]
    agent.send(heartbeat(), now=61.0)
    assert last(world) is None


def test_the_first_moment_of_silence_counts() -> None:
    world = HubWorld()
    agent = flying(world)
    world.hub.reports.receive(agent.link, UNHEARD, at=NOW - timedelta(minutes=1))
    world.hub.detach_link(agent.link)
    seen = last(world)
    assert seen is not None and seen.at == NOW - timedelta(minutes=1)
    # A link without a report of its autopilot is no news.
    world.agent(1)
    assert last(world) == seen


def test_a_position_of_long_ago_is_not_where_it_fell_silent() -> None:
    world = HubWorld()
    agent = flying(world)
    agent.send(heartbeat(), now=60.0)
    world.hub.detach_link(agent.link)
    seen = last(world)
    assert seen is not None and (seen.lat, seen.lon, seen.height_m) == (None, None, None)


def test_who_may_not_watch_learns_nothing_of_it() -> None:
    world = HubWorld()
    agent = flying(world)
    admin, alice = UserRef(UserId(9), "admin"), UserRef(ALICE, "alice")
    lease = LeaseView(holder=admin, taken_from=alice, epoch=Epoch(1))
    taken = replace(lease, view_taken=True)
    world.hub.apply_lease(DroneId(1), taken, event="taken", by=admin, reason="", now=0.0)
    world.hub.detach_link(agent.link)
    assert last(world) is None
    assert last(world, 9) is not None


@pytest.mark.parametrize(("since", "knows"), [(NOW - timedelta(hours=1), True), (NOW + timedelta(hours=1), False)])
def test_a_new_team_does_not_learn_where_the_drone_was_before(since: datetime, knows: bool) -> None:
    world = HubWorld()
    world.hub.detach_link(flying(world).link)
    team = TeamRecord(4, "north", {UserId(2): TeamRole.OPERATOR}, since)
    world.apply(replace(record(1, (1,)), team=team), record(2, (2,)))
    assert (last(world, 2) is not None) is knows
    assert last(world) is not None, "its owner knows"
