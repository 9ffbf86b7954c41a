"""What is on board is known to the tower, and nobody starts what may be half a mission: laws of `PlanWatch`, flown."""

from __future__ import annotations

from typing import Any

import pytest
from drone_world import ARM, AUTO, BRAKE, GUIDED, RTL, SET_MODE, DroneWorld, command_work, mavlink, waypoints
from handler_line import DeskLine
from plan_line import MemoryJournal

from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.transactions.journal import NoJournal
from onboard_agent.transactions.plan_changes import QUIET_S
from onboard_agent.transactions.plan_watch import STOP_AGAIN_S, PlanWatch
from onboard_agent.transactions.start_gate import SHOWN_WITHIN_S
from simulator.failure_modes import Failure
from simulator.mission_plan import Item
from simulator.mission_plan import PlanKind as ServerKind
from simulator.modes import Mode
from simulator.px4.flavour import PX4
from wire.control_messages import HoldOrder, SafetySettings
from wire.open_holds import LostAction
from wire.plan_keeping import as_kept
from wire.plan_keeping_ardupilot import ArduPilot
from wire.plan_keeping_px4 import Px4
from wire.plans import PlanItem, PlanKind, pack_plan, plan_hash
from wire.transactions import (
    CancelTransaction,
    Outcome,
    PlanClearWork,
    PlanDownloadWork,
    PlanOnBoard,
    PlanUploadWork,
    TransactionProgress,
    TransactionResult,
)

MISSION = PlanKind.MISSION
PLAN, OTHER = waypoints(12), waypoints(9, alt_m=40.0)


def uploading(world: DroneWorld, count: int = 200) -> int:
    """An upload that is under way: some of it is on board."""
    before = len(world.asked_of_autopilot("MISSION_ITEM_INT"))
    number = world.begin(PlanUploadWork(MISSION, waypoints(count)))
    world.until(lambda: len(world.asked_of_autopilot("MISSION_ITEM_INT")) > before, what="the upload begins")
    return number


def ground_station_writes(world: DroneWorld, count: int = 3, answer_each_s: float = 0.05) -> None:
    """A ground station that came through the tower puts a plan of its own on board."""
    world.tower_sends(mavlink.MAVLink_mission_count_message(1, 1, count, 0))
    for seq in range(count):
        world.run(answer_each_s)
        item = mavlink.MAVLink_mission_item_int_message(1, 1, seq, 3, 16, 0, 1, 0, 0, 0, 0, 473977420, 85455940, 33, 0)
        world.tower_sends(item)


@pytest.mark.parametrize("flavour", [None, PX4], ids=["ardupilot", "px4"])
def test_the_plans_are_read_when_the_autopilot_comes_and_after_its_reboot(flavour: Any) -> None:
    world = DroneWorld() if flavour is None else DroneWorld(flavour=flavour)
    world.ready()
    keeping = ArduPilot() if flavour is None else Px4()
    kept = as_kept(keeping, MISSION, PLAN)
    assert world.do(PlanUploadWork(MISSION, PLAN)).outcome is Outcome.DONE
    assert world.on_board() == plan_hash(MISSION, kept)
    assert world.on_board(PlanKind.FENCE) == plan_hash(PlanKind.FENCE, ())
    world.run(40.0)  # its clock must go back for a reboot of no time at all to be seen
    told = len(world.told)
    assert world.command(mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1).outcome is Outcome.DONE
    world.until(lambda: PlanOnBoard(kind=MISSION, hash=None) in world.told[told:], what="not known after the reboot")
    told = len(world.told)
    world.until(lambda: any(isinstance(one, PlanOnBoard) and one.hash for one in world.told[told:]))
    world.ready()
    assert not world.went_up("MISSION_ITEM_INT", "MISSION_COUNT"), "what we read for ourselves goes no further"


def test_an_upload_through_the_tower_is_noticed_at_once_and_read_when_it_is_over() -> None:
    world = DroneWorld().ready()
    assert world.do(PlanUploadWork(MISSION, PLAN)).outcome is Outcome.DONE
    asked = len(world.asked_of_autopilot("MISSION_REQUEST_LIST"))
    world.tower_sends(mavlink.MAVLink_mission_count_message(1, 1, 2, 0))
    world.run(0.03)
    assert world.on_board() is None
    assert world.on_board(PlanKind.RALLY) is not None
    for seq in range(2):
        world.run(QUIET_S * 0.7)  # slow, but not silent
        assert len(world.asked_of_autopilot("MISSION_REQUEST_LIST")) == asked, "nobody reads into a transfer"
        item = mavlink.MAVLink_mission_item_int_message(1, 1, seq, 3, 16, 0, 1, 0, 0, 0, 0, 473977420, 85455940, 33, 0)
        world.tower_sends(item)
    world.until(world.on_board, limit_s=QUIET_S + 1.0)
    expected = (PlanItem(16, 3, (0.0, 0.0, 0.0, 0.0), 473977420, 85455940, 33.0),)
    assert world.on_board() == plan_hash(MISSION, expected)
    assert world.went_up("MISSION_REQUEST_INT", "MISSION_ACK"), "the ground station's own transfer goes through"


