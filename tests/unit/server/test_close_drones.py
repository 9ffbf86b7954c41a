"""Which datagrams are read at once: those of drones that are held or in focus, from every one of their addresses."""

import pytest
from hub_world import FakeAgent, HubWorld, heartbeat

from server.kernel.people import UserRef
from server.link.core import close_drones
from server.link.core.agent_routes import OVER_CHANNEL
from server.link.core.close_drones import close_addresses
from server.live.live_drone import LeaseView
from wire.ids import DroneId, Epoch, UserId

ONE = DroneId(1)


def heard(world: HubWorld, drone_id: int) -> FakeAgent:
    agent = world.agent(drone_id)
    agent.send(heartbeat())
    return agent


def hold(world: HubWorld, holder: UserRef | None) -> None:
    lease = LeaseView(holder=holder, taken_from=None, epoch=Epoch(1))
    world.hub.apply_lease(ONE, lease, event="acquired", by=holder, reason="", now=0.0)


def test_nobody_looks_closely_at_drones_that_are_only_watched() -> None:
    world = HubWorld()
    heard(world, 1)
    world.browser(1)
    assert close_addresses(world.hub.state) == frozenset()


def test_a_drone_in_focus_is_close_until_the_focus_moves_or_the_browser_goes() -> None:
    world = HubWorld()
    agent = heard(world, 1)
    browser = world.browser(1).browser
    world.hub.audience.focus(browser, ONE, 0.0)
    assert close_addresses(world.hub.state) == {agent.address}
    world.hub.audience.focus(browser, None, 0.0)
    assert close_addresses(world.hub.state) == frozenset()
    world.hub.audience.focus(browser, ONE, 0.0)
    world.hub.detach_browser(browser, 0.0)
    assert close_addresses(world.hub.state) == frozenset()


def test_the_focus_of_somebody_who_may_not_see_the_drone_counts_for_nothing() -> None:
    world = HubWorld()
    heard(world, 1)
    stranger = world.browser(2).browser
    world.hub.audience.focus(stranger, ONE, 0.0)
    assert close_addresses(world.hub.state) == frozenset()


def test_a_drone_is_close_while_somebody_holds_it() -> None:
    world = HubWorld()
    agent = heard(world, 1)
    hold(world, UserRef(UserId(1), "alice"))
    assert close_addresses(world.hub.state) == {agent.address}
    hold(world, None)
    assert close_addresses(world.hub.state) == frozenset()


def test_it_follows_a_drone_to_its_next_address_and_leaves_out_the_control_channel() -> None:
    world = HubWorld()
    agent = heard(world, 1)
    world.hub.audience.focus(world.browser(1).browser, ONE, 0.0)
    agent.address = ("203.0.113.7", 9)
    agent.send(heartbeat())
    assert close_addresses(world.hub.state) == {("203.0.113.7", 9)}
    agent.address = OVER_CHANNEL
    agent.send(heartbeat())
    assert close_addresses(world.hub.state) == frozenset()


def test_it_is_bounded_and_drones_in_focus_come_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(close_drones, "MAX_CLOSE", 1)
    world = HubWorld()
    heard(world, 1)
    other = heard(world, 2)
    hold(world, UserRef(UserId(1), "alice"))
    admin = world.browser(9).browser
    world.hub.audience.focus(admin, DroneId(2), 0.0)
    assert close_addresses(world.hub.state) == {other.address}
