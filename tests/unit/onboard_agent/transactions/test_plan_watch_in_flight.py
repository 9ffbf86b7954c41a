"""A plan that is flown, or in doubt, during its upload: holds, starts and pilots."""

from __future__ import annotations

from typing import Any

import pytest
from drone_world import AUTO, BRAKE, GUIDED, RTL, SET_MODE, DroneWorld, command_work, mavlink, waypoints
from handler_line import HandlerLine
from plan_line import MemoryJournal
from plan_watch_world import MISSION, OTHER, PLAN, uploading

from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.transactions.plan_watch import STOP_AGAIN_S, PlanWatch
from simulator.failure_modes import Failure
from simulator.modes import Mode
from wire.control_messages import HoldOrder, SafetySettings
from wire.open_holds import LostAction
from wire.plans import PlanItem, PlanKind, pack_plan, plan_hash
from wire.transactions import (
    CancelTransaction,
    Outcome,
    PlanClearWork,
    PlanDownloadWork,
    PlanUploadWork,
)


def on_mission() -> DroneWorld:
    world = DroneWorld().ready()
    assert world.do(PlanUploadWork(MISSION, PLAN)).outcome is Outcome.DONE
    world.flies()
    assert world.command(SET_MODE, 1, AUTO).outcome is Outcome.DONE
    return world


def test_a_mission_that_is_flown_is_changed_only_on_demand_in_a_hold_and_does_not_go_on_by_itself() -> None:
    world = on_mission()
    for work in (PlanUploadWork(MISSION, OTHER), PlanClearWork(MISSION)):
        refused = world.do(work)
        assert refused.outcome is Outcome.REFUSED
        assert "flying its mission (AUTO)" in refused.words
    assert world.do(PlanDownloadWork(MISSION)).plan == pack_plan(MISSION, PLAN)
    assert world.vehicle.flight.mode == AUTO
    writes = len(world.asked_of_autopilot("MISSION_COUNT"))
    number = world.begin(PlanUploadWork(MISSION, OTHER, while_flying=True))
    world.until(lambda: len(world.asked_of_autopilot("MISSION_COUNT")) > writes)
    assert world.onboard.autopilot.custom_mode == BRAKE, "nothing is written before a heartbeat shows the hold"
    result = world.result(number)
    assert result.outcome is Outcome.DONE, result.words
    assert "holds in BRAKE; its mission does not go on by itself" in result.words
    world.run(10.0)
    assert world.vehicle.flight.mode == BRAKE
    assert world.command(SET_MODE, 1, AUTO).outcome is Outcome.DONE


def test_while_another_transfer_runs_nothing_is_stopped_for_an_upload_that_would_be_refused() -> None:
    world = on_mission()
    number = world.begin(PlanDownloadWork(MISSION))
    busy = world.do(PlanUploadWork(MISSION, OTHER, while_flying=True))
    assert (busy.outcome, busy.words) == (Outcome.REFUSED, "Busy: the mission is being read.")
    assert world.result(number).outcome is Outcome.DONE
    world.run(1.0)
    assert world.vehicle.flight.mode == AUTO


def test_a_mission_that_may_be_half_of_one_is_not_gone_on_with_when_the_tower_stays_lost() -> None:
    for half in (False, True):
        world = on_mission()
        world.onboard.message(SafetySettings(lost_action=LostAction.CONTINUE, lost_action_s=3.0), world.now)
        world.onboard.message(HoldOrder(order_id=1, epoch=world.epoch, reason="a trigger"), world.now)
        world.run(1.0)
        if half:
            uploading(world)
        world.deaf = True
        world.link_down()
        world.run(6.0)
        asked = [one for one in world.commands_sent(SET_MODE) if one.get_srcComponent() == 191]
        assert (asked[-1].param2 == AUTO) is not half


def switched_to_the_mission(world: DroneWorld) -> None:
    """By the pilot's own switch, unseen by the agent."""
    world.vehicle.flight.set_mode(Mode.AUTO)
    world.until(lambda: world.onboard.autopilot.custom_mode == AUTO)


@pytest.mark.parametrize("agent", ["writes", "is killed and comes back"])
def test_a_mission_that_is_started_past_us_while_it_may_be_half_of_one_is_brought_to_a_hold(agent: str) -> None:
    world = DroneWorld(Failure.MISSION_WRITTEN_IN_PLACE).ready()
    assert world.do(PlanUploadWork(MISSION, PLAN)).outcome is Outcome.DONE
    world.flies()
    number = uploading(world)
    world.run(0.1)
    if agent == "writes":
        switched_to_the_mission(world)
    else:
        world.vehicle.flight.set_mode(Mode.AUTO)
        world.start_agent()
    world.until(lambda: world.vehicle.flight.mode == BRAKE, limit_s=2.0, what="it holds")
    world.until(lambda: world.onboard._work.may_start, what="the plan on board is a whole one")
    if agent == "writes":
        assert world.result(number).outcome is Outcome.DONE
    assert world.on_board() == plan_hash(MISSION, waypoints(200) if agent == "writes" else PLAN)
    said = "".join(one.text for one in world.went_up("STATUSTEXT") if one.get_srcComponent() == 191)
    assert said.count("The drone is ordered to hold") == 1
    switched_to_the_mission(world)
    world.run(3.0)
    assert world.vehicle.flight.mode == AUTO, "a whole one is nobody's business"


