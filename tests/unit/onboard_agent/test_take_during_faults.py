"""A TAKE during each fault of the simulator's flight controller: the real agent and the whole vehicle, on one clock.

It ends in the best hold that the fault leaves, or says that the hold is not confirmed.
"""

from __future__ import annotations

from typing import Any

import pytest
from worlds.held_copter import ARM, HeldCopter, command, mode_command, takeoff
from worlds.simulated_copter import HOME, SimulatedCopter
from worlds.tiers import thinned

from simulator.airframe_model import AirframeModel
from simulator.ardupilot import ARDUPILOT
from simulator.failure_modes import PlannedFailure
from simulator.firmware.fault_table import TABLE, FaultName
from simulator.firmware.states import SystemState
from simulator.flavour import Flavour
from simulator.modes import Mode
from simulator.px4.flavour import PX4
from simulator.receiver import Receiver
from wire.control_messages import HoldCause, HoldProgress, HoldStep
from wire.dialect import mavlink
from wire.open_holds import HoldStage

UP_M = 10.0
FAULT_FOR_S = 2.5
"""From the fault to the TAKE: time enough for every text, and for the commander's landing after a lost motor."""
WATCH_S = 4.0
ENDS = {FaultName.MOTOR_LOSS: HoldStep.NOT_NEEDED, FaultName.MAVLINK_MUTE: HoldStep.UNCONFIRMED}
"""Any other fault ends in a confirmed hold."""
CASES = thinned(
    (
        (flavour, name, by_hand)
        for name in FaultName
        for flavour, by_hand in ((ARDUPILOT, True), (ARDUPILOT, False), (PX4, True))
        if not TABLE[name].needs_sensors or (flavour is ARDUPILOT and by_hand)
    ),
    every=2,
    why="the same fault of another autopilot",
)


def in_the_air(flavour: Flavour, name: FaultName, *, by_hand: bool) -> HeldCopter:
    model = AirframeModel.SENSING if TABLE[name].needs_sensors else AirframeModel.EXACT
    # With a transmitter on, PX4 takes no sticks of a ground station.
    receiver = Receiver.NONE if flavour is PX4 else Receiver.LOW
    flight = {"boot_s": 1.0, "model": model, "receiver": receiver, "commander": True}
    copter: Any = SimulatedCopter(50.0, flight=flight, flavour=flavour)
    world = HeldCopter(copter, knows_s=3.0)
    if flavour is PX4:
        world.hand = (0, 500)
        world.send(ARM)
        world.pass_time(0.5)
        nan = float("nan")
        world.send(command(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, nan, nan, nan, HOME.alt_amsl_m + UP_M))
    else:
        for frame in (mode_command(Mode.GUIDED), ARM, takeoff(UP_M)):
            world.send(frame)
            world.pass_time(0.3)
    world.pass_until(lambda: world.copter.height_m > UP_M - 0.5)
    world.pass_time(2.0)
    if by_hand:
        world.hand = (500, 500)
        world.pass_time(0.3)
        world.send(command(mavlink.MAV_CMD_DO_SET_MODE, 1, 3, 0) if flavour is PX4 else mode_command(Mode.LOITER))
        world.pass_time(2.0)
        assert world.copter.speed_m_s > 2.0
    return world


def ordered(world: HeldCopter) -> list[HoldProgress]:
    return [one for one in world.progress() if one.cause is HoldCause.ORDER]


@pytest.mark.parametrize(("flavour", "name", "by_hand"), CASES)
def test_a_take_ends_in_the_best_hold_or_says_that_it_is_not_confirmed(
    flavour: Flavour, name: FaultName, by_hand: bool
) -> None:
    world = in_the_air(flavour, name, by_hand=by_hand)
    copter: Any = world.copter
    flight, since = copter.vehicle.flight, copter.now - 50.0
    copter.vehicle.plan_failure(PlannedFailure(since, TABLE[name].failure))
    world.pass_time(FAULT_FOR_S)
    world.take()
    world.pass_until(lambda: bool(ordered(world)) and ordered(world)[-1].step.final, within_s=10.0)
    end = ordered(world)[-1]
    assert end.step is ENDS.get(name, HoldStep.CONFIRMED), end
    if end.step is HoldStep.UNCONFIRMED:
        assert "no answer from the autopilot" in end.detail
        assert world.state.stage is HoldStage.NONE
        return
    if end.step is HoldStep.NOT_NEEDED:
        assert "disarmed" in end.detail
        assert (flight.armed, flight.commander.state) == (False, SystemState.SAFE)
        assert copter.height_m < 0.1
        return
    assert world.state.stage is not HoldStage.NONE
    assert flight.mode is not Mode.GUIDED
    world.pass_time(WATCH_S)
    assert copter.height_m > UP_M - 2.0, "it holds its height"
    if name is not FaultName.WIND_GUST:
        assert copter.speed_m_s < 2.5, "nobody's sticks fly it any more"
    if name is FaultName.GPS_LOSS and flavour is ARDUPILOT:
        world.pass_time(6.0)
        assert flight.mode is Mode.ALT_HOLD, "without a position it falls back to the hold that needs none"
        assert (world.state.stage, world.state.waiting_for) == (HoldStage.ALTITUDE, "no position")
