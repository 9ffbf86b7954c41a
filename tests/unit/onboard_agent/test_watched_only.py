"""A vehicle that nobody has measured is touched by nothing: no stick, no mode, no promise, whatever happens."""

from collections.abc import Callable
from itertools import product
from typing import Final

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from onboard_world import World, frame, order, set_mode, sticks
from worlds.tiers import thinned

from onboard_agent.failsafe.hold_memory import HoldRecord, NoHoldStore
from wire.control_messages import AutopilotState, ControlChanged, SafetySettings
from wire.dialect import decode, mavlink
from wire.open_holds import AfterSticks, HoldState, LostPhase

M: Final = mavlink
ARDUPILOT, PX4, GENERIC = M.MAV_AUTOPILOT_ARDUPILOTMEGA, M.MAV_AUTOPILOT_PX4, M.MAV_AUTOPILOT_GENERIC
COPTER: Final = (ARDUPILOT, M.MAV_TYPE_QUADROTOR)
VEHICLES: Final = {
    "rover": (ARDUPILOT, M.MAV_TYPE_GROUND_ROVER),
    "boat": (ARDUPILOT, M.MAV_TYPE_SURFACE_BOAT),
    "plane": (ARDUPILOT, M.MAV_TYPE_FIXED_WING),
    "quadplane": (ARDUPILOT, 20),
    "submarine": (ARDUPILOT, M.MAV_TYPE_SUBMARINE),
    "airship": (ARDUPILOT, M.MAV_TYPE_AIRSHIP),
    "PX4 plane": (PX4, M.MAV_TYPE_FIXED_WING),
    "PX4 tailsitter": (PX4, 20),
    "PX4 rover": (PX4, M.MAV_TYPE_GROUND_ROVER),
    "another autopilot": (GENERIC, M.MAV_TYPE_QUADROTOR),
}
QUESTIONS: Final = frozenset({"HEARTBEAT", "TIMESYNC", "PARAM_REQUEST_READ", "MISSION_REQUEST_LIST"})
ASKS: Final = frozenset({M.MAV_CMD_SET_MESSAGE_INTERVAL, M.MAV_CMD_REQUEST_MESSAGE})
MODES: Final = (0, 2, 4, 5, 6, 7, 10, 11, 12, 15, 17, 18, 19, 4 << 16)
"""What each of them means depends on the vehicle: flown by hand, holding, returning, a mission."""


def touches(world: World) -> list[str]:
    """Takes what the agent sent, and returns all of it but its presence and its questions."""
    sent = [message for message in map(decode, world.sent) if message is not None]
    world.sent.clear()
    return [
        f"{message.get_type()} {getattr(message, 'command', '')}"
        for message in sent
        if message.get_type() not in QUESTIONS and getattr(message, "command", None) not in ASKS
    ]


def hold_states(world: World) -> list[HoldState]:
    return [one for one in world.reported if isinstance(one, HoldState)]


def promises(world: World) -> list[HoldState]:
    """Reports of a hold, a countdown or an action."""
    return [one for one in hold_states(world) if one.open or one.phase is not LostPhase.QUIET or one.action is not None]


@pytest.mark.parametrize(
    ("mode", "name"), thinned(product([0, 10], VEHICLES), every=3, why="another vehicle of the same kind")
)
def test_a_take_moves_nothing_and_says_so(mode: int, name: str) -> None:
    world = World(vehicle=VEHICLES[name], mode=mode)
    world.onboard.message(order(), world.now)
    world.pass_time(40.0)
    assert touches(world) == []
    assert world.steps() == ["unconfirmed"]
    assert promises(world) == []
    assert hold_states(world)[-1].after_sticks is AfterSticks.UNKNOWN
    assert any(isinstance(one, AutopilotState) and one.watched_only for one in world.reported)


@pytest.mark.parametrize("name", thinned(zip(VEHICLES), every=3, why="another vehicle of the same kind"))
def test_sticks_that_stop_and_a_lost_tower_move_nothing(name: str) -> None:
    world = World(vehicle=VEHICLES[name], mode=0, receiver=False)
    world.configure(lost_action_s=5.0)
    world.climb_to(30.0)
    world.stream(1.0)
    assert touches(world) != [], "those of its operator pass"
    world.pass_time(3.0)
    world.tower_there = False
    world.onboard.link_broken(world.now)
    world.pass_time(40.0)
    assert touches(world) == []
    assert promises(world) == []


def test_what_its_operator_asks_passes_after_a_take() -> None:
    world = World(vehicle=VEHICLES["plane"], mode=5)
    world.onboard.message(order(), world.now)
    world.pass_time(0.1)
    touches(world)
    world.tower_sends(set_mode(11), epoch=6)
    assert world.modes_asked() == [11]
    world.tower_sends(sticks(300), epoch=6)
    assert world.messages("MANUAL_CONTROL"), "nothing was held, so nothing must be centred first"


