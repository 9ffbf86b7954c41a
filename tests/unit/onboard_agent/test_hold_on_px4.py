"""A hold on the simulated PX4: the agent's own sticks are no pilot's, and the failsafe's Hold is no hold."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import product
from typing import Any, Final

import pytest
from worlds.held_copter import ARM, HeldCopter, command
from worlds.simulated_copter import HOME, SimulatedCopter
from worlds.tiers import thinned

from simulator.flight import Flight
from simulator.px4.failsafe import BATTERY_CRITICAL, RETURN, STICKS_LOST, Px4Failsafes
from simulator.px4.flavour import PX4
from simulator.px4.modes import Px4Mode
from simulator.receiver import Receiver
from wire.dialect import mavlink
from wire.open_holds import AfterSticks, HoldStage, Lost, LostAction, LostPhase

SET_UP: Final = {"COM_RC_IN_MODE": 1.0, "NAV_RCL_ACT": 2.0, "COM_RCL_EXCEPT": 7.0}
"""As documented for a drone without a receiver."""
UP_M: Final = 25.0
WATCH_S: Final = 20.0
"""The failsafe's Hold, its delay, and a return that is seen."""
LADDERS: Final = [(), ("AUTO.LOITER",)]


def up(
    receiver: Receiver = Receiver.NONE, *, ladder: tuple[str, ...] = (), parameters: Mapping[str, float] = SET_UP
) -> HeldCopter:
    """At UP_M in AUTO.LOITER, with centred sticks."""
    flight = {"boot_s": 1.0, "receiver": receiver}
    copter: Any = SimulatedCopter(50.0, flight=flight, flavour=PX4, parameters=tuple(parameters.items()))
    world = HeldCopter(copter, knows_s=9.0, hold_ladder=ladder, lost_action="stay")
    world.hand = (0, 500)
    world.send(ARM)
    world.pass_time(0.5)
    nan = math.nan
    world.send(command(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, nan, nan, nan, HOME.alt_amsl_m + UP_M))
    world.pass_until(lambda: of(world).mode is Px4Mode.LOITER and world.copter.height_m > UP_M - 0.5)
    return world


def of(world: HeldCopter) -> Flight:
    copter: Any = world.copter
    flight: Flight = copter.vehicle.flight
    return flight


def by_hand(world: HeldCopter, pitch: int, throttle: int) -> None:
    world.send(command(mavlink.MAV_CMD_DO_SET_MODE, 1, 3, 0))
    world.pass_time(1.0)
    world.hand = (pitch, throttle)
    world.pass_time(2.0)
    assert of(world).mode is Px4Mode.POSCTL


def modes_while(world: HeldCopter, seconds: float) -> list[Px4Mode]:
    """Each mode that it was in, in order."""
    modes: list[Px4Mode] = []
    for _ in range(round(seconds / world.step_s)):
        world.pass_time(world.step_s)
        if Px4Mode(of(world).mode) not in modes[-1:]:
            modes.append(Px4Mode(of(world).mode))
    return modes


def failsafes(world: HeldCopter) -> Px4Failsafes:
    own = of(world).failsafes
    assert isinstance(own, Px4Failsafes)
    return own


@pytest.mark.parametrize("ladder", LADDERS)
@pytest.mark.parametrize(("pitch", "throttle"), [(0, 1000), (0, 0), (1000, 500)], ids=["climb", "descent", "forward"])
def test_its_own_jump_to_centred_sticks_does_not_end_the_hold(
    ladder: tuple[str, ...], pitch: int, throttle: int
) -> None:
    world = up(ladder=ladder)
    by_hand(world, pitch, throttle)
    world.take()
    assert modes_while(world, WATCH_S) == [Px4Mode.POSCTL, Px4Mode.ALTCTL, Px4Mode.LOITER]
    assert not failsafes(world).has_chosen
    assert (world.state.stage, world.state.mode) == (HoldStage.STAY, "AUTO.LOITER")
    assert (world.state.sticks, world.state.after_sticks) == (False, AfterSticks.STAYS)


