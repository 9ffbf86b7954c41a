"""The MAV_CMDs and their parameters for each command, for ArduCopter and for PX4."""

import math
from dataclasses import replace
from typing import Any

import pytest
from hub_world import HubWorld
from pydantic import TypeAdapter, ValidationError

from server.operations.core.flying.bodies import FlightCommand
from server.operations.core.flying.steps import order_of
from server.operations.core.flying.vehicle import (
    UNKNOWN_PLAN,
    NoSuchItem,
    NoSuchMode,
    NotKnownHow,
    NotKnownYet,
    StateNotRestored,
    Vehicle,
)
from server.operations.core.onboard_state import KnownPlan
from server.operations.core.permissions import message_of
from wire.autopilots import arducopter, arduplane, px4_multicopter
from wire.autopilots.commands import VehicleState
from wire.dialect import build, mavlink
from wire.ids import DroneId
from wire.plans import PlanItem, PlanKind, pack_plan
from wire.transactions import CommandWork, Outcome

READ: TypeAdapter[Any] = TypeAdapter(FlightCommand)
STATE = VehicleState("hawk", 5, armed=False, airborne=False, home_alt_m=500.0, mission_items=9)
COPTER = Vehicle(arducopter.PROFILE, STATE)
PX4 = Vehicle(px4_multicopter.PROFILE, replace(STATE, custom_mode=4 << 16 | 4 << 24))
NAN = None
PLACE = {"lat": 47.1, "lon": 8.2}


def but(vehicle: Vehicle, **fields: Any) -> Vehicle:
    return replace(vehicle, state=replace(vehicle.state, **fields))


def works(body: dict[str, Any], vehicle: Vehicle) -> list[CommandWork]:
    order = order_of(READ.validate_python(body), vehicle)
    return [step.work for step in order.steps if not (step.skip and step.skip())]  # type: ignore[misc]


def long(command: int, *params: float | None) -> CommandWork:
    return CommandWork(command, (*params, *[0.0] * (7 - len(params))))  # type: ignore[arg-type]


def at(command: int, frame: int, alt_m: float, *params: float | None) -> CommandWork:
    return CommandWork(command, (*params, 0.0, 0.0, alt_m), 471000000, 82000000, frame)  # type: ignore[arg-type]


