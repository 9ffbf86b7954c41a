"""Commands with acknowledgements take the path of the holder's frames: rules of `CommandHandler`, with a simulated
vehicle.
"""

from __future__ import annotations

from typing import Any

import pytest
from drone_world import (
    ARM,
    GUIDED,
    LOITER,
    RTL,
    SET_MODE,
    TAKEOFF,
    DroneWorld,
    command_work,
    mavlink,
)

from onboard_agent.transactions.command_answer import ANSWER_WITHIN_S, TRIES
from onboard_agent.transactions.command_handler import COMPONENTS
from simulator.failure_modes import Failure
from simulator.modes import Mode
from simulator.px4.flavour import PX4
from simulator.px4.modes import Px4Mode
from wire.control_messages import HoldOrder, HoldProgress, HoldStep
from wire.dialect import build
from wire.transactions import CancelTransaction, CommandWork, Outcome, TransactionProgress, TransactionResult

REPOSITION, CRITICAL = 192, 5


def sticks(x: int) -> Any:
    return mavlink.MAVLink_manual_control_message(1, x, 0, 500, 0, 0)


def says(world: DroneWorld, message: Any) -> None:
    """The autopilot sends a message, once."""
    frame = build(message, system_id=1, component_id=1, sequence=0)
    world._up(world.onboard.from_autopilot([frame], world.now))


def test_a_flight_by_commands_alone_each_with_its_answer_and_the_drones_state() -> None:
    world = DroneWorld().ready()
    result = world.command(SET_MODE, 1, GUIDED)
    assert (result.outcome, result.code) == (Outcome.DONE, "MAV_RESULT_ACCEPTED")
    assert result.words == "The autopilot shows GUIDED. The drone is disarmed, on the ground, in GUIDED."
    assert world.command(ARM, 1).outcome is Outcome.DONE
    assert world.command(TAKEOFF, 0, 0, 0, 0, 0, 0, 10).outcome is Outcome.DONE
    world.until(lambda: world.vehicle.flight.alt_over_home_m() > 9.0)
    goto = CommandWork(
        command=REPOSITION, params=(-1.0, 1.0, 0.0, None, 0.0, 0.0, 15.0), x=473980000, y=85456000, frame=6
    )
    result = world.do(goto)
    assert result.outcome is Outcome.DONE
    assert result.words.endswith("The drone is armed, in the air, in GUIDED.")
    (sent,) = world.commands_sent(REPOSITION)
    assert (sent.get_type(), sent.x, sent.y, sent.z, sent.frame) == ("COMMAND_INT", 473980000, 85456000, 15.0, 6)
    refused = world.command(SET_MODE, 1, 99)
    assert (refused.outcome, refused.code) == (Outcome.FAILED, "MAV_RESULT_FAILED")
    assert world.command(54321).code == "MAV_RESULT_UNSUPPORTED"
    assert not [one for one in world.went_up("COMMAND_ACK") if one.target_component in COMPONENTS]


def test_a_mode_is_done_when_a_heartbeat_shows_it() -> None:
    world = DroneWorld(Failure.MODE_CHANGE_IGNORED).ready()
    result = world.command(SET_MODE, 1, GUIDED, deadline_s=3.0)
    assert result.outcome is Outcome.TIMED_OUT
    assert result.words.startswith("The autopilot accepted GUIDED, but its heartbeat does not show it.")
    asked = [one for one in world.commands_sent(512) if one.get_srcComponent() in COMPONENTS]
    assert len(asked) > 5, "the heartbeat is asked for"


def test_px4_shows_its_mode_when_it_is_asked_to() -> None:
    world = DroneWorld(flavour=PX4).ready()
    began = world.now
    result = world.command(SET_MODE, 1, 4, 3)
    assert (result.outcome, "AUTO.LOITER" in result.words) == (Outcome.DONE, True)
    assert world.now - began < 0.6


