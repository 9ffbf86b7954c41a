"""An upload across lost links, epochs, older towers and agent restarts."""

from __future__ import annotations

import pytest
from drone_world import AUTO, BRAKE, GUIDED, SET_MODE, DroneWorld, mavlink, waypoints
from plan_watch_world import MISSION, NO_STARTS, OTHER, PLAN, STARTS, uploading

from onboard_agent.transactions.journal import NoJournal
from onboard_agent.transactions.plan_changes import QUIET_S
from onboard_agent.transactions.start_gate import SHOWN_WITHIN_S
from simulator.failure_modes import Failure
from simulator.modes import Mode
from wire.control_messages import HoldOrder
from wire.plans import PlanKind, pack_plan, plan_hash
from wire.transactions import (
    Outcome,
    PlanDownloadWork,
    PlanOnBoard,
    PlanUploadWork,
    TransactionProgress,
    TransactionResult,
)


def test_a_lost_link_and_a_hold_do_not_stop_a_write_and_its_end_is_told_later() -> None:
    world = DroneWorld().ready()
    number = uploading(world)
    world.onboard.message(HoldOrder(order_id=1, epoch=world.epoch, reason="a test"), world.now)
    world.link_down()
    world.until(lambda: world.journal.records == {}, what="it is over")
    world.run(5.0)
    assert not world.results(number)
    world.link_up()
    assert world.result(number, limit_s=0.1).outcome is Outcome.DONE
    assert world.on_board() == plan_hash(MISSION, waypoints(200))


def test_a_result_that_may_have_been_lost_with_the_link_is_told_again() -> None:
    world = DroneWorld().ready()
    number = world.begin(PlanDownloadWork(MISSION))
    world.result(number)
    world.link_down()
    world.run(100.0)
    world.link_up()
    world.run(0.1)
    assert len(world.results(number)) == 2


def test_an_epoch_that_changes_puts_the_old_plan_back() -> None:
    world = DroneWorld(Failure.MISSION_WRITTEN_IN_PLACE).ready()
    assert world.do(PlanUploadWork(MISSION, PLAN)).outcome is Outcome.DONE
    number = uploading(world)
    world.change_epoch()
    result = world.result(number)
    assert result.outcome is Outcome.STALE_EPOCH
    assert world.on_board() == plan_hash(MISSION, PLAN)
    assert world.do(PlanUploadWork(MISSION, OTHER), epoch=world.epoch - 1).outcome is Outcome.STALE_EPOCH
    assert world.do(PlanUploadWork(MISSION, OTHER)).outcome is Outcome.DONE


def test_an_older_tower_is_told_nothing_of_it() -> None:
    world = DroneWorld(takes=())
    world.run(8.0)
    assert world.reported
    assert not [one for one in world.reported if isinstance(one, PlanOnBoard | TransactionProgress | TransactionResult)]


def test_the_state_is_told_again_to_a_new_link_and_on_another_channel_of_it() -> None:
    world = DroneWorld().ready()
    for again in (world.link_up, world.onboard.resumed):
        reported = len(world.reported)
        again()
        world.run(0.03)
        assert {one.kind for one in world.reported[reported:] if isinstance(one, PlanOnBoard) and one.hash} == set(
            PlanKind
        )


def test_on_a_narrow_line_nothing_is_read_while_somebody_flies_by_hand() -> None:
    world = DroneWorld(narrow_line=True).ready()
    assert world.do(PlanUploadWork(MISSION, waypoints(200))).outcome is Outcome.DONE
    world.flies(5)
    world.tower_sends(mavlink.MAVLink_mission_clear_all_message(1, 1, 1))
    asked = len(world.asked_of_autopilot("MISSION_REQUEST_LIST"))
    world.run(QUIET_S + 3.0)
    assert len(world.asked_of_autopilot("MISSION_REQUEST_LIST")) == asked
    assert world.command(SET_MODE, 1, GUIDED).outcome is Outcome.DONE
    world.until(lambda: len(world.asked_of_autopilot("MISSION_REQUEST_LIST")) > asked)


def test_without_a_place_for_its_journal_nothing_is_written() -> None:
    world = DroneWorld(journal=NoJournal()).ready()  # type: ignore[arg-type]
    result = world.do(PlanUploadWork(MISSION, PLAN))
    assert result.outcome is Outcome.FAILED
    assert "cannot write its journal (it has no directory for its state)" in result.words
    assert world.on_board() == plan_hash(MISSION, ())