CASES: dict[str, tuple[dict[str, Any], list[CommandWork], list[CommandWork]]] = {
    "arm": ({"command": "arm"}, [long(400, 1)], [long(400, 1)]),
    "disarm": ({"command": "disarm"}, [long(400, 0, 0)], [long(400, 0, 0)]),
    "disarm by force": ({"command": "disarm", "force": True}, [long(400, 0, 21196)], [long(400, 0, 21196)]),
    "land": ({"command": "land"}, [long(176, 1, 9)], [long(176, 1, 4, 6)]),
    "rtl": ({"command": "rtl"}, [long(176, 1, 6)], [long(176, 1, 4, 5)]),
    "hold": ({"command": "hold"}, [long(176, 1, 17)], [long(176, 1, 4, 3)]),
    "takeoff": (
        {"command": "takeoff", "height_m": 20},
        [long(176, 1, 4), long(400, 1), long(22, 0, 0, 0, 0, 0, 0, 20)],
        [long(22, NAN, 0, 0, NAN, NAN, NAN, 520), long(400, 1)],
    ),
    "goto": (
        {"command": "goto", **PLACE, "height_m": 30},
        [at(192, 3, 30.0, -1, 1, 0, NAN)],
        [at(192, 0, 530.0, -1, 1, 0, NAN)],
    ),
    "goto with a speed": (
        {"command": "goto", **PLACE, "height_m": 30, "speed_m_s": 7},
        [at(192, 3, 30.0, 7, 1, 0, NAN), long(178, 1, 7, -1)],
        [at(192, 0, 530.0, 7, 1, 0, NAN)],
    ),
    "speed": ({"command": "speed", "m_s": 4}, [long(178, 1, 4, -1)], [long(178, 1, 4, -1)]),
    "set_home here": ({"command": "set_home", "here": True}, [long(179, 1)], [long(179, 1)]),
    "set_home": (
        {"command": "set_home", **PLACE, "altitude_m": 480},
        [at(179, 0, 480.0, 0, 0, 0, 0)],
        [at(179, 0, 480.0, 0, 0, 0, 0)],
    ),
    "roi": (
        {"command": "roi", **PLACE, "height_m": 2},
        [at(195, 3, 2.0, 0, 0, 0, 0)],
        [at(195, 0, 502.0, 0, 0, 0, 0)],
    ),
    "servo": (
        {"command": "servo", "servo": 6, "pulse_us": 1250},
        [long(183, 6, 1250)],
        [long(187, NAN, NAN, NAN, NAN, NAN, -0.5, 0)],
    ),
    "release": ({"command": "gripper", "action": "release"}, [long(211, 1, 0)], [long(211, 1, 0)]),
    "grab": ({"command": "gripper", "action": "grab", "gripper": 2}, [long(211, 2, 1)], [long(211, 2, 1)]),
    "gimbal": (
        {"command": "gimbal", "pitch_deg": -45},
        [long(1001, -2, -2, -1, -1), long(1000, -45, 0, NAN, NAN, 12, 0, 0)],
        [long(1001, -2, -2, -1, -1), long(1000, -45, 0, NAN, NAN, 12, 0, 0)],
    ),
    "no roi": ({"command": "roi", "none": True}, [long(197)], [long(197)]),
    "pause": ({"command": "pause"}, [long(193, 0)], [long(176, 1, 4, 3)]),
    "resume": ({"command": "resume"}, [long(176, 1, 3)], [long(176, 1, 4, 4)]),
    "start": (
        {"command": "start"},
        [long(176, 1, 4), long(400, 1), long(224, 1, 1), long(300)],
        [long(300, 0)],
    ),
    "start with item": (
        {"command": "start", "item": 4, "as_it_is": True},
        [long(176, 1, 4), long(400, 1), long(224, 5, 1), long(300)],
        [long(300, 4)],
    ),
}


SURVEY = (
    PlanItem(16, 3, x=471000000, y=82000000, z=30.0),
    PlanItem(178, 2, (1.0, 8.0, -1.0, 0.0)),
    PlanItem(206, 2, (12.0, 0.0, 1.0, 0.0)),
    *[PlanItem(16, 3, x=471000000 + 1000 * row, y=82000000, z=30.0) for row in range(6)],
)


def flies(vehicle: Vehicle, *items: PlanItem) -> Vehicle:
    """In the air, with this mission on board."""
    plan = KnownPlan(pack_plan(PlanKind.MISSION, items), None)
    flying = but(vehicle, armed=True, airborne=True, mission_items=len(items))
    return replace(flying, plan=plan)


TRIGGER, SPEED = long(206, 12, 0, 1), long(178, 1, 8, -1)


@pytest.mark.parametrize("command", ["start", "jump"])
def test_a_start_in_the_middle_sets_speed_and_camera_again(command: str) -> None:
    copter, px4 = flies(COPTER, *SURVEY), but(flies(PX4, *SURVEY), custom_mode=4 << 16 | 4 << 24)
    body = {"command": command, "item": 5}
    begins = [long(224, 6, 1), TRIGGER, long(300)] if command == "start" else [TRIGGER, long(224, 6, 0)]
    assert works(body, copter) == [*begins, SPEED]
    assert works(body, px4) == [TRIGGER, long(300, 5), SPEED]
    assert TRIGGER not in works({**body, "as_it_is": True}, copter)
    assert works({**body, "item": 1}, copter)[-1] != SPEED, "it comes to the speed itself"


def test_the_item_is_known_whose_effect_is_set_again_before_it_flies() -> None:
    body = READ.validate_python({"command": "start", "item": 5})
    steps = order_of(body, flies(COPTER, *SURVEY)).steps
    assert [step.item for step in steps] == [None, 2, None, None], "the speed is set when it flies already"


def test_a_start_at_the_beginning_sets_nothing() -> None:
    assert works({"command": "start"}, flies(COPTER, *SURVEY)) == [long(224, 1, 1), long(300)]