def test_a_mode_that_a_px4_accepts_and_does_not_enter_is_asked_for_again() -> None:
    world = DroneWorld(Failure.MODE_CHANGE_IGNORED, flavour=PX4).ready()
    number = world.begin(command_work(SET_MODE, 1, 3, 0), deadline_s=8.0)
    world.run(0.4)
    assert len(world.commands_sent(SET_MODE)) == 1
    world.run(6.0)
    assert len(world.commands_sent(SET_MODE)) == TRIES
    world.run(3.0)
    (result,) = [one for one in world.reported if isinstance(one, TransactionResult) and one.id == number]
    assert (result.outcome, "does not show it" in result.words) == (Outcome.TIMED_OUT, True)


def test_a_mode_that_somebody_else_chose_meanwhile_is_left_as_it_is() -> None:
    world = DroneWorld(Failure.MODE_CHANGE_IGNORED, flavour=PX4).ready()
    world.begin(command_work(SET_MODE, 1, 3, 0), deadline_s=8.0)
    world.run(0.2)
    says(world, mavlink.MAVLink_heartbeat_message(2, 12, 0x81, 2 << 16, 4, 3))
    world.vehicle.flight.set_mode(Px4Mode.ALTCTL)
    world.run(6.0)
    assert len(world.commands_sent(SET_MODE)) == 1


def test_the_same_mode_once_more_is_done_too() -> None:
    world = DroneWorld().ready()
    for _ in range(3):
        assert world.command(SET_MODE, 1, GUIDED).outcome is Outcome.DONE


def test_one_that_nobody_answers_is_repeated_and_the_end_says_that_nobody_knows() -> None:
    world = DroneWorld().ready()
    world.deaf = True
    result = world.command(SET_MODE, 1, RTL, deadline_s=8.0)
    assert (result.outcome, "not known" in result.words) == (Outcome.TIMED_OUT, True)
    assert [one.confirmation for one in world.commands_sent(SET_MODE)] == list(range(TRIES))


def test_a_mode_that_the_heartbeat_shows_is_reached_though_its_answer_is_lost() -> None:
    world = DroneWorld(Failure.COMMAND_ACK_MISSING).ready()
    result = world.command(SET_MODE, 1, RTL, deadline_s=8.0)
    assert (result.outcome, result.code, result.seen) == (Outcome.DONE, "", True)
    assert result.words.startswith("The autopilot shows RTL. Its answer was lost.")


def test_a_heartbeat_that_shows_the_mode_does_not_hide_a_refusal() -> None:
    """It was in that mode already, and refuses to enter it again."""
    world = DroneWorld().ready()
    world.command(SET_MODE, 1, GUIDED)
    world.deaf = True
    number = world.begin(command_work(SET_MODE, 1, GUIDED), deadline_s=8.0)
    world.run(1.2)
    says(world, mavlink.MAVLink_command_ack_message(SET_MODE, 4, 0, 0, 1, COMPONENTS[0]))
    assert world.result(number).code == "MAV_RESULT_FAILED"


@pytest.mark.parametrize(("arm", "state"), [(1, "armed"), (0, "disarmed")])
def test_arming_that_the_heartbeat_shows_is_done_though_its_answer_is_lost(arm: int, state: str) -> None:
    world = DroneWorld().ready()
    world.command(SET_MODE, 1, GUIDED)
    world.command(ARM, 1 - arm)
    world.vehicle.failures.add(Failure.COMMAND_ACK_MISSING)
    result = world.command(ARM, arm, deadline_s=8.0)
    assert result.outcome is Outcome.DONE
    assert result.words.startswith(f"The autopilot shows that it is {state}. Its answer was lost.")


def test_the_hold_of_px4s_failsafe_is_not_the_one_that_was_asked_for() -> None:
    world = DroneWorld(flavour=PX4).ready()
    world.deaf = True
    number = world.begin(command_work(SET_MODE, 1, 4, 3), deadline_s=8.0)
    world.run(0.1)
    for _ in range(8):
        says(world, mavlink.MAVLink_heartbeat_message(2, 12, 0x81, 4 << 16 | 3 << 24, CRITICAL, 3))
        world.vehicle.failures.add(Failure.SILENT)
        world.run(1.0)
    assert world.result(number).outcome is Outcome.TIMED_OUT


