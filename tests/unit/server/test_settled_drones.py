"""A drone that nobody flies costs little at each tick, and still its silence, its lease and its link count at once."""

from dataclasses import replace

from hub_world import NOW, FakeAgent, HubWorld, heartbeat, record
from safety_scene import ADMIN, ALICE, HELD, ONE

from server.kernel.fleet import LoanRecord
from server.link.core.agent_link import SILENT_AFTER_S, AgentLink
from server.live import live_messages as live
from server.live.live_drone import LiveDrone
from server.live.live_state import MAX_PUBLISHED_AT_ONCE
from wire.ids import DroneId

TICK_S = 0.1


def settled(world: HubWorld, number: int = 1) -> tuple[FakeAgent, LiveDrone]:
    """A drone whose link was heard at 1.0 s, after it was looked at as one that nobody flies."""
    agent = world.agent(number)
    drone = world.hub.state.drones[DroneId(number)]
    agent.send(heartbeat(), now=0.5)
    world.hub.tick(0.5)
    world.hub.tick(0.6)
    assert drone.settled_lease is drone.lease
    agent.send(heartbeat(), now=1.0)
    return agent, drone


def offline_at(world: HubWorld, drone: LiveDrone) -> float:
    for tick in range(100):
        now = 1.0 + tick * TICK_S
        world.hub.tick(now)
        if not drone.online:
            return now
    raise AssertionError("it never went offline")


def test_a_settled_drone_is_silent_at_the_same_tick_as_one_that_is_held() -> None:
    quiet, flown = HubWorld(), HubWorld()
    _, quiet_drone = settled(quiet)
    _, flown_drone = settled(flown)
    flown.hub.apply_lease(ONE, HELD, event="acquired", by=ALICE, reason="", now=1.0)
    at = offline_at(quiet, quiet_drone)
    assert at == offline_at(flown, flown_drone)
    assert SILENT_AFTER_S < at - 1.0 <= SILENT_AFTER_S + 2 * TICK_S


def test_a_lease_and_a_loan_count_at_the_next_tick() -> None:
    world = HubWorld()
    agent, drone = settled(world)
    world.hub.apply_lease(ONE, HELD, event="acquired", by=ADMIN, reason="", now=1.0)
    world.hub.tick(1.1)
    assert drone.settled_lease is None
    assert agent.link.sealed.keepalive.next_ping_at < 2.0, "the tower measures the round trip itself"

    world = HubWorld()
    _, drone = settled(world)
    loan = LoanRecord(user=ALICE, may_arm=True, until=NOW.replace(year=2100), max_height_m=50.0, radius_m=None)
    world.apply(replace(record(1, (1,)), loans=(loan,)), record(2, (2,)))
    world.hub.tick(1.1)
    assert drone.settled_lease is None


def test_a_new_record_of_a_drone_that_nobody_flies_settles_again() -> None:
    world = HubWorld()
    _, drone = settled(world)
    world.apply(replace(record(1, (1,)), name="Merlin"), record(2, (2,)))
    assert drone.settled_record is not drone.record
    world.hub.tick(1.1)
    assert drone.settled_record is drone.record


def test_wants_time_is_what_its_parts_say() -> None:
    world = HubWorld()

    def as_its_parts_say(link: AgentLink, now: float) -> bool:
        return bool(link._repeats) or link.sealed.has_to_send(now) or not link.is_heard(now)

    new = FakeAgent(world.hub, 2, link_id=300)
    assert new.link.wants_time(0.1), "no datagram has come yet"
    agent, drone = settled(world)
    seen = set()
    for tick in range(60):
        now = 1.0 + tick * TICK_S
        if tick == 5:
            world.hub.state.send_holder_to_agent(drone)
        for link in (agent.link, new.link):
            assert link.wants_time(now) == as_its_parts_say(link, now)
            seen.add(link.wants_time(now))
        if tick % 7 == 0:
            world.hub.tick(now)
    assert seen == {True, False}


def test_many_drones_that_fall_silent_at_once_are_told_in_slices() -> None:
    """A machine with all their agents fails: in one piece a thousand of them stop the tower for a tenth of a second."""
    world = HubWorld()
    count = 3 * MAX_PUBLISHED_AT_ONCE + 5
    world.apply(*(record(number, (1,)) for number in range(1, count + 1)))
    for number in range(1, count + 1):
        world.agent(number)
    alice = world.browser(1)
    world.hub.tick(1.0)
    alice.events()
    world.hub.tick(10.0)
    assert not any(drone.online for drone in world.hub.state.drones.values())
    told: list[int] = []
    slices = 0
    while True:
        silent = [one.drone.id for one in alice.events() if isinstance(one, live.DroneChanged)]
        assert len(silent) <= MAX_PUBLISHED_AT_ONCE
        told += silent
        slices += 1
        if not world.hub.state.publish_waiting():
            told += [one.drone.id for one in alice.events() if isinstance(one, live.DroneChanged)]
            break
    assert sorted(told) == list(range(1, count + 1))
    assert slices >= 3


def test_a_drone_that_is_removed_while_it_waits_is_told_of_no_more() -> None:
    world = HubWorld()
    count = MAX_PUBLISHED_AT_ONCE + 2
    world.apply(*(record(number, (1,)) for number in range(1, count + 1)))
    for number in range(1, count + 1):
        world.agent(number)
    alice = world.browser(1)
    world.hub.tick(10.0)
    world.apply(*(record(number, (1,)) for number in range(1, count)))
    alice.events()
    assert not world.hub.state.publish_waiting()
    assert [one.drone.id for one in alice.events() if isinstance(one, live.DroneChanged)] == [count - 1]