@pytest.mark.parametrize("command", ["start", "jump"])
def test_a_load_is_not_moved_again_but_named_before_the_start(command: str) -> None:
    vehicle = flies(COPTER, PlanItem(183, 2, (9.0, 1900.0, 0.0, 0.0)), *SURVEY)
    with pytest.raises(StateNotRestored, match=r"hawk would fly from item 6 .* servo 9 at 1900 .*`as_it_is`"):
        works({"command": command, "item": 5}, vehicle)
    assert works({"command": command, "item": 5, "as_it_is": True}, vehicle)


def test_what_an_unknown_plan_has_set_is_not_known() -> None:
    with pytest.raises(StateNotRestored, match="does not know the mission on board of hawk"):
        works({"command": "start", "item": 4}, COPTER)
    assert works({"command": "start", "item": 4, "as_it_is": True}, COPTER)[-1] == long(300)


def test_a_mission_that_is_resumed_from_another_mode_flies_as_before() -> None:
    vehicle = replace(flies(COPTER, *SURVEY), current_item=5)
    assert works({"command": "resume"}, vehicle) == [long(176, 1, 3), TRIGGER, SPEED]
    assert works({"command": "resume"}, but(vehicle, custom_mode=3)) == [long(193, 1)], "nothing was forgotten"
    assert works({"command": "resume"}, replace(vehicle, plan=UNKNOWN_PLAN)) == [long(176, 1, 3)]
    px4 = replace(flies(PX4, *SURVEY), current_item=5)
    assert works({"command": "resume"}, px4) == [long(176, 1, 4, 4), TRIGGER, SPEED]


@pytest.mark.parametrize("name", CASES)
def test_each_autopilot_is_asked_in_its_own_way(name: str) -> None:
    body, of_copter, of_px4 = CASES[name]
    assert works(body, COPTER) == of_copter
    assert works(body, PX4) == of_px4


def test_what_is_done_already_is_left_out() -> None:
    flying = but(COPTER, armed=True, custom_mode=4)
    assert works({"command": "takeoff", "height_m": 5}, flying) == [long(22, 0, 0, 0, 0, 0, 0, 5)]
    assert works({"command": "arm"}, flying) == [long(400, 1)]
    assert works({"command": "start"}, flying) == [long(224, 1, 1), long(300)]
    up = long(22, NAN, 0, 0, NAN, NAN, NAN, 505)
    assert works({"command": "takeoff", "height_m": 5}, but(PX4, armed=True)) == [up]


@pytest.mark.parametrize("body", [{"command": "takeoff", "height_m": 5}, {"command": "start"}])
@pytest.mark.parametrize("vehicle", [COPTER, PX4], ids=["copter", "px4"])
def test_nothing_that_arms_is_begun_where_nobody_knows_whether_it_is_armed(
    vehicle: Vehicle, body: dict[str, object]
) -> None:
    with pytest.raises(NotKnownYet, match="not known whether hawk is armed"):
        works(body, but(vehicle, armed=None))


@pytest.mark.parametrize("mode", [3, 4], ids=["AUTO", "GUIDED"])
def test_what_was_paused_in_its_mode_goes_on_there(mode: int) -> None:
    assert works({"command": "resume"}, but(COPTER, custom_mode=mode)) == [long(193, 1)]


def test_a_jump_counts_arducopters_home_and_px4_jumps_only_while_it_flies_a_mission() -> None:
    jump = {"command": "jump", "item": 3, "as_it_is": True}
    assert works(jump, COPTER) == [long(224, 4, 0)]
    assert works(jump, but(PX4, armed=True)) == [long(300, 3)]
    for vehicle in (PX4, but(PX4, armed=True, custom_mode=4 << 16 | 3 << 24)):
        with pytest.raises(NotKnownHow):
            works(jump, vehicle)