@pytest.mark.parametrize("failure", [Failure.COMMAND_INT_ONLY, Failure.COMMAND_LONG_UNKNOWN])
def test_an_autopilot_that_takes_it_in_the_other_message_gets_it_so(failure: Failure) -> None:
    world = DroneWorld().ready()
    world.vehicle.failures.add(failure)
    assert world.command(SET_MODE, 1, GUIDED).outcome is Outcome.DONE
    assert [one.get_type() for one in world.commands_sent(SET_MODE)] == ["COMMAND_LONG", "COMMAND_INT"]
    assert world.command(ARM, 1).outcome is Outcome.DONE
    assert world.command(TAKEOFF, 0, 0, 0, 0, 0, 0, 10).outcome is Outcome.DONE
    world.until(lambda: world.vehicle.flight.alt_over_home_m() > 9.0)
    assert world.vehicle.flight.alt_over_home_m() < 11.0, "the height keeps its meaning"


def test_a_place_whose_height_the_other_message_would_read_differently_is_not_sent_in_it() -> None:
    """Heights of a COMMAND_LONG are above the sea for PX4, above home for others."""
    world = DroneWorld().ready().flies()
    world.vehicle.failures.add(Failure.COMMAND_LONG_ONLY)
    goto = CommandWork(REPOSITION, (-1.0, 1.0, 0.0, None, 0.0, 0.0, 15.0), x=473980000, y=85456000, frame=6)
    result = world.do(goto)
    assert (result.outcome, result.code) == (Outcome.FAILED, "MAV_RESULT_COMMAND_LONG_ONLY")
    assert len(world.commands_sent(REPOSITION)) == 1
    assert "cannot say the same" in result.words


def test_what_takes_longer_than_its_deadline_is_waited_for_while_it_is_in_progress() -> None:
    world = DroneWorld().ready()
    world.vehicle.failures.add(Failure.COMMAND_IN_PROGRESS)
    began = world.now
    number = world.begin(command_work(SET_MODE, 1, GUIDED), deadline_s=8.0)
    result = world.result(number)
    assert (result.outcome, result.code) == (Outcome.DONE, "MAV_RESULT_ACCEPTED")
    assert world.now - began > 11.0
    told = [one for one in world.reported if isinstance(one, TransactionProgress) and one.id == number]
    assert len(told) >= 10, "the tower must wait too"
    assert len(world.commands_sent(SET_MODE)) == 1


def returns_sent(world: DroneWorld) -> int:
    return sum(one.param2 == RTL and one.get_srcComponent() != 191 for one in world.commands_sent(SET_MODE))


def wait_for_an_answer(world: DroneWorld) -> int:
    """Commands a return, which the autopilot does not receive."""
    world.deaf = True
    sent = returns_sent(world)
    number = world.begin(command_work(SET_MODE, 1, RTL), deadline_s=20.0)
    world.run(0.1)
    assert returns_sent(world) == sent + 1
    return number


@pytest.mark.parametrize("how", ["later command", "holder's frame", "hold", "arming frame"])
def test_what_comes_later_is_not_undone_by_a_repetition(how: str) -> None:
    world = DroneWorld().ready().flies()
    number = wait_for_an_answer(world)
    world.deaf = False
    if how == "later command":
        assert world.command(SET_MODE, 1, GUIDED).outcome is Outcome.DONE
    elif how == "holder's frame":
        world.tower_sends(mavlink.MAVLink_command_long_message(1, 1, SET_MODE, 0, 1, GUIDED, 0, 0, 0, 0, 0))
    elif how == "arming frame":
        world.tower_sends(mavlink.MAVLink_command_long_message(1, 1, ARM, 0, 0, 0, 0, 0, 0, 0, 0))
    else:
        world.onboard.message(HoldOrder(order_id=1, epoch=world.epoch, reason="a test"), world.now)
    world.run(ANSWER_WITHIN_S * TRIES)
    assert [one for one in world.commands_sent(SET_MODE) if one.param2 == RTL and one.get_srcComponent() != 191][
        1:
    ] == []
    assert world.vehicle.flight.mode != RTL
    result = world.result(number)
    assert (result.outcome, "not known" in result.words) == (Outcome.TIMED_OUT, True)


