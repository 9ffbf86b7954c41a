"""Queued text messages for a browser: states are conflated; events arrive complete and in order."""

from types import SimpleNamespace

import msgspec
from hub_world import HubWorld

from server.kernel.people import Role
from server.link.core.event_queue import MAX_EVENTS, EventQueue
from server.live import live_messages as live
from wire.ids import DroneId, UserId


def changed(world: HubWorld, *, airborne: bool = False) -> live.DroneChanged:
    drone = world.hub.state.drones.get(DroneId(1))
    assert drone is not None
    drone.airborne = airborne
    return live.DroneChanged(drone.view_for(UserId(9), Role.ADMIN))


def test_the_newest_of_a_drone_takes_the_place_of_the_one_that_waits() -> None:
    world, queue = HubWorld(), EventQueue()
    older, newer, ping = changed(world), changed(world, airborne=True), live.Ping(1)
    for event in (older, ping, newer):
        assert queue.put(event)
    assert queue.take() == [newer, ping]
    assert queue.take() == []


def test_only_the_newest_of_how_all_links_are_waits() -> None:
    queue = EventQueue()
    for event in (live.Links([]), live.Ping(1), live.Links([msgspec.Raw(b"{}")])):
        queue.put(event)
    assert queue.take() == [live.Links([msgspec.Raw(b"{}")]), live.Ping(1)]


def test_what_is_said_of_a_drone_before_and_after_it_was_removed_is_not_mixed_up() -> None:
    world, queue = HubWorld(), EventQueue()
    drone = changed(world)
    for event in (drone, live.DroneRemoved(1), drone):
        queue.put(event)
    assert queue.take() == [live.DroneRemoved(1), drone]


def test_it_is_full_of_what_happened_and_never_of_how_something_is() -> None:
    world, queue = HubWorld(), EventQueue()
    for number in range(MAX_EVENTS):
        assert queue.put(live.Ping(number))
    assert not queue.put(live.Ping(0))
    for _ in range(3):
        assert queue.put(changed(world))
    assert len(queue) == MAX_EVENTS + 1


def test_operations_conflate_and_are_bounded_all_the_same() -> None:
    """A pilot can start any number of operations, and each is reported to all who watch."""

    def reported(number: int) -> live.OperationChanged:
        return live.OperationChanged(SimpleNamespace(drone_id=1, id=str(number)))  # type: ignore[arg-type]

    queue = EventQueue()
    assert [queue.put(reported(number)) for number in range(MAX_EVENTS + 1)] == [*[True] * MAX_EVENTS, False]
    assert queue.put(reported(5))
    assert not queue.put(live.Ping(0))
    assert queue.put(live.DroneRemoved(1))
    assert (len(queue), queue.put(live.Ping(0)), len(queue.take())) == (1, True, 2)


def test_a_browser_that_does_not_read_is_closed_and_what_waits_for_it_stays_bounded() -> None:
    alice = HubWorld().browser(1)
    for number in range(2 * MAX_EVENTS):
        alice.browser.notify(live.Ping(number))
    assert {code for code, _ in alice.closed} == {4408}
    assert alice.browser.waiting()[0] == MAX_EVENTS


def test_the_newest_of_what_is_on_board_waits_and_goes_with_the_drone() -> None:
    queue = EventQueue()
    fence, older = (
        live.PlanOnBoardChanged(1, "fence", "known", "f", None, 1, True),
        live.ParametersChanged(1, None, 1, 9),
    )
    mission, newer = (
        live.PlanOnBoardChanged(1, "mission", "known", "m", None, 1, True),
        live.ParametersChanged(1, "h", 9, 9),
    )
    other = live.ParametersChanged(2, "h", 9, 9)
    for event in (fence, older, mission, other, newer):
        queue.put(event)
    assert queue.take() == [fence, newer, mission, other]
    for event in (fence, older, other, live.DroneRemoved(1)):
        queue.put(event)
    assert queue.take() == [other, live.DroneRemoved(1)]
