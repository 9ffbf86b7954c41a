"""Plans on board are watched: reads, uploads by others, and starts during an upload."""

from __future__ import annotations

from typing import Any

import pytest
from drone_world import ARM, AUTO, SET_MODE, DroneWorld, mavlink, waypoints
from plan_watch_world import MISSION, NO_STARTS, OTHER, PLAN, STARTS, uploading

from onboard_agent.transactions.plan_changes import QUIET_S
from simulator.ardupilot import arducopter
from simulator.failure_modes import Failure
from simulator.mission_plan import Item
from simulator.mission_plan import PlanKind as ServerKind
from simulator.px4.flavour import PX4
from wire.autopilots.ardupilot_plans import ArduPilot
from wire.autopilots.px4_plans import Px4
from wire.plan_keeping import as_kept
from wire.plans import PlanItem, PlanKind, plan_hash
from wire.transactions import (
    Outcome,
    PlanOnBoard,
    PlanUploadWork,
)


def ground_station_writes(world: DroneWorld, count: int = 3, answer_each_s: float = 0.05) -> None:
    """A ground station connected through the tower uploads its own plan."""
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
    world.run(40.0)  # its clock must go back, so that an instantaneous reboot is detected
    reported = len(world.reported)
    assert world.command(mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1).outcome is Outcome.DONE
    world.until(
        lambda: PlanOnBoard(kind=MISSION, hash=None) in world.reported[reported:], what="not known after the reboot"
    )
    reported = len(world.reported)
    world.until(lambda: any(isinstance(one, PlanOnBoard) and one.hash for one in world.reported[reported:]))
    world.ready()
    assert not world.went_up("MISSION_ITEM_INT", "MISSION_COUNT"), "what we read for ourselves goes no further"


def test_the_table_is_the_one_of_the_autopilots_release() -> None:
    gimbal = PlanItem(205, 0, (-45.0, 0.0, 0.0, 0.0), z=2.0)
    look_at = PlanItem(195, 3, x=473_977_420, y=85_455_940, z=20.0)
    for release, gimbal_words, look_words in (
        ("4.5", "1 values differently", "does not know this command"),
        ("4.6", "", "does not know this command"),
        ("4.7", "", ""),
    ):
        world = DroneWorld(flavour=arducopter(release)).ready()
        world.until(lambda: world.onboard.autopilot.firmware != 0, what="the release is known")  # noqa: B023
        result = world.do(PlanUploadWork(MISSION, (*PLAN, gimbal)))
        assert result.outcome is Outcome.DONE, (release, result.words)
        assert gimbal_words in result.words
        result = world.do(PlanUploadWork(MISSION, (*PLAN, look_at)))
        assert (result.outcome is Outcome.DONE) is (release == "4.7"), release
        assert look_words in result.words


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
        reported = len(world.reported)
        world.vehicle._send(message)
        world.run(0.05)
        assert (PlanOnBoard(kind=PlanKind.FENCE, hash=None) in world.reported[reported:]) is there
    world.until(lambda: world.went_up("MISSION_CURRENT"))
    world.run(QUIET_S + 2.0)
    reported = len(world.reported)
    _store(world, OTHER)
    world.until(
        world.reported[reported:].__len__
        if False
        else lambda: PlanOnBoard(kind=MISSION, hash=None) in world.reported[reported:]
    )
    world.until(lambda: world.on_board() == plan_hash(MISSION, OTHER), limit_s=QUIET_S + 1.0)


def _store(world: DroneWorld, plan: Any) -> None:
    """A third party with its own radio writes a plan, unseen by the agent."""
    items = [Item(16, 0, x=473977420, y=85455940, z=488.0)]
    items += [Item(i.command, i.frame, i.params, i.x, i.y, i.z, 1) for i in plan]
    world.vehicle.flight.plans.store(ServerKind.MISSION, items, world.vehicle.flight.home)


def test_our_own_upload_is_nobody_elses() -> None:
    """Written in place and read back, each for longer than the interval of MISSION_CURRENT."""
    world = DroneWorld(Failure.MISSION_WRITTEN_IN_PLACE).ready()
    world.run(2.0)
    for plan in (waypoints(400), OTHER, ()):
        reported = len(world.reported)
        assert world.do(PlanUploadWork(MISSION, plan)).outcome is Outcome.DONE
        world.run(QUIET_S + 3.0)
        assert [one.hash for one in world.reported[reported:] if isinstance(one, PlanOnBoard)] == [
            plan_hash(MISSION, plan)
        ]


def test_what_was_sent_is_still_known_when_the_same_plan_is_read_again() -> None:
    world = DroneWorld().ready()
    plan = tuple(PlanItem(16, 3, (1.4, 0.0, 0.0, 0.0), item.x, item.y, item.z + 0.004) for item in PLAN)
    assert world.do(PlanUploadWork(MISSION, plan)).outcome is Outcome.DONE
    reported = [one for one in world.reported if isinstance(one, PlanOnBoard)][-1]
    assert reported.sent_hash == plan_hash(MISSION, plan) != reported.hash
    world.tower_sends(mavlink.MAVLink_mission_clear_all_message(1, 1, 1))
    world.tower_sends(mavlink.MAVLink_mission_write_partial_list_message(1, 1, 3, 3, 0))
    world.run(0.05)
    assert world.on_board() is None
    world.until(world.on_board)
    assert [one for one in world.reported if isinstance(one, PlanOnBoard) and one.kind == MISSION][-1] == reported


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