def test_without_the_override_by_sticks_it_need_not_wait() -> None:
    world = up(ladder=("AUTO.LOITER",), parameters=SET_UP | {"COM_RC_OVERRIDE": 0.0})
    by_hand(world, 0, 1000)
    world.take()
    assert modes_while(world, WATCH_S) == [Px4Mode.POSCTL, Px4Mode.LOITER]
    assert world.state.stage is HoldStage.STAY


def test_a_hold_that_sticks_ended_is_asked_for_again_and_told() -> None:
    world = up()
    by_hand(world, 0, 1000)
    world.take()
    world.pass_until(lambda: world.state.stage is HoldStage.STAY)
    failsafes(world).mode_commanded()
    of(world).set_mode(Px4Mode.POSCTL)
    world.pass_until(lambda: world.state.stage is HoldStage.ALTITUDE, within_s=0.5)
    assert (world.state.mode, world.state.sticks) == ("POSCTL", True)
    assert modes_while(world, WATCH_S)[-1] is Px4Mode.LOITER
    assert not failsafes(world).has_chosen
    assert world.state.stage is HoldStage.STAY


def test_a_hold_of_the_failsafe_for_missing_sticks_is_no_hold() -> None:
    world = up()
    by_hand(world, 0, 1000)
    world.take()
    world.pass_until(lambda: world.state.stage is HoldStage.STAY)
    failsafes(world)._begin(of(world), RETURN, STICKS_LOST)
    assert failsafes(world).has_chosen
    assert Px4Mode.RTL not in modes_while(world, WATCH_S)
    assert not failsafes(world).has_chosen
    assert world.state.stage is HoldStage.STAY


def test_a_failsafe_for_another_reason_is_left_alone_and_told_in_words() -> None:
    world = up()
    by_hand(world, 0, 1000)
    world.take()
    world.pass_until(lambda: world.state.stage is HoldStage.STAY)
    world.pass_time(5.0)
    failsafes(world)._begin(of(world), RETURN, BATTERY_CRITICAL)
    world.pass_time(1.5)
    told = "the autopilot: its failsafe holds, and returns in 5 s: the battery is critically low"
    assert world.state.detail == told
    assert modes_while(world, WATCH_S)[-1] is Px4Mode.RTL


@pytest.mark.parametrize(
    ("ladder", "receiver", "source"),
    thinned(product(LADDERS, [Receiver.LOW, Receiver.CENTRED], [0, 3]), every=3, why="another combination of the same"),
)
def test_where_sticks_move_nothing_no_stage_waits_for_them(
    ladder: tuple[str, ...], receiver: Receiver, source: int
) -> None:
    world = up(receiver, ladder=ladder, parameters=SET_UP | {"COM_RC_IN_MODE": float(source)})
    world.send(command(mavlink.MAV_CMD_DO_SET_MODE, 1, 2, 0))
    world.pass_time(2.0)
    assert of(world).mode is Px4Mode.ALTCTL
    taken_at, height_m = world.now, world.copter.height_m
    world.take()
    assert modes_while(world, WATCH_S) == [Px4Mode.ALTCTL, Px4Mode.LOITER]
    assert world.copter.height_m > height_m - 2.0
    assert world.state.stage is HoldStage.STAY
    assert not world.sticks_since(taken_at)


def test_a_transmitter_whose_sticks_count_takes_the_drone_out_of_its_hold() -> None:
    world = up(Receiver.CENTRED, parameters=SET_UP | {"COM_RC_IN_MODE": 3.0})
    world.take()
    world.pass_time(3.0)
    assert world.state.stage is HoldStage.STAY
    sticks = of(world).sticks
    sticks.radio_pwm = [1500, 1500, 1900, *sticks.radio_pwm[3:]]
    world.pass_time(3.0)
    sticks.radio_pwm = [1500, 1500, 1500, *sticks.radio_pwm[3:]]
    assert modes_while(world, 5.0) == [Px4Mode.POSCTL]
    assert not world.state.open