@pytest.mark.parametrize("command", ["jump", "start"])
def test_an_item_that_is_not_on_board_is_refused_where_it_is_known(command: str) -> None:
    body = {"command": command, "item": 9, "as_it_is": True}
    with pytest.raises(NoSuchItem, match="item 10: the mission on board has 9 items"):
        works(body, COPTER)
    with pytest.raises(NoSuchItem, match="no mission is on board"):
        works(body, but(COPTER, mission_items=0))
    assert works(body, but(COPTER, mission_items=None))


@pytest.mark.parametrize(
    ("deg", "relative", "params"),
    [(90, False, (90, 0, 0, 0)), (-90, False, (270, 0, 0, 0)), (360, False, (0, 0, 0, 0)), (-30, True, (30, 0, -1, 1))],
)
def test_headings_and_turns(deg: float, relative: bool, params: tuple[float, ...]) -> None:
    body = {"command": "yaw", "deg": deg, "relative": relative}
    assert works(body, COPTER) == works(body | {"command": "turn"}, COPTER) == [long(115, *params)]


def test_px4_turns_where_it_is_and_leaves_what_it_flies_for_it() -> None:
    there = but(PX4, place_deg=(47.1, 8.2), height_m=30.0, heading_deg=350.0)
    to, by = {"command": "turn", "deg": 90}, {"command": "turn", "deg": 20, "relative": True}
    assert works(to, there) == [at(192, 0, 530.0, -1, 1, 0, math.pi / 2)]
    assert works(by, there)[0].params[3] == pytest.approx(math.radians(10))
    assert order_of(READ.validate_python(to), there).overrules
    assert not order_of(READ.validate_python(to), COPTER).overrules
    for unknown in ({"place_deg": None}, {"height_m": None}, {"home_alt_m": None}):
        with pytest.raises(NotKnownYet, match="hawk"):
            works(to, but(there, **unknown))
    with pytest.raises(NotKnownYet, match="the heading of hawk"):
        works(by, but(there, heading_deg=None))


def test_a_go_to_may_say_which_way_to_look() -> None:
    body = {"command": "goto", **PLACE, "height_m": 30, "heading_deg": 270}
    yaw = -math.pi / 2
    assert works(body, COPTER) == [at(192, 3, 30.0, -1, 1, 0, yaw), long(115, 270, 0, 0, 0)]
    assert works(body, PX4) == [at(192, 0, 530.0, -1, 1, 0, yaw)]


@pytest.mark.parametrize("vehicle", [COPTER, PX4], ids=["copter", "px4"])
def test_a_home_without_a_height_is_as_high_as_the_present_one(vehicle: Vehicle) -> None:
    body = {"command": "set_home", **PLACE}
    assert works(body, vehicle) == [at(179, 0, 500.0, 0, 0, 0, 0)]
    with pytest.raises(NotKnownYet, match="the home of hawk"):
        works(body, but(vehicle, home_alt_m=None))


def test_an_orbit_is_px4s() -> None:
    body = {"command": "orbit", **PLACE, "radius_m": -25, "height_m": 30}
    assert works(body, PX4) == [at(34, 0, 530.0, -25, NAN, 0, NAN)]
    with pytest.raises(NotKnownHow, match="hawk"):
        works(body, COPTER)


@pytest.mark.parametrize("name", ["ALT_HOLD", "alt hold", " Alt_Hold "])
def test_modes_go_by_the_names_of_the_autopilot(name: str) -> None:
    assert works({"command": "mode", "mode": name}, COPTER) == [long(176, 1, 2)]
    with pytest.raises(NoSuchMode, match=r"AUTO\.LOITER"):
        works({"command": "mode", "mode": name}, PX4)


@pytest.mark.parametrize("name", ["AUTO.RTL", "rtl", "RETURN"])
def test_px4s_modes_also_go_by_the_names_that_people_see(name: str) -> None:
    assert works({"command": "mode", "mode": name}, PX4) == [long(176, 1, 4, 5)]


def test_px4_needs_to_know_where_home_is() -> None:
    with pytest.raises(NotKnownYet):
        works({"command": "goto", **PLACE, "height_m": 30}, but(PX4, home_alt_m=None))
    assert works({"command": "goto", **PLACE, "height_m": 30}, but(COPTER, home_alt_m=None))


