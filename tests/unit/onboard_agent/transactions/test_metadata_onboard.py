"""The whole agent and a whole vehicle: metadata beside the parameters, a ground station's files, and older towers."""

from __future__ import annotations

import struct
from typing import Any

import pytest
from drone_world import SET_MODE, DroneWorld

from onboard_agent.transactions.file_frames import Op
from onboard_agent.transactions.metadata_service import COMPONENT, MetadataService
from onboard_agent.transactions.parameter_files import ParameterFiles
from onboard_agent.transactions.parameter_handler import ParameterHandler
from simulator.ardupilot import ARDUPILOT
from simulator.failure_modes import Failure
from simulator.flavour import Flavour
from simulator.px4.flavour import PX4
from wire.dialect import decode, mavlink
from wire.parameter_metadata import MetadataKnown, MetadataPiece, MetadataWanted, read_metadata, unpack_text
from wire.transactions import ParameterCache, ParametersReadWork, PlanOnBoard

LAND = 9
TAKES = ("transactions", "parameter_metadata")


def services(maker: Any) -> list[Any]:
    """Returns the services as the agent makes them."""
    parameters = ParameterHandler(maker, ParameterFiles(None))
    return [MetadataService(maker, parameters_busy=parameters.busy), parameters]


def drone(*failures: Failure, takes: tuple[str, ...] = TAKES, **options: Any) -> DroneWorld:
    return DroneWorld(*failures, takes=takes, make_handlers=services, **options)


def known(world: DroneWorld) -> MetadataKnown | None:
    reported = [one for one in world.reported if isinstance(one, MetadataKnown)]
    return reported[-1] if reported else None


def is_known(world: DroneWorld) -> bool:
    reported = known(world)
    return reported is not None and reported.hash is not None


def ftp_sent(world: DroneWorld) -> list[tuple[int, int]]:
    """Returns component and opcode of the messages to the autopilot."""
    sent = [decode(frame) for frame in world.sent]
    return [
        (one.get_srcComponent(), one.payload[3])
        for one in sent
        if one is not None and one.get_type() == "FILE_TRANSFER_PROTOCOL"
    ]


@pytest.mark.parametrize("flavour", [ARDUPILOT, PX4], ids=["ardupilot", "px4"])
def test_the_tower_has_what_the_vehicle_says_once_plans_and_parameters_are_there(flavour: Flavour) -> None:
    world = drone(flavour=flavour, metadata=True)
    world.until(lambda: is_known(world), 60.0, "metadata")
    assert any(isinstance(one, ParameterCache) and one.hash is not None for one in world.reported)
    assert {one.kind for one in world.reported if isinstance(one, PlanOnBoard) and one.hash is not None} == {
        "mission",
        "fence",
        "rally",
    }
    reported = known(world)
    assert reported is not None and reported.hash is not None
    world.onboard.message(MetadataWanted(hash=reported.hash), world.now)
    world.until(
        lambda: sum(len(one.data) for one in world.reported if isinstance(one, MetadataPiece)) == reported.size_bytes
    )
    packed = b"".join(one.data for one in world.reported if isinstance(one, MetadataPiece))
    names = [one.name for one in read_metadata(unpack_text(packed)).parameters]
    assert names == [one.name for one in world.vehicle.parameters]
    assert not world.went_up("FILE_TRANSFER_PROTOCOL"), "what it reads is not on the uplink"


def test_an_arducopter_refuses_and_is_asked_once() -> None:
    world = drone()
    world.until(lambda: (known(world) or MetadataKnown(hash=None)).words == "The vehicle offers none.", 60.0)
    world.run(30.0)
    asked = [one for one in world.commands_sent(mavlink.MAV_CMD_REQUEST_MESSAGE) if one.param1 == 397]
    assert [one.get_srcComponent() for one in asked] == [COMPONENT]


@pytest.mark.parametrize("takes", [("transactions",), ()], ids=["older", "oldest"])
def test_an_older_tower_is_told_nothing_that_it_does_not_know(takes: tuple[str, ...]) -> None:
    """An unknown message type would end its channel."""
    world = drone(takes=takes, metadata=True)
    world.run(20.0)
    assert not [one for one in world.reported if isinstance(one, MetadataKnown | MetadataPiece)]
    world.link_down()
    world.takes = TAKES
    world.link_up()
    world.until(lambda: is_known(world), 10.0, "a newer tower is told at once")


def test_a_link_that_goes_on_is_told_again() -> None:
    world = drone(metadata=True)
    world.until(lambda: is_known(world), 60.0)
    world.reported.clear()
    world.onboard.resumed()
    world.until(lambda: is_known(world), 5.0)


def test_parameters_read_anew_by_the_file_are_not_held_up() -> None:
    """Both are files of an autopilot that opens one at a time."""
    world = drone(metadata=True)
    world.until(lambda: (COMPONENT, Op.READ) in ftp_sent(world), 60.0, "metadata is being read")
    began = world.now
    result = world.do(ParametersReadWork(again=True))
    assert result.outcome == "done", result.words
    assert world.now - began < 1.0
    assert not world.asked_of_autopilot("PARAM_REQUEST_LIST"), "the file was open to it at once"
    world.until(lambda: is_known(world), 60.0)


def test_a_ground_stations_file_is_opened_though_ours_is_open() -> None:
    world = drone(metadata=True)
    world.until(lambda: (COMPONENT, Op.READ) in ftp_sent(world), 60.0, "metadata is being read")
    name = b"@PARAM/param.pck"
    payload = struct.pack("<HBBBBBxI", 9, 0, Op.OPEN_TO_READ, len(name), 0, 0, 0) + name
    world.tower_sends(mavlink.MAVLink_file_transfer_protocol_message(0, 1, 1, payload.ljust(251, b"\0")))
    assert ftp_sent(world)[-2:] == [(COMPONENT, Op.TERMINATE), (190, Op.OPEN_TO_READ)]

    def answers() -> list[int]:
        return [one.payload[3] for one in world.went_up("FILE_TRANSFER_PROTOCOL") if one.target_system == 255]

    world.until(answers, 5.0)
    assert answers() == [Op.ACK]
    asked = len(ftp_sent(world))
    world.run(4.0)
    assert len(ftp_sent(world)) == asked, "it is left alone with it"
    world.until(lambda: is_known(world), 60.0, "when it has been silent for a while")


def test_nothing_is_read_in_flight() -> None:
    world = drone(metadata=True)
    world.ready().flies()
    world.run(20.0)
    assert [one for one in ftp_sent(world) if one[0] == COMPONENT] == []
    assert not is_known(world)
    assert world.command(SET_MODE, 1, LAND).outcome == "done"
    world.until(lambda: is_known(world), 90.0, "on the ground again")
    assert not world.vehicle.flight.armed