def test_an_agent_killed_in_a_write_refuses_the_start_until_the_old_plan_is_back() -> None:
    world = DroneWorld(Failure.MISSION_WRITTEN_IN_PLACE).ready()
    assert world.do(PlanUploadWork(MISSION, PLAN)).outcome is Outcome.DONE
    number = uploading(world)
    world.run(0.2)
    world.reported.clear()
    world.start_agent()
    world.run(0.03)
    refused = world.command(mavlink.MAV_CMD_MISSION_START)
    assert refused.outcome is Outcome.REFUSED
    world.until(lambda: world.on_board() == plan_hash(MISSION, PLAN))
    assert not world.results(number)
    assert world.onboard._work.may_start


def in_the_air(*failures: Failure) -> DroneWorld:
    """With PLAN on board, on an autopilot that writes in place, and not flying the plan."""
    world = DroneWorld(Failure.MISSION_WRITTEN_IN_PLACE, *failures).ready()
    assert world.do(PlanUploadWork(MISSION, PLAN)).outcome is Outcome.DONE
    return world.flies()


@pytest.mark.parametrize("name", ["mode", "old-mode", "start"])
@pytest.mark.parametrize("steps", [0, 1, 4])
def test_a_start_that_no_heartbeat_shows_yet_keeps_the_plan_as_it_is(name: str, steps: int) -> None:
    world = in_the_air()
    world.tower_sends(STARTS[name])
    for _ in range(steps):
        world.step()
    result = world.do(PlanUploadWork(MISSION, OTHER))
    assert result.outcome is Outcome.REFUSED
    assert "plan is written" in result.words
    world.run(0.05)
    assert world.on_board() == plan_hash(MISSION, PLAN) and world.vehicle.flight.mode == AUTO


def test_a_start_that_came_to_nothing_is_in_the_way_for_a_moment_only() -> None:
    world = DroneWorld().ready()
    world.tower_sends(STARTS["start"])  # there is no mission
    assert "just been ordered to fly" in world.do(PlanUploadWork(MISSION, OTHER)).words
    world.run(SHOWN_WITHIN_S + 0.1)
    assert world.do(PlanUploadWork(MISSION, OTHER)).outcome is Outcome.DONE


def test_a_start_that_was_shown_and_stopped_again_is_in_nobodys_way() -> None:
    world = in_the_air()
    assert world.command(SET_MODE, 1, AUTO).outcome is Outcome.DONE
    assert world.command(SET_MODE, 1, GUIDED).outcome is Outcome.DONE
    assert world.do(PlanUploadWork(MISSION, OTHER)).outcome is Outcome.DONE


def test_an_upload_that_may_stop_the_mission_stops_one_that_has_just_been_started() -> None:
    world = in_the_air()
    world.tower_sends(STARTS["mode"])
    result = world.do(PlanUploadWork(MISSION, OTHER, while_flying=True))
    assert result.outcome is Outcome.DONE and "holds in BRAKE" in result.words
    assert world.vehicle.flight.mode == BRAKE


def test_a_pilot_who_switches_to_the_mission_while_the_old_plan_is_read_ends_the_upload() -> None:
    world = in_the_air()
    number = world.begin(PlanUploadWork(MISSION, waypoints(200)))
    world.step()
    world.vehicle.flight.set_mode(Mode.AUTO)
    result = world.result(number)
    assert result.outcome is Outcome.REFUSED
    assert result.words.startswith("The drone started its mission. Nothing was written")
    assert world.do(PlanDownloadWork(MISSION)).plan == pack_plan(MISSION, PLAN)


def test_an_agent_that_has_not_heard_its_autopilot_yet_lets_no_mode_through_that_may_be_the_missions() -> None:
    world = in_the_air()
    uploading(world)
    world.run(0.1)
    world.start_agent()
    world.tower_sends(STARTS["mode"])
    assert world.onboard.counts["no mission may be started"] == 1
    world.tower_sends(NO_STARTS["pause"])
    assert world.onboard.counts["no mission may be started"] == 1
    world.until(lambda: world.on_board() == plan_hash(MISSION, PLAN))
    assert world.vehicle.flight.mode != AUTO