def test_an_older_speed_does_not_come_after_a_newer_one() -> None:
    world = DroneWorld().ready().flies()
    world.deaf = True
    world.begin(command_work(178, 1, 3.0))
    world.run(0.1)
    world.deaf = False
    assert world.command(178, 1, 8.0).outcome is Outcome.DONE
    world.run(ANSWER_WITHIN_S * TRIES)
    assert [one.param2 for one in world.commands_sent(178)] == [3.0, 8.0]


def test_a_mode_that_was_shown_before_the_repetition_that_was_heard_proves_nothing() -> None:
    world = DroneWorld(Failure.MODE_CHANGE_IGNORED).ready()
    flight = world.vehicle.flight
    flight.set_mode(Mode.RTL)
    world.deaf = True
    world.begin(command_work(SET_MODE, 1, RTL), deadline_s=4.0)
    world.until(lambda: world.onboard.autopilot.custom_mode == RTL)
    world.run(1.2)
    flight.set_mode(Mode.GUIDED)
    world.deaf = False
    assert world.result().outcome is Outcome.TIMED_OUT


def test_without_anything_later_it_is_repeated() -> None:
    world = DroneWorld().ready().flies()
    number = wait_for_an_answer(world)
    world.deaf = False
    assert world.result(number).outcome is Outcome.DONE
    assert world.vehicle.flight.mode == RTL


def test_another_epoch_and_a_cancel_end_it_at_once() -> None:
    world = DroneWorld().ready().flies()
    number = wait_for_an_answer(world)
    world.change_epoch()
    world.run(0.1)
    (result,) = world.results(number)
    assert (result.outcome, "not known" in result.words) == (Outcome.STALE_EPOCH, True)
    number = wait_for_an_answer(world)
    world.onboard.message(CancelTransaction(id=number), world.now)
    assert world.result(number, limit_s=0.1).outcome is Outcome.CANCELLED
    world.deaf = False
    world.run(ANSWER_WITHIN_S * TRIES)
    assert world.vehicle.flight.mode == GUIDED
    assert world.command(SET_MODE, 1, RTL, epoch=world.epoch - 1).outcome is Outcome.STALE_EPOCH
    assert world.vehicle.flight.mode == GUIDED


def test_several_wait_at_once_and_no_answer_is_taken_for_anothers() -> None:
    world = DroneWorld().ready()
    world.deaf = True
    numbers = [world.begin(command_work(SET_MODE, 1, mode)) for mode in (LOITER, GUIDED, RTL)]
    world.run(0.1)
    sent = world.commands_sent(SET_MODE)
    assert {one.get_srcComponent() for one in sent} == set(COMPONENTS)
    refused = mavlink.MAVLink_command_ack_message(SET_MODE, mavlink.MAV_RESULT_FAILED, 0, 0, 1, COMPONENTS[1])
    says(world, refused)
    world.run(0.5)
    assert [len(world.results(number)) for number in numbers] == [0, 1, 0]
    more = [world.begin(command_work(SET_MODE, 1, LOITER)) for _ in range(2)]
    world.run(0.1)
    assert world.results(numbers[0])[0].outcome is Outcome.CANCELLED, "there is no id left: the oldest ends"
    assert not world.results(numbers[2]) and not world.results(more[0])