def test_an_upload_beside_the_drone_is_noticed_by_its_acknowledgement_or_by_the_number_of_items() -> None:
    world = DroneWorld().ready()
    for there, message in (
        (True, mavlink.MAVLink_mission_ack_message(77, 190, mavlink.MAV_MISSION_ACCEPTED, 1)),
        (False, mavlink.MAVLink_mission_ack_message(77, 190, mavlink.MAV_MISSION_DENIED, 1)),
        (False, mavlink.MAVLink_mission_ack_message(1, 191, mavlink.MAV_MISSION_ACCEPTED, 1)),
    ):
        world.run(QUIET_S + 1.0)
        told = len(world.told)
        world.vehicle._send(message)
        world.run(0.05)
        assert (PlanOnBoard(kind=PlanKind.FENCE, hash=None) in world.told[told:]) is there
    world.until(lambda: world.went_up("MISSION_CURRENT"))
    world.run(QUIET_S + 2.0)
    told = len(world.told)
    _store(world, OTHER)
    world.until(
        world.told[told:].__len__ if False else lambda: PlanOnBoard(kind=MISSION, hash=None) in world.told[told:]
    )
    world.until(lambda: world.on_board() == plan_hash(MISSION, OTHER), limit_s=QUIET_S + 1.0)


def _store(world: DroneWorld, plan: Any) -> None:
    """Somebody with a radio of their own writes a plan past us."""
    items = [Item(16, 0, x=473977420, y=85455940, z=488.0)]
    items += [Item(i.command, i.frame, i.params, i.x, i.y, i.z, 1) for i in plan]
    world.vehicle.flight.plans.store(ServerKind.MISSION, items, world.vehicle.flight.home)


def test_our_own_upload_is_nobody_elses() -> None:
    """Written in place and read back, both for longer than it takes until MISSION_CURRENT comes."""
    world = DroneWorld(Failure.MISSION_WRITTEN_IN_PLACE).ready()
    world.run(2.0)
    for plan in (waypoints(400), OTHER, ()):
        told = len(world.told)
        assert world.do(PlanUploadWork(MISSION, plan)).outcome is Outcome.DONE
        world.run(QUIET_S + 3.0)
        assert [one.hash for one in world.told[told:] if isinstance(one, PlanOnBoard)] == [plan_hash(MISSION, plan)]


def test_what_was_sent_is_still_known_when_the_same_plan_is_read_again() -> None:
    world = DroneWorld().ready()
    plan = tuple(PlanItem(16, 3, (1.4, 0.0, 0.0, 0.0), item.x, item.y, item.z + 0.004) for item in PLAN)
    assert world.do(PlanUploadWork(MISSION, plan)).outcome is Outcome.DONE
    told = [one for one in world.told if isinstance(one, PlanOnBoard)][-1]
    assert told.sent_hash == plan_hash(MISSION, plan) != told.hash
    world.tower_sends(mavlink.MAVLink_mission_clear_all_message(1, 1, 1))
    world.tower_sends(mavlink.MAVLink_mission_write_partial_list_message(1, 1, 3, 3, 0))
    world.run(0.05)
    assert world.on_board() is None
    world.until(world.on_board)
    assert [one for one in world.told if isinstance(one, PlanOnBoard) and one.kind == MISSION][-1] == told


def test_while_we_write_others_do_not_and_it_is_counted() -> None:
    world = DroneWorld().ready()
    number = uploading(world)
    sent = len(world.sent)
    ground_station_writes(world)
    kept_out = world.asked_of_autopilot("MISSION_COUNT", "MISSION_ITEM_INT")
    assert {one.get_srcSystem() for one in kept_out} == {1}, "only the agent's own"
    assert world.result(number).outcome is Outcome.DONE
    assert world.onboard.counts["a plan is being written"] == 4
    assert len(world.sent) > sent


STARTS = {
    "mode": mavlink.MAVLink_command_long_message(1, 1, SET_MODE, 0, 1, AUTO, 0, 0, 0, 0, 0),
    "auto-rtl": mavlink.MAVLink_command_long_message(1, 1, SET_MODE, 0, 1, 27, 0, 0, 0, 0, 0),
    "old-mode": mavlink.MAVLink_set_mode_message(1, 1, AUTO),
    "start": mavlink.MAVLink_command_long_message(1, 1, 300, 0, 0, 0, 0, 0, 0, 0, 0),
    "start-int": mavlink.MAVLink_command_int_message(1, 1, 3, 300, 0, 0, 0, 0, 0, 0, 0, 0, 0),
    "current": mavlink.MAVLink_command_long_message(1, 1, 224, 0, 3, 0, 0, 0, 0, 0, 0),
    "old-current": mavlink.MAVLink_mission_set_current_message(1, 1, 3),
    "continue": mavlink.MAVLink_command_long_message(1, 1, 193, 0, 1, 0, 0, 0, 0, 0, 0),
}
NO_STARTS = {
    "rtl": mavlink.MAVLink_command_long_message(1, 1, SET_MODE, 0, 1, RTL, 0, 0, 0, 0, 0),
    "arm": mavlink.MAVLink_command_long_message(1, 1, ARM, 0, 1, 0, 0, 0, 0, 0, 0),
    "pause": mavlink.MAVLink_command_long_message(1, 1, 193, 0, 0, 0, 0, 0, 0, 0, 0),
    "nan": mavlink.MAVLink_command_long_message(1, 1, SET_MODE, 0, 1, float("nan"), 0, 0, 0, 0, 0),
}


