"""Flights of controllers on a simulated vehicle and a fake clock: what is flown, and how each way to fail ends."""

from __future__ import annotations

import re
from itertools import pairwise
from typing import Any

import pytest
from controller_world import ControllerWorld
from drone_world import BRAKE, GUIDED, LOITER, RTL, SET_MODE, mavlink

from onboard_agent.autonomy.controller import (
    Controller,
    Direction,
    Finish,
    GoBy,
    GoTo,
    Hold,
    Land,
    Seen,
    TakeOff,
    forward,
)
from onboard_agent.autonomy.core.flight import HANGS_S, HOLDS_HANGS_S, HOLDS_SILENT_S, SILENT_S
from onboard_agent.autonomy.core.lines import DirectionState, Gone, Raised
from onboard_agent.autonomy.scripted import LEG_M, Scripted
from simulator.px4.flavour import PX4
from wire.autopilots import px4_multicopter
from wire.control_messages import ControlChanged, HoldOrder
from wire.controllers import ControllerWork
from wire.transactions import CancelTransaction, Outcome, TransactionProgress


def test_the_script_takes_off_flies_its_square_and_lands() -> None:
    world = ControllerWorld(Scripted())
    world.ready()
    number = world.begin(ControllerWork("scripted", may_take_off=True), deadline_s=300.0)
    corners = set()
    home = world.where[:2]

    def over() -> bool:
        north, east = world.where[0] - home[0], world.where[1] - home[1]
        if world.where[2] > 4:
            corners.add((round(north / LEG_M), round(east / LEG_M)))
        return bool(world.results(number))

    world.until(over, 200.0, "the end")
    result = world.results(number)[-1]
    assert result.outcome is Outcome.DONE, result
    assert "has landed it" in result.words
    assert len(corners) == 4, corners
    assert not world.vehicle.flight.armed
    assert abs(world.where[0] - home[0]) < 1.5
    assert abs(world.where[1] - home[1]) < 1.5
    assert not world.port.running


def test_setpoints_come_at_20_hz_whatever_the_controller_does() -> None:
    class Slow(Controller):
        """One direction a second, with signs of life between them."""

        given = 0

        def step(self, seen: Seen) -> Direction | None:
            if seen.at_s < 1000.0 + self.given:
                return None
            self.given = int(seen.at_s - 1000.0) + 1
            return forward(1.0, for_s=1.5)

    world = ControllerWorld(Slow())
    number = world.flies_by_controller()
    world.run(2.0)
    since = world.now
    world.run(10.0)
    times = [at for at, _ in world.setpoints(since)]
    assert 199 <= len(times) <= 201, len(times)
    assert max(later - earlier for earlier, later in pairwise(times)) <= 0.0801
    assert world.where[0] ** 2 + world.where[1] ** 2 > 5.0**2, "it moves"
    phases = [one.phase for one in world.reported if isinstance(one, TransactionProgress) and one.id == number]
    measured = re.fullmatch(r"survey, flying: ([\d.]+) set-points/s, ([\d.]+) directions/s", phases[-2])
    assert measured, phases[-2]
    assert [float(one) for one in measured.groups()] == pytest.approx([20.0, 1.0], abs=0.5), (
        "counted in whole set-points"
    )


def failures() -> dict[str, Any]:
    def raises(world: ControllerWorld) -> None:
        world.port.report(Raised("ValueError: no"))
        world.port.silent = True

    def killed(world: ControllerWorld) -> None:
        world.port.report(Gone("was killed by signal 9"))
        world.port.silent = True

    def hangs(world: ControllerWorld) -> None:
        world.port.silent = True

    return {"raises": raises, "killed": killed, "hangs": hangs}


@pytest.mark.parametrize("failure", failures())
def test_a_controller_that_fails_leads_to_a_hold_that_is_said(failure: str) -> None:
    world = ControllerWorld()
    number = world.flies_by_controller()
    world.script.give.append(forward(4.0, for_s=5.0))
    world.run(2.0)
    failed_at = world.now
    failures()[failure](world)
    result = world.result(number)
    held_at, mode = world.modes_sent(failed_at)[0]
    assert mode == BRAKE
    assert held_at - failed_at <= 0.5
    if failure == "hangs":  # its last sign of life was up to 0.1 s earlier
        assert held_at - failed_at >= HANGS_S - 0.11
    else:
        assert held_at - failed_at <= 0.05
    assert result.outcome is Outcome.FAILED
    assert "It holds in BRAKE" in result.words
    assert world.vehicle.flight.mode == BRAKE
    world.run(3.0)
    assert not [at for at, _ in world.setpoints(held_at)], "no set-point after the hold began"
    assert not world.port.running
    texts = "".join(one.text for one in world.went_up("STATUSTEXT"))
    assert {"raises": "failed: ValueError: no", "killed": "killed by signal 9", "hangs": "hangs"}[failure] in texts


