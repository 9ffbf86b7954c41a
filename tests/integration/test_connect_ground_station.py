"""QGroundControl's requests when it connects through `tower connect`: every response arrives, and is complete."""

from __future__ import annotations

import contextlib
import json
import lzma
import select
import socket
import struct
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final

import pytest
from test_connect import HEARTBEAT, Program, connect
from worlds.processes import Visitor, World, free_tcp_port, free_udp_ports, wait_for

from onboard_agent.transactions.metadata_general import mavlink_crc32
from onboard_agent.transactions.parameter_file import read_parameter_file
from wire.dialect import mavlink

PARAMETERS: Final = 1391
RUNS: Final = 20
SILENT_CHECKS: Final = 50
"""Checks of 20 ms each without a parameter. After that QGroundControl requests missing ones, ten at a time."""
BATCH: Final = 10
MAX_CHECKS: Final = 1500
OPEN, READ, BURST, TERMINATE, ACK = 4, 5, 15, 1, 128
HEAD: Final = struct.Struct("<HBBBBBxI")
BLOCK: Final = 239
VERSION, METADATA, CAMERA, GIMBAL, MODES = 148, 397, 259, 280, 435
AUTOPILOT, CAMERA_COMPONENT, GIMBAL_COMPONENT = 1, 100, 154
OF_CAMERA: Final = {
    259: "CAMERA_INFORMATION",
    260: "CAMERA_SETTINGS",
    261: "STORAGE_INFORMATION",
    262: "CAMERA_CAPTURE_STATUS",
    269: "VIDEO_STREAM_INFORMATION",
    270: "VIDEO_STREAM_STATUS",
}
OF_GIMBAL: Final = {283: "GIMBAL_DEVICE_INFORMATION", 285: "GIMBAL_DEVICE_ATTITUDE_STATUS"}
OF_MANAGER: Final = {280: "GIMBAL_MANAGER_INFORMATION", 281: "GIMBAL_MANAGER_STATUS"}


class Wire:
    """A proxy between simulator and agent that records all bytes from the vehicle."""

    def __init__(self, agent_port: int) -> None:
        self._vehicle, self._agent = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))
        self._vehicle.bind(("127.0.0.1", 0))
        self._agent.connect(("127.0.0.1", agent_port))
        for end in (self._vehicle, self._agent):
            end.setblocking(False)  # the error that made it readable may be gone at the read
        self.port: int = self._vehicle.getsockname()[1]
        self.said: set[bytes] = set()
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._carry, daemon=True)
        self._thread.start()

    def _carry(self) -> None:
        vehicle: Any = None
        while not self._over.is_set():
            for ready in select.select([self._vehicle, self._agent], [], [], 0.1)[0]:
                with contextlib.suppress(ConnectionError, BlockingIOError):  # the agent is not there yet
                    if ready is self._vehicle:
                        frame, vehicle = self._vehicle.recvfrom(65536)
                        self.said.add(frame)
                        self._agent.send(frame)
                    elif vehicle is not None:
                        self._vehicle.sendto(self._agent.recv(65536), vehicle)

    def close(self) -> None:
        self._over.set()
        self._thread.join()
        self._vehicle.close()
        self._agent.close()


@pytest.fixture
def station(tmp_path: Path) -> Iterator[tuple[World, Program, Wire]]:
    """alice's Kestrel with as many parameters as a real one, a video camera, a gimbal and metadata, and a program that
    flies it."""
    with World(tmp_path) as world:
        world.add_user("alice")
        world.add_drone("Kestrel", "alice")
        world.start_tower()
        (port,) = free_udp_ports(1)
        world.start_agent("Kestrel", f"udpin:127.0.0.1:{port}")
        wire = Wire(port)
        out = ("--out", f"udp:127.0.0.1:{wire.port}", "--boot-s", "1", "--param-count", str(PARAMETERS))
        payloads = ("--camera", str(free_tcp_port()), "--camera-component", "--gimbal", "--metadata")
        world.start("simulator", "tower-sim", "--home", "47.3977,8.5456,488,0", *out, *payloads)
        scopes = ("--scope", "watch", "--scope", "fly")
        world.tower_command("token", "add", "alice", "station", *scopes, "--token-file", str(tmp_path / "token"))
        world.wait_until_online(world.visitor("alice"), 1)
        program = Program(connect(world, "--fly", "--tcp", "127.0.0.1:0"))
        yield world, program, wire
        program.close()
        wire.close()