def test_progress_of_what_takes_long_is_told() -> None:
    world = DroneWorld().ready()
    number = wait_for_an_answer(world)
    for percent in (10, 10, 60):
        says(world, mavlink.MAVLink_command_ack_message(SET_MODE, 5, percent, 0, 1, COMPONENTS[0]))
        world.run(0.3)
    reported = [one.done for one in world.reported if isinstance(one, TransactionProgress) and one.id == number]
    assert reported == [10, 60]


def test_what_comes_too_late_is_not_carried_out() -> None:
    world = DroneWorld().ready().flies()
    late = world.command(SET_MODE, 1, RTL, late_s=2.5)
    assert (late.outcome, late.words) == (Outcome.REFUSED, "The command came 2.5 s late and was not carried out.")
    assert world.vehicle.flight.mode == GUIDED
    assert world.command(SET_MODE, 1, RTL, late_s=1.5).outcome is Outcome.DONE


@pytest.mark.parametrize("value", [1e39, -1e300])
def test_a_value_that_no_frame_can_carry_is_refused(value: float) -> None:
    world = DroneWorld().ready()
    result = world.command(SET_MODE, 1, GUIDED, value)
    assert (result.outcome, "too large" in result.words) == (Outcome.REFUSED, True)


def test_an_autopilot_that_is_not_heard_gets_no_command() -> None:
    world = DroneWorld()
    assert world.command(ARM, 1).words == "No heartbeat from the autopilot."


def test_it_takes_over_from_a_hold_as_a_frame_does() -> None:
    """A hold in a stick mode: a command to fly without sticks ends the centred sticks when the autopilot obeys."""
    world = DroneWorld().ready().flies(LOITER)
    world.tower_sends(sticks(0))
    world.onboard.message(HoldOrder(order_id=1, epoch=world.epoch, reason="a test"), world.now)
    world.until(lambda: any(isinstance(one, HoldProgress) and one.step is HoldStep.CONFIRMED for one in world.reported))
    assert world.command(SET_MODE, 1, RTL).outcome is Outcome.DONE
    world.run(0.1)
    streamed = len(world.asked_of_autopilot("MANUAL_CONTROL"))
    world.run(2.0)
    assert len(world.asked_of_autopilot("MANUAL_CONTROL")) == streamed
    assert world.vehicle.flight.mode == RTL


def test_one_that_is_refused_leaves_the_hand_on_the_sticks_needed_as_a_frame_does() -> None:
    world = DroneWorld().ready().flies(LOITER)
    world.tower_sends(sticks(300))
    refused = world.command(SET_MODE, 1, 99)
    assert refused.outcome is Outcome.FAILED
    world.until(
        lambda: any(isinstance(one, HoldProgress) for one in world.reported), limit_s=1.0, what="sticks go stale"
    )


CHANGE_SPEED, SET_HOME, SET_ITEM = 178, 179, 224


def change_speed(world: DroneWorld, *speeds_m_s: float) -> TransactionResult:
    """Commands 2 m/s. The autopilot accepts, then reports these speeds one after the other until the end."""
    world.vehicle.failures.add(Failure.SILENT)
    number = world.begin(command_work(CHANGE_SPEED, 1, 2, -1))
    world.step()
    says(world, mavlink.MAVLink_command_ack_message(CHANGE_SPEED, 0, 0, 0, 1, COMPONENTS[0]))
    for m_s in speeds_m_s:
        motion = (round(m_s * 100), 0, 0, 0)
        says(world, mavlink.MAVLink_global_position_int_message(1000, 473977000, 85456000, 500_000, 12_000, *motion))
        world.run(0.1)
    world.vehicle.failures.discard(Failure.SILENT)
    return world.result(number)


def test_a_speed_is_done_when_the_motion_shows_it() -> None:
    result = change_speed(DroneWorld().ready(), 7.4, 5.0, 2.3)
    assert (result.outcome, result.seen) == (Outcome.DONE, True)
    assert result.words.startswith("Seen: it flies at 2.3 m/s.")


