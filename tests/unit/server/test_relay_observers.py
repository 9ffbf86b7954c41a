"""An observer account at the hub: it receives the frames of its drones, and none of its own pass."""

from hub_world import OLGA, HubWorld, command_long, heartbeat, record, sticks

from wire.drops import DropReason
from wire.ids import DroneId, UserId
from wire.tagged import tag


def test_an_owner_who_only_watches_gets_frames_and_sends_none() -> None:
    world = HubWorld()
    world.apply(record(1, (OLGA,)), record(2, (2,)))
    agent = world.agent(1)
    olga = world.browser(OLGA)
    agent.send(heartbeat(1))
    assert len(olga.frames()) == 1
    for frame in (command_long(), sticks()):
        olga.send(tag(DroneId(1), frame))
    assert world.hub.state.drops[DropReason.NOT_IN_CONTROL] == 2
    assert agent.received() == []


def test_a_holder_whose_account_only_watches_by_now_sends_nothing() -> None:
    world = HubWorld()
    world.apply(record(1, (OLGA,), holder=OLGA))
    agent = world.agent(1)
    olga = world.browser(OLGA)
    olga.send(tag(DroneId(1), command_long()))
    assert agent.received() == []
    drone = world.hub.state.drones.get(DroneId(1))
    assert drone is not None and drone.holder_id == UserId(OLGA) and not drone.holder_present()