def listed(program: Program) -> tuple[int, int]:
    """Returns how many were received, and how many of them were requested one by one."""
    program.messages.clear()
    program.say(mavlink.MAVLink_param_request_list_message(1, 1))
    lacking, batch = set(range(PARAMETERS)), set[int]()
    silent = asked = 0
    for _ in range(MAX_CHECKS):
        before = len(lacking)
        lacking -= {one.param_index for one in program.listen() if one is not None and one.get_type() == "PARAM_VALUE"}
        program.messages.clear()
        if not lacking:
            break
        silent = silent + 1 if len(lacking) == before else 0
        if silent == SILENT_CHECKS or (batch and not batch & lacking):
            program.say(HEARTBEAT)
            batch, silent = set(sorted(lacking)[:BATCH]), 0
            asked += len(batch)
            for index in batch:
                program.say(mavlink.MAVLink_param_request_read_message(1, 1, b"", index))
    return PARAMETERS - len(lacking), asked


class Files:
    """MAVLink FTP as QGroundControl uses it: open, a burst, the gaps, close."""

    def __init__(self, program: Program) -> None:
        self._program = program
        self._sequence = 0

    def _say(self, op: int, *, size: int = 0, offset: int = 0, data: bytes = b"") -> None:
        self._sequence += 1
        payload = HEAD.pack(self._sequence, 0, op, len(data) or size, 0, 0, offset) + data
        message = mavlink.MAVLink_file_transfer_protocol_message(0, 1, 1, payload.ljust(251, b"\0"))
        self._program.say(message)

    def _answers(self) -> Iterator[tuple[int, int, int, bytes]]:
        """Yields the response's opcode, the request's opcode, the offset and the data."""
        for one in self._program.listen():
            if one is not None and one.get_type() == "FILE_TRANSFER_PROTOCOL" and one.target_system == 255:
                payload = bytes(one.payload)
                sequence, _, op, size, request, _, offset = HEAD.unpack_from(payload)
                self._sequence = max(self._sequence, sequence)  # the next request follows all responses
                yield op, request, offset, payload[HEAD.size : HEAD.size + size]
        self._program.messages.clear()

    def _until(self, what: str, look: Callable[[tuple[int, int, int, bytes]], bool]) -> None:
        def looked() -> bool:
            found = [look(one) for one in self._answers()]  # checks each response
            return any(found)

        wait_for(what, looked, timeout_s=30.0)

    def _open(self, name: bytes) -> None:
        """Asks again, as every ground station does: a datagram may be lost beside those of all parameters."""
        asked_at = float("-inf")

        def opened() -> bool:
            nonlocal asked_at
            if time.monotonic() - asked_at > 2.0:
                asked_at = time.monotonic()
                self._say(OPEN, data=name)
            answers = [one[:2] for one in self._answers()]  # all are read
            return (ACK, OPEN) in answers

        wait_for("the file to open", opened, timeout_s=30.0)

    def read(self, name: bytes) -> bytes:
        blocks: dict[int, bytes] = {}

        def block(one: tuple[int, int, int, bytes]) -> bool:
            op, request, offset, data = one
            if op == ACK and request in (READ, BURST):
                blocks[offset] = data
            return request == BURST and (op != ACK or len(data) < BLOCK)

        self._open(name)
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
    """Returns the counts of mission, fence and rally points."""
    counts: list[int] = []
    for kind in range(3):
        program.messages.clear()
        program.say(mavlink.MAVLink_mission_request_list_message(1, 1, kind))
        wait_for(f"plan {kind}", lambda kind=kind: program.has("MISSION_COUNT", mission_type=kind), timeout_s=10.0)
        counts += [one.count for one in program.messages if one is not None and one.get_type() == "MISSION_COUNT"][:1]
        program.say(mavlink.MAVLink_mission_ack_message(1, 1, 0, kind))
    return counts


def ask(message_id: int, component: int = AUTOPILOT) -> Any:
    return mavlink.MAVLink_command_long_message(1, component, 512, 0, message_id, *[0.0] * 6)


def answer_of(program: Program, component: int, message_id: int, name: str) -> Any:
    """Requests this message from a component until it responds."""
    said_at = [0]

    def answered() -> Any:
        if said_at[0] % 50 == 0:
            program.say(HEARTBEAT)
            program.say(ask(message_id, component))
        said_at[0] += 1
        of_it = [m for m in program.listen() if m is not None and m.get_srcComponent() == component]
        to_us = [m for m in of_it if m.get_type() == "COMMAND_ACK" and (m.command, m.target_system) == (512, 255)]
        assert all(ack.result == mavlink.MAV_RESULT_ACCEPTED for ack in to_us), f"{name} is refused"
        return next((m for m in of_it if m.get_type() == name), None) if to_us else None

    program.messages.clear()
    return wait_for(name, answered)


def metadata_of(program: Program) -> tuple[int, str]:
    """Returns CRC and address of the general file, from the raw frame: ArduPilot's dialect lacks the message."""
    assert program.answer_to(ask(METADATA)) == mavlink.MAV_RESULT_ACCEPTED

    def come() -> bytes | None:
        program.listen()
        frames = [frame for frame in program.frames if int.from_bytes(frame[7:10], "little") == METADATA]
        return frames[-1] if frames else None

    frame = wait_for("COMPONENT_METADATA", come)
    _, crc, address = struct.unpack("<II100s", frame[10 : 10 + frame[1]].ljust(108, b"\0"))
    return crc, address.rstrip(b"\0").decode()