@pytest.mark.parametrize("name", [*STARTS, *NO_STARTS])
def test_no_mission_is_started_while_a_plan_is_written_and_who_tries_is_told_why(name: str) -> None:
    world = DroneWorld().ready()
    number = uploading(world)
    message = (STARTS | NO_STARTS)[name]
    asked = len(world.asked_of_autopilot(message.get_type()))
    world.tower_sends(message)
    world.run(0.03)
    passed = [one for one in world.asked_of_autopilot(message.get_type())[asked:] if one.get_srcSystem() == 255]
    refused = world.onboard.counts["no mission may be started"]
    assert (len(passed), refused) == ((0, 1) if name in STARTS else (1, 0))
    denied = [one for one in world.went_up("COMMAND_ACK") if one.result == mavlink.MAV_RESULT_DENIED]
    said = "".join(one.text for one in world.went_up("STATUSTEXT") if one.get_srcComponent() == 191)
    if name in STARTS:
        assert "being written" in said
        if message.get_type().startswith("COMMAND"):
            assert [(one.command, one.target_system, one.target_component) for one in denied] == [
                (message.command, 255, 190)
            ]
    else:
        assert not said
    assert world.result(number).outcome is Outcome.DONE
    world.tower_sends(message)
    assert world.onboard.counts["no mission may be started"] == refused, "the gate is open again"


def test_arming_in_the_missions_mode_is_a_start() -> None:
    world = DroneWorld().ready()
    assert world.do(PlanUploadWork(MISSION, PLAN)).outcome is Outcome.DONE
    assert world.command(SET_MODE, 1, AUTO).outcome is Outcome.DONE
    number = uploading(world)
    refused = world.command(ARM, 1)
    assert (refused.outcome, "being written" in refused.words) == (Outcome.REFUSED, True)
    assert world.command(ARM, 0).code == "MAV_RESULT_ACCEPTED", "disarming always passes"
    assert world.result(number).outcome is Outcome.DONE


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
    """By the pilot's own switch, past us."""
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
    assert said.count("the drone is made to hold") == 1
    switched_to_the_mission(world)
    world.run(3.0)
    assert world.vehicle.flight.mode == AUTO, "a whole one is nobody's business"


def test_whoever_commands_has_time_until_a_heartbeat_shows_it_before_a_mission_in_doubt_is_stopped_again() -> None:
    """PX4 beats once a second: its heartbeats go on showing the mission for a while."""
    journal = MemoryJournal()
    journal.records[MISSION] = b"nobody can read this"
    line = DeskLine(PlanWatch(FrameMaker(), journal), armed=True, custom_mode=AUTO)
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
    """An autopilot that hears nothing."""

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
    assert "could not be brought to a hold" in refused.words and "heartbeat does not show it" in refused.words
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
    assert world.told
    assert not [one for one in world.told if isinstance(one, PlanOnBoard | TransactionProgress | TransactionResult)]


def test_the_state_is_told_again_to_a_new_link_and_on_another_channel_of_it() -> None:
    world = DroneWorld().ready()
    for again in (world.link_up, world.onboard.resumed):
        told = len(world.told)
        again()
        world.run(0.03)
        assert {one.kind for one in world.told[told:] if isinstance(one, PlanOnBoard) and one.hash} == set(PlanKind)


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
    world.told.clear()
    world.start_agent()
    world.run(0.03)
    refused = world.command(mavlink.MAV_CMD_MISSION_START)
    assert refused.outcome is Outcome.REFUSED
    world.until(lambda: world.on_board() == plan_hash(MISSION, PLAN))
    assert not world.results(number)
    assert world.onboard._work.may_start


def in_the_air(*failures: Failure) -> DroneWorld:
    """With PLAN on board, of an autopilot that writes in place, and not flying it."""
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
    assert "nothing is written" in result.words
    world.run(0.05)
    assert world.on_board() == plan_hash(MISSION, PLAN) and world.vehicle.flight.mode == AUTO


def test_a_start_that_came_to_nothing_is_in_the_way_for_a_moment_only() -> None:
    world = DroneWorld().ready()
    world.tower_sends(STARTS["start"])  # there is no mission
    assert "just been told to fly" in world.do(PlanUploadWork(MISSION, OTHER)).words
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
    assert result.words.startswith("The drone began to fly its mission. Nothing was written")
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