@pytest.mark.parametrize(
    ("moves", "share", "limit_s"),
    [
        (True, 0.0, HANGS_S),
        (True, 0.5, HANGS_S / 0.5),
        (True, 1.0, SILENT_S),
        (False, 0.0, HOLDS_HANGS_S),
        (False, 0.5, HOLDS_HANGS_S / 0.5),
        (False, 1.0, HOLDS_SILENT_S),
    ],
)
def test_time_for_which_it_waits_for_a_processor_counts_up_to_a_limit(
    moves: bool, share: float, limit_s: float
) -> None:
    """`share`: of its silence in which it waits. Where the drone holds anyway, it may be silent for longer."""
    world = ControllerWorld()
    number = world.flies_by_controller()
    if moves:
        world.script.give.append(forward(1.0, for_s=5.0))
    world.run(1.0)
    silent_at = world.now
    world.port.waits(share)
    world.port.silent = True
    assert "hangs: no sign of life" in world.result(number).words
    held_at, _ = world.modes_sent(silent_at)[0]
    assert limit_s - 0.25 <= held_at - silent_at <= limit_s + 0.1


def test_a_controller_that_gets_a_processor_again_in_time_flies_on() -> None:
    world = ControllerWorld()
    number = world.flies_by_controller()
    world.script.give.append(forward(1.0, for_s=5.0))
    world.run(1.0)
    for _ in range(3):
        world.port.waits(1.0)
        world.port.silent = True
        world.run(SILENT_S - 0.5)
        world.port.waits(0.0)
        world.port.silent = False
        world.run(0.3)
    assert world.results(number) == []


@pytest.mark.parametrize("how", ["order", "hand-over"])
@pytest.mark.parametrize("phase", ["flying", "taking off", "entering"])
def test_no_setpoint_follows_a_hold_or_a_hand_over(how: str, phase: str) -> None:
    world = ControllerWorld()
    if phase == "flying":
        world.flies_by_controller()
        world.script.give.append(forward(4.0, for_s=5.0))
        world.run(1.0)
    elif phase == "entering":
        world.ready().flies(LOITER)
        world.begin(ControllerWork("survey"))
        world.run(0.5)
        assert world.setpoints()
    else:
        world.ready()
        world.script.give.append(TakeOff(20.0))
        world.begin(ControllerWork("survey", may_take_off=True))
        world.until(lambda: world.where[2] > 4.0, what="its climb")
    at = world.now
    if how == "order":
        world.onboard.message(HoldOrder(order_id=1, epoch=world.epoch, reason="TAKE"), world.now)
    else:
        world.onboard.message(ControlChanged(epoch=world.epoch + 1, holder="bob", holder_present=True), world.now)
        world.epoch += 1
    world._collect()
    world.script.give += [forward(4.0)] * 50
    world.run(5.0)
    assert not world.setpoints(at)
    result = world.result()
    assert result.outcome in (Outcome.FAILED, Outcome.STALE_EPOCH)
    assert not world.port.running
    assert world.vehicle.flight.mode != GUIDED


def test_whoever_commands_something_else_ends_it_and_nothing_is_sent_any_more() -> None:
    world = ControllerWorld()
    number = world.flies_by_controller()
    at = world.now
    world.command(SET_MODE, 1, RTL)
    assert world.results(number)[-1].outcome is Outcome.FAILED
    world.run(2.0)
    assert not world.setpoints(at)
    assert world.vehicle.flight.mode == RTL


def test_moved_sticks_and_a_cancel_end_it_with_a_hold() -> None:
    world = ControllerWorld()
    number = world.flies_by_controller()
    world.tower_sends(mavlink.MAVLink_manual_control_message(1, 500, 0, 500, 0, 0))
    assert "sticks were moved" in world.result(number).words
    world.command(SET_MODE, 1, GUIDED)
    number = world.begin(ControllerWork("survey"), deadline_s=300.0)
    world.run(2.0)
    world.onboard.message(CancelTransaction(id=number), world.now)
    result = world.result(number)
    assert (result.outcome, "It holds in BRAKE" in result.words) == (Outcome.CANCELLED, True)


def test_directions_are_acknowledged_and_lead_where_they_say() -> None:
    world = ControllerWorld()
    number = world.flies_by_controller()
    north, east, up_m = world.where
    world.script.give.append(GoBy(forward_m=8.0, up_m=2.0))
    world.until(lambda: world.script.seen[-1].number == 1 and world.script.seen[-1].state is DirectionState.DONE)
    assert (world.where[0] - north) ** 2 + (world.where[1] - east) ** 2 == pytest.approx(64.0, rel=0.25)
    assert world.where[2] == pytest.approx(up_m + 2.0, abs=0.8)
    world.script.give.append(GoTo(0.0, 0.0, 10.0))
    world.until(lambda: world.script.seen[-1].number == 2)
    assert world.script.seen[-1].state is DirectionState.REFUSED
    world.script.give.append(forward(99.0, for_s=0.5))
    world.until(lambda: world.script.seen[-1].number == 3)
    assert (world.script.seen[-1].state, world.script.seen[-1].bounded) == (DirectionState.FLYING, True)
    world.until(lambda: world.script.seen[-1].state is DirectionState.EXPIRED)
    world.script.give += [Hold(), Finish()]
    assert world.result(number).outcome is Outcome.DONE
    assert world.vehicle.flight.mode == BRAKE