def test_a_ground_station_has_all_that_it_asks_for_when_it_connects(station: tuple[World, Program, Wire]) -> None:
    world, program, wire = station
    known(world.visitor("alice"))  # the agent reads a file too, and an autopilot opens one at a time
    program.say(HEARTBEAT)
    wait_for("a heartbeat", lambda: program.has("HEARTBEAT", autopilot=3))
    assert program.answer_to(ask(VERSION)) == mavlink.MAV_RESULT_ACCEPTED
    wait_for("AUTOPILOT_VERSION", lambda: program.has("AUTOPILOT_VERSION"))
    assert program.answer_to(ask(MODES)) != mavlink.MAV_RESULT_ACCEPTED, "it has none, and says so at once"
    # The vehicle's own metadata, by MAVLink FTP.
    crc, address = metadata_of(program)
    general = Files(program).read(address.removeprefix("mftp://").encode())
    assert mavlink_crc32(general) == crc
    (offer,) = json.loads(general)["metadataTypes"]
    packed = Files(program).read(offer["uri"].removeprefix("mftp://").encode())
    assert mavlink_crc32(packed) == offer["fileCrc"]
    assert len(json.loads(lzma.decompress(packed))["parameters"]) == PARAMETERS
    # Components beside the autopilot, detected by their heartbeats.
    for component, kind in ((CAMERA_COMPONENT, mavlink.MAV_TYPE_CAMERA), (GIMBAL_COMPONENT, mavlink.MAV_TYPE_GIMBAL)):
        wait_for("a heartbeat", lambda kind=kind: program.has("HEARTBEAT", type=kind, autopilot=8))
        assert {m.get_srcComponent() for m in program.messages if m is not None and is_beat_of(m, kind)} == {component}
    found = {name: answer_of(program, CAMERA_COMPONENT, number, name) for number, name in OF_CAMERA.items()}
    camera, stream = found["CAMERA_INFORMATION"], found["VIDEO_STREAM_INFORMATION"]
    assert camera.flags & mavlink.CAMERA_CAP_FLAGS_HAS_VIDEO_STREAM
    assert stream.uri.startswith("http://127.0.0.1:")
    assert found["VIDEO_STREAM_STATUS"].stream_id == stream.stream_id
    assert found["STORAGE_INFORMATION"].available_capacity == found["CAMERA_CAPTURE_STATUS"].available_capacity > 0
    manager = {name: answer_of(program, AUTOPILOT, number, name) for number, name in OF_MANAGER.items()}
    gimbal = {name: answer_of(program, GIMBAL_COMPONENT, number, name) for number, name in OF_GIMBAL.items()}
    device = gimbal["GIMBAL_DEVICE_INFORMATION"]
    assert manager["GIMBAL_MANAGER_STATUS"].gimbal_device_id == camera.gimbal_device_id == GIMBAL_COMPONENT
    assert manager["GIMBAL_MANAGER_INFORMATION"].cap_flags == device.cap_flags
    assert list(gimbal["GIMBAL_DEVICE_ATTITUDE_STATUS"].q) == [1.0, 0.0, 0.0, 0.0]
    assert plan_counts(program)[1:] == [0, 0]
    # Every byte is unchanged.
    theirs = [frame for frame in program.frames if frame[6] in (CAMERA_COMPONENT, GIMBAL_COMPONENT)]
    assert {int.from_bytes(frame[7:10], "little") for frame in theirs} >= {0, *OF_CAMERA, *OF_GIMBAL}
    changed = [frame.hex() for frame in theirs if frame not in wire.said]
    assert changed == []


PARAMETERS_AT: Final = "/drones/1/parameters"


def known(alice: Visitor, more: str = "") -> None:
    """Waits until the agent has read them for itself and the tower has the result."""
    wait_for(f"parameters{more}", lambda: alice.ask("GET", PARAMETERS_AT + more).status == 200, timeout_s=60.0)


def is_beat_of(message: Any, kind: int) -> bool:
    return bool(message.get_type() == "HEARTBEAT" and message.type == kind)


def test_what_the_vehicle_says_of_its_parameters_comes_to_the_console(station: tuple[World, Program, Wire]) -> None:
    world, _, _ = station
    alice = world.visitor("alice")
    known(alice, "/metadata")
    document = json.loads(alice.ask("GET", f"{PARAMETERS_AT}/metadata").body)
    assert len(document["parameters"]) == PARAMETERS
    found = {one["name"]: one for one in document["parameters"]}
    assert (found["RTL_ALT"]["units"], found["RTL_ALT"]["default"]) == ("cm", 1500.0)


def test_all_parameters_come_each_time_by_list_and_by_file_while_others_read_as_well(
    station: tuple[World, Program, Wire],
) -> None:
    world, program, _ = station
    alice = world.visitor("alice")
    known(alice)
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
