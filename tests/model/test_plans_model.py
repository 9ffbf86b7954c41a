"""Whatever fails during a plan upload, and when, half a plan is never flown and no false result is reported.

`plan_world` has the invariants. These tests supply the events: one at each step of an upload, with mission starts after
it, and random sequences of many.
"""

from __future__ import annotations

from collections.abc import Callable

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from plan_world import ALICE, NEW, OLD, ROOT, THIRD, Event, PlanWorld, State
from worlds.tiers import examples, is_long

UPLOAD_STEPS = 16
"""An upload of NEW over OLD ends within this many steps."""


def unplug(world: PlanWorld) -> None:
    world.unplugged_until = world.now + 2.0


def kill_agent_for_a_moment(world: PlanWorld) -> None:
    world.kill_agent()
    world.start_agent()


def slow_down(world: PlanWorld) -> None:
    world.slow = True


THINGS: dict[str, Callable[[PlanWorld], object]] = {
    "agent killed": PlanWorld.kill_agent,
    "agent killed, and there again": kill_agent_for_a_moment,
    "tower killed": PlanWorld.kill_tower,
    "link cut": PlanWorld.cut,
    "control channel lost": PlanWorld.lose_channel,
    "cancelled": PlanWorld.cancel,
    "taken": lambda world: world.change_hands(ROOT, Event.TAKE),
    "released": lambda world: world.change_hands(ALICE, Event.RELEASE),
    "autopilot rebooted": PlanWorld.reboot_vehicle,
    "autopilot unplugged": unplug,
    "tower not heard": slow_down,
    "another upload": lambda world: world.upload(THIRD),
    "cleared": PlanWorld.clear,
    "started by a frame": lambda world: world.start_mission(by_frame=True),
    "started by an operation": lambda world: world.start_mission(by_frame=False),
    "switched to the mission by radio": PlanWorld.switch_to_mission,
}
AFTER = (0, 3, 30)
"""Steps until the mission starts."""


@pytest.mark.parametrize("thing", THINGS)
def test_one_thing_at_every_step_of_an_upload_and_a_start_after_it(thing: str) -> None:
    """In the short tier at every second one."""
    halves = 0
    ends: set[State] = set()
    for at in range(0, UPLOAD_STEPS, 1 if is_long() else 2):
        world = PlanWorld()
        operation = world.upload(NEW)
        assert operation is not None
        world.run(at)
        THINGS[thing](world)
        for steps in AFTER:
            world.run(steps)
            world.start_mission(by_frame=True)
        world.settle()
        halves += world.halves
        ends.add(operation.state)
    assert halves, "the walk went through no half plan, and shows nothing"
    assert ends


def test_the_walk_is_as_long_as_an_upload() -> None:
    world = PlanWorld()
    operation = world.upload(NEW)
    assert operation is not None
    steps = 0
    while operation.running:
        world.step()
        steps += 1
    assert UPLOAD_STEPS - 4 < steps <= UPLOAD_STEPS
    assert operation.state is State.DONE and world.on_board() == NEW
    world.start_mission(by_frame=True)
    world.run(20)
    assert world.flies_mission and world.flown == {NEW}


@pytest.mark.parametrize("by_frame", [True, False], ids=["frame", "operation"])
@pytest.mark.parametrize("between", [0, 1, 2, 5])
def test_a_start_that_is_on_its_way_when_the_upload_comes_flies_the_old_plan(by_frame: bool, between: int) -> None:
    """The start passes, and no heartbeat shows it yet when the upload arrives."""
    world = PlanWorld()
    world.start_mission(by_frame=by_frame)
    world.run(between)
    operation = world.upload(NEW)
    world.run(20)
    world.settle()
    assert world.flown == {OLD}
    assert operation is not None and operation.state is State.REFUSED


def test_an_upload_that_may_stop_the_mission_stops_one_that_has_just_been_started() -> None:
    world = PlanWorld()
    world.start_mission(by_frame=True)
    operation = world.upload(NEW, while_flying=True)
    world.settle()
    assert operation is not None and operation.state is State.DONE, operation.words
    assert world.on_board() == NEW and not world.flies_mission


STORIES = st.lists(
    st.tuples(st.integers(0, 60), st.sampled_from(sorted({**THINGS, "upload": 0, "start": 0}))), max_size=8
)


@settings(max_examples=examples(15, long=80), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(in_place=st.booleans(), story=STORIES)
@example(in_place=False, story=[(12, "autopilot rebooted"), (130, "taken")])  # during the read-back
def test_any_story(in_place: bool, story: list[tuple[int, str]]) -> None:
    world = PlanWorld(in_place=in_place)
    world.upload(NEW)
    for steps, thing in story:
        world.run(steps)
        if thing == "upload":
            world.upload(THIRD if steps % 2 else NEW)
        elif thing == "start":
            world.start_mission(by_frame=steps % 2 == 0)
        else:
            THINGS[thing](world)
        if world.agent is None and steps % 3 == 0:
            world.start_agent()
        if steps % 5 == 0:
            world.connect()
    world.settle()
