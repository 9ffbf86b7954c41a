"""The stream profile at the tower: the choice goes to the agent, the profile in force to all who may see the drone."""

from hub_world import HubWorld

from server.live import live_messages as live
from server.live.hub import Hub
from wire.control_messages import StreamSettings, StreamState
from wire.ids import DroneId
from wire.stream_profiles import StreamChoice, StreamProfile

ONE = DroneId(1)
THIN = StreamState(profile=StreamProfile.THIN, chosen=StreamChoice.AUTO, why="15% of the packets are lost")


def shown(hub: Hub) -> tuple[str | None, str, str]:
    drone = hub.state.drones.get(ONE)
    assert drone is not None
    view = drone.view()
    return view.profile, view.profile_chosen, view.profile_why


def test_an_agent_is_told_what_was_chosen_when_it_comes_and_when_it_changes() -> None:
    world = HubWorld()
    world.hub.changes.apply_stream(ONE, StreamSettings(profile=StreamChoice.THIN))
    agent = world.agent(1)
    assert StreamSettings(profile=StreamChoice.THIN) in agent.posted
    other = world.agent(2)
    assert StreamSettings() in other.posted
    agent.posted.clear()
    world.hub.changes.apply_stream(ONE, StreamSettings(profile=StreamChoice.THIN))
    assert agent.posted == []
    world.hub.changes.apply_stream(ONE, StreamSettings())
    assert agent.posted == [StreamSettings()]
    world.hub.changes.apply_stream(DroneId(99), StreamSettings())


def test_who_may_see_the_drone_is_told_what_is_in_force_and_why() -> None:
    world = HubWorld()
    agent, alice, bob = world.agent(1), world.browser(1), world.browser(2)
    assert shown(world.hub) == (None, "auto", "")
    world.hub.reports.receive(agent.link, THIN)
    assert shown(world.hub) == ("thin", "auto", "15% of the packets are lost")
    (reported,) = alice.events()
    assert isinstance(reported, live.DroneChanged)
    assert reported.drone.profile is StreamProfile.THIN
    world.hub.reports.receive(agent.link, THIN)
    assert alice.events() == [], "nothing has changed"
    assert bob.events() == [], "not theirs to see"


def test_a_drone_that_is_gone_sends_nothing_and_an_old_link_says_nothing() -> None:
    world = HubWorld()
    old = world.agent(1)
    new = world.agent(1, link_id=7)
    world.hub.reports.receive(old.link, THIN)
    assert shown(world.hub)[0] is None
    world.hub.reports.receive(new.link, THIN)
    world.hub.detach_link(new.link)
    assert shown(world.hub) == (None, "auto", "")


def test_the_choice_is_shown_while_the_drone_is_away() -> None:
    world = HubWorld()
    alice = world.browser(1)
    world.hub.changes.apply_stream(ONE, StreamSettings(profile=StreamChoice.MINIMAL))
    assert shown(world.hub) == (None, "minimal", "")
    assert len(alice.events()) == 1