def test_no_direction_leads_through_the_fence() -> None:
    world = ControllerWorld()
    world.flies_by_controller(max_distance_m=15.0, max_height_m=12.0)
    north, east, _ = world.where
    for _ in range(10):
        world.script.give.append(forward(5.0, for_s=5.0))
        world.run(2.0)
        away = ((world.where[0] - north) ** 2 + (world.where[1] - east) ** 2) ** 0.5
        assert away < 16.0
    assert away > 12.0


@pytest.mark.parametrize(
    ("options", "airborne", "words"),
    [
        ({}, False, "may not take off"),
        ({"min_height_m": 20.0, "max_height_m": 10.0}, True, "its least height"),
    ],
)
def test_what_is_not_started(options: Any, airborne: bool, words: str) -> None:
    world = ControllerWorld()
    world.ready()
    if airborne:
        world.flies()
    result = world.do(ControllerWork("survey", **options))
    assert result.outcome is Outcome.REFUSED
    assert words in result.words
    assert not world.port.running
    assert not world.setpoints()


def test_one_at_a_time_and_one_that_does_not_load_sends_nothing() -> None:
    world = ControllerWorld()
    world.flies_by_controller()
    assert "another one flies" in world.do(ControllerWork("survey")).words
    other = ControllerWorld()
    other.port.loads = False
    other.ready().flies()
    number = other.begin(ControllerWork("survey"))
    other.port.report(Raised("NoController: there is no controller 'survey'"))
    result = other.result(number)
    assert result.outcome is Outcome.REFUSED
    assert "there is no controller" in result.words
    assert not other.setpoints()
    assert other.vehicle.flight.mode == GUIDED


def test_a_landing_needs_no_controller() -> None:
    world = ControllerWorld()
    number = world.flies_by_controller()
    world.script.give.append(Land())
    world.run(2.0)
    world.port.report(Gone("was killed by signal 9"))
    result = world.result(number)
    assert result.outcome is Outcome.DONE
    assert "has landed it" in result.words


def test_its_setpoints_are_nobody_at_the_controls() -> None:
    """The tower is lost: the lost action comes although set-points go out, and ends them."""
    world = ControllerWorld()
    world.flies_by_controller()
    world.link_down()
    world.until(lambda: world.vehicle.flight.mode != GUIDED, 120.0, "the lost action")
    at = world.now + 0.1
    world.run(3.0)
    assert not world.setpoints(at)
    assert not world.port.running


def test_px4_is_streamed_to_before_it_enters_offboard() -> None:
    world = ControllerWorld(flavour=PX4)
    world.ready()
    world.script.give.append(TakeOff(10.0))
    number = world.begin(ControllerWork("survey", may_take_off=True), deadline_s=300.0)
    offboard = px4_multicopter.PROFILE.roles.setpoints
    assert offboard is not None
    world.until(lambda: world.vehicle.flight.mode == offboard.custom_mode, what="OFFBOARD")
    entered_at = world.now
    assert 18 <= len([at for at, _ in world.setpoints() if at < entered_at]) <= 26
    world.until(lambda: world.script.seen[-1].state is DirectionState.DONE, what="the end of its take-off")
    north = world.where
    world.script.give.append(GoBy(forward_m=6.0))
    world.until(lambda: world.script.seen[-1].number == 2 and world.script.seen[-1].state is DirectionState.DONE)
    assert (world.where[0] - north[0]) ** 2 + (world.where[1] - north[1]) ** 2 > 25.0
    world.port.silent = True
    assert "It holds in AUTO.LOITER" in world.result(number).words


def test_a_take_off_needs_permission_and_stays_within_the_limits() -> None:
    world = ControllerWorld()
    world.ready()
    number = world.begin(ControllerWork("survey", may_take_off=True, max_height_m=10.0), deadline_s=300.0)
    world.script.give.append(TakeOff(11.0))
    world.until(lambda: world.script.seen and world.script.seen[-1].number == 1, what="its answer")
    assert world.script.seen[-1].state is DirectionState.REFUSED
    assert not world.vehicle.flight.armed
    world.port.silent = True
    result = world.result(number)
    assert result.outcome is Outcome.FAILED
    assert "Nothing was sent to the drone" in result.words
    assert not world.setpoints()
