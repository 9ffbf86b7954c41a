"""What QGroundControl asks a vehicle when it connects, through `tower connect`: every answer comes, each time whole."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final

import pytest
from test_connect import HEARTBEAT, Program, connect
from worlds.processes import World, wait_for

from onboard_agent.transactions.parameter_file import read_parameter_file
from wire.dialect import mavlink

PARAMETERS: Final = 1391
RUNS: Final = 20
SILENT_LOOKS: Final = 50
"""Of 20 ms each, without a parameter: then QGroundControl asks for what it lacks, ten at a time."""
BATCH: Final = 10
LOOKS_MOST: Final = 1500
OPEN, READ, BURST, TERMINATE, ACK = 4, 5, 15, 1, 128
HEAD: Final = struct.Struct("<HBBBBBxI")
BLOCK: Final = 239
VERSION, METADATA, CAMERA, GIMBAL, MODES = 148, 397, 259, 280, 435


@pytest.fixture
def station(tmp_path: Path) -> Iterator[tuple[World, Program]]:
    """Kestrel of alice with as many parameters as the real one, and a program that flies it."""
    with World(tmp_path) as world:
        world.add_user("alice")
        world.add_drone("Kestrel", "alice")
        world.start_tower()
        world.start_simulated("Kestrel", options=("--boot-s", "1", "--param-count", str(PARAMETERS)))
        scopes = ("--scope", "watch", "--scope", "fly")
        world.tower_command("token", "add", "alice", "station", *scopes, "--token-file", str(tmp_path / "token"))
        world.wait_until_online(world.visitor("alice"), 1)
        program = Program(connect(world, "--fly", "--tcp", "127.0.0.1:0"))
        yield world, program
        program.close()


def listed(program: Program) -> tuple[int, int]:
    """How many came, and how many of them had to be asked for one by one."""
    program.messages.clear()
    program.say(mavlink.MAVLink_param_request_list_message(1, 1))
    lacking, batch = set(range(PARAMETERS)), set[int]()
    silent = asked = 0
    for _ in range(LOOKS_MOST):
        before = len(lacking)
        lacking -= {one.param_index for one in program.listen() if one is not None and one.get_type() == "PARAM_VALUE"}
        program.messages.clear()
        if not lacking:
            break
        silent = silent + 1 if len(lacking) == before else 0
        if silent == SILENT_LOOKS or (batch and not batch & lacking):
            program.say(HEARTBEAT)
            batch, silent = set(sorted(lacking)[:BATCH]), 0
            asked += len(batch)
            for index in batch:
                program.say(mavlink.MAVLink_param_request_read_message(1, 1, b"", index))
    return PARAMETERS - len(lacking), asked


class Files:
    """MAVLink FTP as QGroundControl speaks it: open, a burst, the holes, close."""

    def __init__(self, program: Program) -> None:
        self._program = program
        self._sequence = 0

    def _say(self, op: int, *, size: int = 0, offset: int = 0, data: bytes = b"") -> None:
        self._sequence += 1
        payload = HEAD.pack(self._sequence, 0, op, len(data) or size, 0, 0, offset) + data
        message = mavlink.MAVLink_file_transfer_protocol_message(0, 1, 1, payload.ljust(251, b"\0"))
        self._program.say(message)

    def _answers(self) -> Iterator[tuple[int, int, int, bytes]]:
        """Opcode, that of the request, offset, data."""
        for one in self._program.listen():
            if one is not None and one.get_type() == "FILE_TRANSFER_PROTOCOL" and one.target_system == 255:
                payload = bytes(one.payload)
                _, _, op, size, request, _, offset = HEAD.unpack_from(payload)
                yield op, request, offset, payload[HEAD.size : HEAD.size + size]
        self._program.messages.clear()

    def _until(self, what: str, look: Callable[[tuple[int, int, int, bytes]], bool]) -> None:
        def looked() -> bool:
            found = [look(one) for one in self._answers()]  # at each of them
            return any(found)

        wait_for(what, looked, timeout_s=10.0)

    def read(self, name: bytes) -> bytes:
        blocks: dict[int, bytes] = {}

        def block(one: tuple[int, int, int, bytes]) -> bool:
            op, request, offset, data = one
            if op == ACK and request in (READ, BURST):
                blocks[offset] = data
            return request == BURST and (op != ACK or len(data) < BLOCK)

        self._say(OPEN, data=name)
        self._until("the file to open", lambda one: one[:2] == (ACK, OPEN))
        self._say(BURST, size=BLOCK)
        self._until("the end of the burst", block)
        end = max(offset + len(data) for offset, data in blocks.items())
        for offset in range(0, end, BLOCK):
            while offset not in blocks:
                self._say(READ, size=BLOCK, offset=offset)
                self._until("a hole", lambda one: block(one) or one[1] == READ)
        self._say(TERMINATE)
        self._until("the file to close", lambda one: one[1] == TERMINATE)
        return b"".join(blocks[offset] for offset in sorted(blocks))


def plan_counts(program: Program) -> list[int]:
    """Of mission, fence and rally points."""
    counts: list[int] = []
    for kind in range(3):
        program.messages.clear()
        program.say(mavlink.MAVLink_mission_request_list_message(1, 1, kind))
        wait_for(f"plan {kind}", lambda kind=kind: program.has("MISSION_COUNT", mission_type=kind), timeout_s=10.0)
        counts += [one.count for one in program.messages if one is not None and one.get_type() == "MISSION_COUNT"][:1]
        program.say(mavlink.MAVLink_mission_ack_message(1, 1, 0, kind))
    return counts


def ask(message_id: int) -> Any:
    return mavlink.MAVLink_command_long_message(1, 1, 512, 0, message_id, *[0.0] * 6)


def test_a_ground_station_has_all_that_it_asks_for_when_it_connects(station: tuple[World, Program]) -> None:
    _, program = station
    program.say(HEARTBEAT)
    wait_for("a heartbeat", lambda: program.has("HEARTBEAT", autopilot=3))
    assert program.answer_to(ask(VERSION)) == mavlink.MAV_RESULT_ACCEPTED
    wait_for("AUTOPILOT_VERSION", lambda: program.has("AUTOPILOT_VERSION"))
    for message_id in (MODES, METADATA, CAMERA, GIMBAL):
        assert program.answer_to(ask(message_id)) != mavlink.MAV_RESULT_ACCEPTED, "it has none, and says so at once"
    assert plan_counts(program)[1:] == [0, 0]


def test_all_parameters_come_each_time_by_list_and_by_file_while_others_read_as_well(
    station: tuple[World, Program],
) -> None:
    world, program = station
    alice = world.visitor("alice")
    wait_for("the agent's own reading", lambda: alice.ask("GET", "/drones/1/parameters").status == 200)
    for run in range(RUNS):
        program.say(HEARTBEAT)
        if run % 2:
            begun = alice.ask("POST", "/drones/1/parameters/read", {}, Prefer="respond-async")
            assert begun.status in (202, 409), begun.body
        got, asked = listed(program)
        assert got == PARAMETERS, f"run {run}, {asked} asked for one by one"
    for run in range(RUNS):
        program.say(HEARTBEAT)
        packed = read_parameter_file(Files(program).read(b"@PARAM/param.pck?withdefaults=1"))
        assert len(packed.parameters) == packed.count == PARAMETERS, f"run {run}"
