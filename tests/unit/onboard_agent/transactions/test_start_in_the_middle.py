"""A survey that is started or resumed in the middle is flown as it was planned: the tower's steps, the agent, and a
simulated vehicle."""

from __future__ import annotations

from typing import Any

import pytest
from drone_world import BRAKE, GUIDED, SET_MODE, DroneWorld

from server.operations.core.flying import bodies
from server.operations.core.flying.steps import order_of
from server.operations.core.flying.vehicle import Vehicle
from server.operations.core.onboard_state import KnownPlan
from simulator.ardupilot import ARDUPILOT
from simulator.flavour import Flavour
from simulator.px4.flavour import PX4
from simulator.px4.modes import Px4Mode
from wire.autopilots import registry
from wire.autopilots.commands import VehicleState
from wire.plans import PlanItem, PlanKind
from wire.transactions import CommandWork, Outcome, PlanOnBoard, PlanUploadWork

PLANNED_M_S, EVERY_M, START_AT = 3.0, 10.0, 4


def way(north: int) -> PlanItem:
    return PlanItem(16, 3, (0.0, 0.0, 0.0, 0.0), 473977420 + north * 90, 85455940, 15.0)


SURVEY = (
    way(0),
    PlanItem(178, 2, (1.0, PLANNED_M_S, -1.0, 0.0)),
    PlanItem(206, 2, (EVERY_M, 0.0, 0.0, 0.0)),
    way(5),
    way(100),
    way(300),
)


def as_vehicle(world: DroneWorld, current_item: int = 0) -> Vehicle:
    """What the tower knows of it."""
    flight = world.vehicle.flight
    plan = [one for one in world.reported if isinstance(one, PlanOnBoard) and one.kind == PlanKind.MISSION][-1]
    profile = registry.of(world.onboard.autopilot.kind, 2)
    assert profile is not None
    mode = int(flight.mode) if not isinstance(flight.mode, Px4Mode) else world.onboard.autopilot.custom_mode
    state = VehicleState(
        "hawk", mode, armed=flight.armed, airborne=not flight.landed, home_alt_m=488.0, mission_items=plan.count
    )
    return Vehicle(profile, state, KnownPlan(plan.plan, None), current_item)


def carry_out(world: DroneWorld, body: Any, current_item: int = 0) -> None:
    for step in order_of(body, as_vehicle(world, current_item)).steps:
        if step.skip is None or not step.skip():
            assert isinstance(step.work, CommandWork)
            result = world.do(step.work, deadline_s=8.0)
            assert result.outcome is Outcome.DONE, (step.phase, result.words)


def survey(flavour: Flavour) -> DroneWorld:
    world = DroneWorld(flavour=flavour).ready()
    assert world.do(PlanUploadWork(PlanKind.MISSION, SURVEY)).outcome is Outcome.DONE
    if flavour is PX4:
        carry_out(world, bodies.TakeOff(command="takeoff", height_m=10))
        world.until(lambda: world.vehicle.flight.alt_over_home_m() > 9.0)
        return world
    return world.flies(GUIDED)


def flown(world: DroneWorld) -> tuple[float, int]:
    """The fastest and the number of photographs of ten seconds on the way."""
    world.run(4.0)
    taken, fastest = world.vehicle.flight.camera.taken, 0.0
    for _ in range(20):
        world.run(0.5)
        fastest = max(fastest, world.vehicle.flight.body.ground_speed_mps())
    return fastest, world.vehicle.flight.camera.taken - taken


@pytest.mark.parametrize("flavour", [ARDUPILOT, PX4], ids=["arducopter", "px4"])
def test_a_start_in_the_middle_flies_at_the_planned_speed_with_the_camera_on(flavour: Flavour) -> None:
    world = survey(flavour)
    carry_out(world, bodies.Start(command="start", item=START_AT))
    fastest, taken = flown(world)
    assert fastest == pytest.approx(PLANNED_M_S, abs=0.3)
    assert 2 <= taken <= 4, "three in thirty metres"


def test_as_it_is_it_flies_as_nobody_planned_it() -> None:
    """Without this the test above would prove nothing."""
    world = survey(ARDUPILOT)
    carry_out(world, bodies.Start(command="start", item=START_AT, as_it_is=True))
    fastest, taken = flown(world)
    assert fastest > PLANNED_M_S + 2.0
    assert taken == 0


def test_a_mission_that_is_resumed_from_another_mode_keeps_its_speed() -> None:
    world = survey(ARDUPILOT)
    carry_out(world, bodies.Start(command="start", item=START_AT))
    world.run(5.0)
    assert world.command(SET_MODE, 1, BRAKE).outcome is Outcome.DONE
    world.run(3.0)
    carry_out(world, bodies.Simple(command="resume"), current_item=world.vehicle.flight.plans.current - 1)
    fastest, taken = flown(world)
    assert fastest == pytest.approx(PLANNED_M_S, abs=0.3)
    assert taken >= 2