def test_a_drone_that_flies_on_as_fast_as_before_is_told_as_such() -> None:
    result = change_speed(DroneWorld().ready(), *[7.4] * 60)
    assert (result.outcome, result.seen) == (Outcome.DONE, False)
    assert result.words.startswith("Accepted, not confirmed yet: it flies at 7.4 m/s.")


def test_of_a_drone_that_stands_still_no_speed_is_waited_for() -> None:
    world = DroneWorld().ready()
    began = world.now
    result = world.command(CHANGE_SPEED, 1, 8, -1)
    assert (result.outcome, result.seen) == (Outcome.DONE, False)
    assert "it stands still" in result.words
    assert world.now - began < 1.0


def test_home_is_done_when_the_autopilot_tells_it_there() -> None:
    world = DroneWorld().ready()
    place = CommandWork(
        command=SET_HOME, params=(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 490.0), x=473980000, y=85460000, frame=0
    )
    result = world.do(place)
    assert (result.outcome, result.seen) == (Outcome.DONE, True)
    assert world.command(SET_HOME, 1).seen is True


def test_a_home_that_stays_where_it_was_is_not_seen() -> None:
    world = DroneWorld().ready()
    world.vehicle.flight.set_home = lambda *_: None  # accepted, but without effect
    place = CommandWork(
        command=SET_HOME, params=(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 490.0), x=473990000, y=85460000, frame=0
    )
    result = world.do(place)
    assert (result.outcome, result.seen) == (Outcome.DONE, False), result.words
    assert "not confirmed yet: home is at" in result.words


FAR_E7 = 5000
"""Of latitude: 56 m."""


def px4_in_the_air() -> DroneWorld:
    world = DroneWorld(flavour=PX4).ready()
    flight = world.vehicle.flight
    climb = CommandWork(command=TAKEOFF, params=(0.0, 0.0, 0.0, None, None, None, 498.0))
    assert world.do(climb).outcome is Outcome.DONE
    assert world.command(ARM, 1).outcome is Outcome.DONE
    for _ in range(200):
        world.run(0.1)
        if flight.mode is Px4Mode.LOITER and not flight.landed:
            return world
    raise AssertionError(flight.mode)


def go_to(world: DroneWorld, north_e7: int) -> TransactionResult:
    place = world.vehicle.flight.place()
    lat, lon = round(place.lat_deg * 1e7), round(place.lon_deg * 1e7)
    work = CommandWork(
        command=REPOSITION, params=(-1.0, 1.0, 0.0, None, 0.0, 0.0, 498.0), x=lat + north_e7, y=lon, frame=5
    )
    return world.do(work)


def test_a_target_is_done_when_a_px4_comes_nearer() -> None:
    world = px4_in_the_air()
    result = go_to(world, FAR_E7)
    assert (result.outcome, result.seen, "comes nearer" in result.words) == (Outcome.DONE, True, True), result


def test_a_target_that_a_px4_refuses_after_accepting_it_has_failed() -> None:
    world = px4_in_the_air()
    world.vehicle.flight.parameters.set("GF_MAX_HOR_DIST", 20.0)
    result = go_to(world, FAR_E7)
    assert (result.outcome, result.seen) == (Outcome.FAILED, False), result
    assert "outside geofence" in result.words


@pytest.mark.parametrize("circles", [True, False])
def test_a_circle_is_done_when_a_px4_shows_its_mode(circles: bool) -> None:
    world = px4_in_the_air()
    flight = world.vehicle.flight
    if not circles:
        flight.set_mode = lambda mode: True  # it holds because it misses sticks
    place = flight.place()
    at = {"x": round(place.lat_deg * 1e7), "y": round(place.lon_deg * 1e7), "frame": 5}
    work = CommandWork(command=mavlink.MAV_CMD_DO_ORBIT, params=(20.0, 3.0, 0.0, None, 0.0, 0.0, 498.0), **at)
    result = world.do(work)
    assert (result.outcome, result.seen) == (Outcome.DONE if circles else Outcome.FAILED, circles), result
    assert ("it circles" if circles else "does not do it: it is in AUTO.LOITER") in result.words