def test_a_receiver_that_moves_nothing_does_not_replace_sticks_that_end() -> None:
    world = up(Receiver.LOW, parameters=SET_UP | {"COM_RCL_EXCEPT": 0.0})
    by_hand(world, 0, 1000)
    world.take()
    assert modes_while(world, WATCH_S) == [Px4Mode.POSCTL, Px4Mode.ALTCTL, Px4Mode.LOITER]
    assert (world.state.sticks, world.state.after_sticks) == (True, AfterSticks.RETURNS)


def test_another_stations_sticks_are_no_receiver() -> None:
    world = up()
    world.hand = None
    copter: Any = world.copter
    for _ in range(60):
        message = mavlink.MAVLink_manual_control_message(1, 0, 0, 500, 0, 0)
        world.copter.receive([frame_of(message, 77)])
        world.pass_time(0.15)
    assert copter.vehicle.flight.sticks.overridden
    assert world.agent._inquiry.has_radio is False


def frame_of(message: Any, system_id: int) -> bytes:
    packer = mavlink.MAVLink(None, srcSystem=system_id, srcComponent=1)
    return bytes(message.pack(packer))


def going_to(place_m: float = 400.0, **how: Any) -> HeldCopter:
    """Towards a place in the north, in AUTO.LOITER, at some speed."""
    world = up(**how)
    world.hand = None
    lat = HOME.lat_deg + place_m / 111_320
    place = (lat, HOME.lon_deg, HOME.alt_amsl_m + UP_M)
    world.send(command(mavlink.MAV_CMD_DO_REPOSITION, -1, 1, 0, math.nan, *place))
    world.pass_until(lambda: of(world).body.vn_mps > 3.0)
    return world


@pytest.mark.parametrize(
    ("receiver", "source"), thinned(product(Receiver, [0, 1, 3]), every=4, why="another combination of the same")
)
def test_a_hold_ends_a_flight_to_a_target(receiver: Receiver, source: int) -> None:
    world = going_to(receiver=receiver, parameters=SET_UP | {"COM_RC_IN_MODE": source})
    world.take()
    world.pass_time(12.0)
    north_m = of(world).body.north_m
    world.pass_time(10.0)
    assert of(world).mode is Px4Mode.LOITER
    assert abs(of(world).body.north_m - north_m) < 2.0


@pytest.mark.parametrize(("action", "mode"), [(2, Px4Mode.RTL), (3, Px4Mode.LAND)])
def test_what_it_does_without_a_ground_station_is_counted(action: int, mode: Px4Mode) -> None:
    world = up(parameters=SET_UP | {"NAV_DLL_ACT": action})
    world.hand = None
    world.holder_is(present=False)
    world.pass_time(5.0)
    told_at, state = world.states()[-1]
    wanted = LostAction.RETURN if action == 2 else LostAction.LAND
    assert (state.phase, state.action, state.lost) == (LostPhase.COUNTING, wanted, Lost.PERSON)
    assert state.due_in_s is not None
    due_at = told_at + state.due_in_s
    world.pass_until(lambda: of(world).mode is mode)
    assert abs(world.now - due_at) < 1.5
    world.pass_time(2.0)
    assert (world.state.phase, world.state.action) == (LostPhase.DONE, wanted)


def test_nothing_is_counted_where_it_does_nothing() -> None:
    world = up(parameters=SET_UP | {"NAV_DLL_ACT": 2, "COM_DLL_EXCEPT": 2})
    world.hand = None
    world.holder_is(present=False)
    world.pass_time(20.0)
    assert (of(world).mode, world.state.action) != (Px4Mode.RTL, LostAction.RETURN)