@pytest.mark.parametrize(
    "body",
    [
        {"command": "takeoff", "height_m": 0},
        {"command": "takeoff", "height_m": math.nan},
        {"command": "goto", "lat": 91, "lon": 0, "height_m": 1},
        {"command": "goto", **PLACE},
        {"command": "set_home"},
        {"command": "set_home", "here": True, **PLACE, "altitude_m": 1},
        {"command": "roi", **PLACE},
        {"command": "orbit", **PLACE, "radius_m": 0.5, "height_m": 1},
        {"command": "jump", "item": -1},
        {"command": "arm", "force": True},
        {"command": "fly"},
        {},
    ],
)
def test_what_makes_no_sense_is_refused(body: dict[str, Any]) -> None:
    with pytest.raises(ValidationError):
        READ.validate_python(body)


def test_the_words_name_the_drone_and_the_step() -> None:
    order = order_of(READ.validate_python({"command": "takeoff", "height_m": 20}), COPTER)
    arming = order.steps[1]
    assert order.result_text(arming, Outcome.FAILED, "The autopilot tried and failed.", None) == (
        "hawk, arming: The autopilot tried and failed."
    )
    assert order.result_text(order.steps[2], Outcome.DONE, "", None) == "hawk accepted, now climbing to 20 m."
    assert order.result_text(order.steps[2], Outcome.DONE, "Accepted, not confirmed yet: it stands still.", False) == (
        "hawk, climbing to 20 m: Accepted, not confirmed yet: it stands still."
    )


def test_a_work_becomes_the_message_that_the_agent_sends() -> None:
    placed = message_of(at(192, 3, 30.0, -1, 1, 0, NAN))
    assert (placed.get_type(), placed.x, placed.y, placed.z, placed.frame) == (
        "COMMAND_INT",
        471000000,
        82000000,
        30.0,
        3,
    )
    assert math.isnan(placed.param4)
    assert message_of(long(400, 1)).get_type() == "COMMAND_LONG"


def test_the_vehicle_is_as_its_newest_heartbeat_says() -> None:
    world = HubWorld()
    agent = world.agent(1, heard=False)
    drone = world.hub.state.drones.get(DroneId(1))
    assert drone is not None
    with pytest.raises(NotKnownYet):
        Vehicle.of(drone, 0.0)

    def beat(vehicle_type: int, autopilot: int, component: int = 1) -> None:
        message = mavlink.MAVLink_heartbeat_message(vehicle_type, autopilot, 81, 17, 4, 3)
        agent.send(build(message, system_id=1, component_id=component, sequence=0))

    beat(mavlink.MAV_TYPE_HEXAROTOR, mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA)
    beat(mavlink.MAV_TYPE_GIMBAL, mavlink.MAV_AUTOPILOT_INVALID, component=154)
    seen = Vehicle.of(drone, 0.0)
    state = seen.state
    assert (seen.profile.key, state.custom_mode, state.home_alt_m, state.mission_items) == (
        "arducopter",
        17,
        None,
        None,
    )
    beat(mavlink.MAV_TYPE_FIXED_WING, mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA)
    assert Vehicle.of(drone, 0.0).profile is arduplane.PROFILE
    beat(mavlink.MAV_TYPE_AIRSHIP, mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA)
    with pytest.raises(NotKnownHow):
        Vehicle.of(drone, 0.0)


def test_a_place_that_is_old_is_none() -> None:
    world = HubWorld()
    agent = world.agent(1)
    drone = world.hub.state.drones.get(DroneId(1))
    assert drone is not None
    place = mavlink.MAVLink_global_position_int_message(0, 471000000, 82000000, 530000, 30000, 0, 0, 0, 9000)
    agent.send(build(place, system_id=1, component_id=1, sequence=0), now=1.0)
    fresh, old = Vehicle.of(drone, 3.9).state, Vehicle.of(drone, 4.1).state
    assert (fresh.place_deg, fresh.height_m, fresh.heading_deg) == ((47.1, 8.2), 30.0, 90.0)
    assert (old.place_deg, old.height_m, old.heading_deg) == (None, None, None)