def test_whoever_commands_has_time_until_a_heartbeat_shows_it_before_a_mission_in_doubt_is_stopped_again() -> None:
    """PX4 sends heartbeats once a second, so they show the mission for a while longer."""
    journal = MemoryJournal()
    journal.records[MISSION] = b"nobody can read this"
    line = HandlerLine(PlanWatch(FrameMaker(), journal), armed=True, custom_mode=AUTO)
    line.server = Deaf()
    line.comes()
    line.run(1.0)
    asked = line.sent_count("COMMAND_LONG")
    assert asked > 1
    line.around_options["commanded"] = 1
    line.run(STOP_AGAIN_S - 0.1)
    assert line.sent_count("COMMAND_LONG") == asked
    line.run(0.2)
    assert line.sent_count("COMMAND_LONG") > asked


class Deaf:
    """An autopilot that receives nothing."""

    def receive(self, message: Any) -> None: ...

    def tick(self) -> None: ...


def test_a_fence_that_is_being_written_stops_no_mission_and_somebodys_command_comes_before_the_hold() -> None:
    world = DroneWorld(Failure.MISSION_WRITTEN_IN_PLACE).ready()
    assert world.do(PlanUploadWork(MISSION, PLAN)).outcome is Outcome.DONE
    world.flies()
    fence = tuple(PlanItem(5001, 0, (60.0, 0.0, 0.0, 0.0), 473900000 + i, 85400000 + i * i) for i in range(60))
    number = world.begin(PlanUploadWork(PlanKind.FENCE, fence))
    world.until(lambda: world.asked_of_autopilot("MISSION_ITEM_INT")[-1].mission_type == 1)
    switched_to_the_mission(world)
    world.result(number)
    assert world.vehicle.flight.mode == AUTO
    assert world.command(SET_MODE, 1, GUIDED).outcome is Outcome.DONE
    uploading(world)
    world.run(0.1)
    world.vehicle.failures.add(Failure.MODE_CHANGE_IGNORED)
    switched_to_the_mission(world)
    world.run(0.2)
    world.vehicle.failures.discard(Failure.MODE_CHANGE_IGNORED)
    world.tower_sends(mavlink.MAVLink_command_long_message(1, 1, SET_MODE, 0, 1, RTL, 0, 0, 0, 0, 0))
    world.run(3.0)
    assert world.vehicle.flight.mode == RTL


def test_what_cannot_be_read_is_asked_for_again_less_and_less_often() -> None:
    world = DroneWorld()
    world.deaf = True
    world.run(100.0)
    lists = world.asked_of_autopilot("MISSION_REQUEST_LIST")
    assert 30 < len(lists) <= 60, "five tries of 1.5 s for each of three kinds, and then pauses"
    world.deaf = False
    world.until(lambda: all(world.on_board(kind) for kind in PlanKind), limit_s=100.0)


def test_a_kind_of_plan_that_the_autopilot_does_not_have_is_asked_for_once() -> None:
    world = DroneWorld()
    world.deaf = True
    unsupported = mavlink.MAVLink_mission_ack_message(1, 191, mavlink.MAV_MISSION_UNSUPPORTED, 2)
    world.until(lambda: any(one.mission_type == 2 for one in world.asked_of_autopilot("MISSION_REQUEST_LIST")))
    world.vehicle._send(unsupported)
    world.run(0.1)
    asked = sum(one.mission_type == 2 for one in world.asked_of_autopilot("MISSION_REQUEST_LIST"))
    world.run(60.0)
    assert sum(one.mission_type == 2 for one in world.asked_of_autopilot("MISSION_REQUEST_LIST")) == asked


def test_a_drone_that_cannot_be_brought_to_a_hold_is_not_written_to() -> None:
    world = on_mission()
    world.vehicle.failures.add(Failure.MODE_CHANGE_IGNORED)
    refused = world.do(PlanUploadWork(MISSION, OTHER, while_flying=True))
    assert refused.outcome is Outcome.REFUSED
    assert "could not be put on hold" in refused.words and "heartbeat does not show it" in refused.words
    assert world.on_board() == plan_hash(MISSION, PLAN)


@pytest.mark.parametrize("how", ["hold", "command", "cancel", "epoch"])
def test_whoever_says_otherwise_ends_the_pause_and_nothing_is_written(how: str) -> None:
    world = on_mission()
    world.vehicle.failures.add(Failure.MODE_CHANGE_IGNORED)
    writes = len(world.asked_of_autopilot("MISSION_COUNT"))
    number = world.begin(PlanUploadWork(MISSION, OTHER, while_flying=True))
    world.run(0.2)
    refused = world.command(mavlink.MAV_CMD_MISSION_START)
    assert (refused.outcome, "about to be written" in refused.words) == (Outcome.REFUSED, True)
    assert world.do(PlanDownloadWork(MISSION)).outcome is Outcome.REFUSED
    if how == "hold":
        world.onboard.message(HoldOrder(order_id=1, epoch=world.epoch, reason="a test"), world.now)
    elif how == "command":
        world.begin(command_work(SET_MODE, 1, RTL))
    elif how == "cancel":
        world.onboard.message(CancelTransaction(id=number), world.now)
    else:
        world.change_epoch()
    expected = {"cancel": Outcome.CANCELLED, "epoch": Outcome.STALE_EPOCH}.get(how, Outcome.REFUSED)
    result = world.result(number, limit_s=0.3)
    assert (result.outcome, "Nothing was written" in result.words) == (expected, True)
    world.run(1.0)
    assert len(world.asked_of_autopilot("MISSION_COUNT")) == writes