def test_disarmed_it_is_not_sent_sticks_to_arm() -> None:
    world = World(vehicle=VEHICLES["rover"], mode=0, armed=False, receiver=False)
    world.onboard.message(ControlChanged(epoch=6, holder="ada", holder_present=True), world.now)
    world.pass_time(5.0)
    world.tower_sends(
        frame(M.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0), system_id=255, component_id=190),
        epoch=6,
    )
    world.pass_time(5.0)
    assert touches(world) == ["COMMAND_LONG 400"]


@pytest.mark.parametrize("vehicle", [COPTER, VEHICLES["rover"]], ids=["copter", "rover"])
def test_an_order_before_it_is_known_what_it_is(vehicle: tuple[int, int]) -> None:
    world = World(vehicle=vehicle, mode=0, heard=False)
    world.onboard.message(order(), world.now)
    world.pass_time(0.5)
    assert touches(world) == []
    world.heard = True
    world.pass_time(1.0)
    assert bool(touches(world)) is (vehicle == COPTER)
    assert (world.steps()[-1] == "unconfirmed") is (vehicle != COPTER)
    world.sent.clear()
    world.tower_sends(sticks(300), epoch=6)
    passed = any(stick.x or stick.y or stick.r for stick in world.messages("MANUAL_CONTROL"))
    assert passed is (vehicle != COPTER), "nothing was held, so nothing must be centred first"


class Left(NoHoldStore):
    """What a process before this one left of a hold."""

    def __init__(self, vehicle: tuple[int, int]) -> None:
        kind, vehicle_type = vehicle
        self._record = HoldRecord(
            system_id=1,
            autopilot_kind=kind,
            vehicle_type=vehicle_type,
            sticks=True,
            held=True,
            why="taken",
            settings=SafetySettings(),
        )

    def load(self) -> bytes:
        return msgspec.json.encode(self._record)


def test_after_a_restart_a_copter_gets_its_sticks_at_once_and_an_unknown_vehicle_none() -> None:
    copter = World(mode=0, heard=False, holds=Left(COPTER))
    copter.pass_time(0.2)
    assert "MANUAL_CONTROL " in touches(copter)
    unknown = World(mode=0, heard=False, holds=Left((0, 0)), vehicle=VEHICLES["rover"])
    unknown.pass_time(0.2)
    assert touches(unknown) == []
    unknown.heard = True
    unknown.pass_time(5.0)
    assert touches(unknown) == []
    assert not hold_states(unknown)[-1].open


def test_an_autopilot_that_turns_out_to_be_another_vehicle_is_let_go() -> None:
    world = World(mode=2)
    world.onboard.message(order(), world.now)
    world.pass_time(1.0)
    assert touches(world) != []
    world.vehicle = VEHICLES["rover"]
    world.beat()
    touches(world)
    world.pass_time(20.0)
    assert touches(world) == []
    assert not hold_states(world)[-1].open


EVENTS: Final[dict[str, Callable[[World], None]]] = {
    "order": lambda world: world.onboard.message(order(order_id=int(world.now * 1000)), world.now),
    "control lost": lambda world: world.onboard.message(
        ControlChanged(epoch=5, holder="ada", holder_present=False), world.now
    ),
    "control back": lambda world: world.onboard.message(
        ControlChanged(epoch=5, holder="ada", holder_present=True), world.now
    ),
    "tower silent": lambda world: setattr(world, "tower_there", False),
    "tower back": lambda world: setattr(world, "tower_there", True),
    "autopilot silent": lambda world: setattr(world, "beats", False),
    "autopilot back": lambda world: setattr(world, "beats", True),
    "disarmed": lambda world: setattr(world, "armed", False),
    "armed": lambda world: setattr(world, "armed", True),
    "high": lambda world: world.climb_to(40.0),
    "low": lambda world: world.climb_to(0.0),
    "receiver": lambda world: world.say_receiver(True),
    "no receiver": lambda world: world.say_receiver(False),
}


@given(
    vehicle=st.sampled_from(list(VEHICLES.values())),
    story=st.lists(
        st.tuples(st.sampled_from(list(EVENTS)), st.sampled_from(MODES), st.sampled_from((0.1, 1.0, 6.0, 35.0))),
        max_size=8,
    ),
)
def test_nothing_that_happens_makes_the_agent_move_it(
    vehicle: tuple[int, int], story: list[tuple[str, int, float]]
) -> None:
    world = World(vehicle=vehicle, mode=0)
    for event, mode, seconds in story:
        EVENTS[event](world)
        world.mode = mode
        world.pass_time(seconds)
    assert touches(world) == []
    assert promises(world) == []
