"""A third-party client attached to `tower-sim` directly: pymavlink's own mavutil, which this product never uses."""

from __future__ import annotations

import asyncio
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from worlds.free_ports import free_tcp_port, free_udp_ports

SPEED = 5
DEADLINE_S = 60.0
HOME = "47.397742,8.545594,488,90"


@pytest.fixture
def free_port() -> int:
    return free_udp_ports(1)[0]


@pytest.fixture
def start() -> Iterator[Callable[..., subprocess.Popen[str]]]:
    """Starts `tower-sim` and ends it afterwards."""
    started: list[subprocess.Popen[str]] = []

    def run(*arguments: str) -> subprocess.Popen[str]:
        command = [str(Path(sys.executable).with_name("tower-sim")), "--home", HOME, *arguments]
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        started.append(process)
        return process

    yield run
    for process in started:
        if process.poll() is None:
            process.kill()
        process.wait(10)
        if process.stdout is not None:
            process.stdout.close()


def receive(master: Any, kind: str, condition: Callable[[Any], bool] = lambda _: True) -> Any:
    end_s = time.monotonic() + DEADLINE_S
    while time.monotonic() < end_s:
        message = master.recv_match(type=kind, blocking=True, timeout=1)
        if message is not None and condition(message):
            return message
    raise AssertionError(f"no such {kind}")


def command(master: Any, number: int, *params: float) -> int:
    seven = (*params, *([0.0] * (7 - len(params))))
    master.mav.command_long_send(1, 1, number, 0, *seven)
    return int(receive(master, "COMMAND_ACK", lambda m: m.command == number).result)


def test_heartbeat_parameters_mission_arming_and_take_off(free_port, start, monkeypatch):
    monkeypatch.setenv("MAVLINK20", "1")
    from pymavlink import mavutil

    start("--out", f"udp:127.0.0.1:{free_port}", "--speed", str(SPEED), "--boot-s", "2", "--param-count", "1500")
    master = mavutil.mavlink_connection(f"udpin:127.0.0.1:{free_port}", source_system=255)
    try:
        assert master.wait_heartbeat(timeout=DEADLINE_S) is not None
        assert master.target_system == 1
        assert master.flightmode == "STABILIZE"

        parameters = download_parameters(master)
        assert len(parameters) == 1500
        assert parameters["SYSID_MYGCS"] == 255

        sent = upload_mission(master, mavutil.mavlink)
        assert download_mission(master) == sent

        m = mavutil.mavlink
        ask_for_position(master, m)
        receive(master, "GPS_RAW_INT", lambda gps: gps.fix_type >= 3)
        assert command(master, m.MAV_CMD_DO_SET_MODE, 1, 4) == 0
        receive(master, "HEARTBEAT", lambda beat: beat.custom_mode == 4)
        end_s = time.monotonic() + DEADLINE_S
        while command(master, m.MAV_CMD_COMPONENT_ARM_DISARM, 1) != 0:
            assert time.monotonic() < end_s, "it never armed"
        assert command(master, m.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 10) == 0
        receive(master, "GLOBAL_POSITION_INT", lambda p: abs(p.relative_alt - 10_000) < 300)
        assert master.motors_armed()
    finally:
        master.close()


def download_parameters(master: Any) -> dict[str, float]:
    """Downloads as ground stations do: requests all, then the missing ones one by one."""
    values: dict[int, tuple[str, float]] = {}
    count = None
    master.param_fetch_all()
    end_s = time.monotonic() + DEADLINE_S
    while count is None or len(values) < count:
        assert time.monotonic() < end_s, f"{len(values)} of {count} parameters"
        message = master.recv_match(type="PARAM_VALUE", blocking=True, timeout=1)
        if message is None:
            for index in [i for i in range(count or 0) if i not in values][:50]:
                master.param_fetch_one(index)
        elif message.param_index != 65535:
            count = message.param_count
            values[message.param_index] = (message.param_id, message.param_value)
    return dict(values.values())


def upload_mission(master: Any, m: Any) -> list[tuple[Any, ...]]:
    items = [(16, 0, 473977420, 85455940, 488.0), (22, 3, 0, 0, 12.0)]
    items += [(16, 3, 473977420 + 900 * i, 85455940, 12.0) for i in range(8)] + [(20, 0, 0, 0, 0.0)]
    master.mav.mission_count_send(1, 1, len(items), 0)
    while True:
        message = receive(master, ["MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_ACK"])
        if message.get_type() == "MISSION_ACK":
            assert message.type == m.MAV_MISSION_ACCEPTED
            return items[1:]
        number, frame, x, y, z = items[message.seq]
        master.mav.mission_item_int_send(1, 1, message.seq, frame, number, 0, 1, 0, 0, 0, 0, x, y, z, 0)


def download_mission(master: Any) -> list[tuple[Any, ...]]:
    """Returns the mission without slot 0, which is home."""
    master.mav.mission_request_list_send(1, 1, 0)
    count = receive(master, "MISSION_COUNT").count
    items = []
    for seq in range(count):
        master.mav.mission_request_int_send(1, 1, seq, 0)
        item = receive(master, "MISSION_ITEM_INT", lambda m, seq=seq: m.seq == seq)
        items.append((item.command, item.frame, item.x, item.y, item.z))
    return items[1:]


def ask_for_position(master: Any, m: Any) -> None:
    for message_id in (m.MAVLINK_MSG_ID_GLOBAL_POSITION_INT, m.MAVLINK_MSG_ID_GPS_RAW_INT):
        assert command(master, m.MAV_CMD_SET_MESSAGE_INTERVAL, message_id, 200_000) == 0


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_it_cleanly_and_fast(free_port, start, number):
    process = start("--out", f"udp:127.0.0.1:{free_port}", "--count", "3")
    assert process.stdout is not None
    assert f"vehicle 1 of 3: sysid 1 on udp:127.0.0.1:{free_port}" in process.stdout.readline()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ears:
        ears.settimeout(DEADLINE_S)
        ears.bind(("127.0.0.1", free_port))
        ears.recv(500)  # it flies, so its signal handlers are installed
    process.send_signal(number)
    assert process.wait(60) == 0
    assert "Traceback" not in process.stdout.read()


def test_bad_options_are_told_in_words(start):
    process = start("--out", "udp:127.0.0.1:1", "--out", "udp:127.0.0.1:2", "--count", "3")
    output, _ = process.communicate(timeout=30)
    assert process.returncode == 2
    assert "2 times --out for 3 vehicles" in output


async def test_only_the_peer_is_heard_and_a_missing_peer_is_waited_for(free_port, start):
    """Each vehicle has its own socket, connected to its peer: a stranger's packets never arrive."""
    start("--out", f"udp:127.0.0.1:{free_port}", "--boot-s", "1")
    loop = asyncio.get_running_loop()
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as peer,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger,
    ):
        for sock in (peer, stranger):
            sock.setblocking(False)
        peer.bind(("127.0.0.1", free_port))
        _, vehicle = await asyncio.wait_for(loop.sock_recvfrom(peer, 500), DEADLINE_S)
        ping = ping_frame()
        await loop.sock_sendto(stranger, ping, vehicle)
        await loop.sock_sendto(peer, ping, vehicle)
        answers = 0
        end_s = loop.time() + DEADLINE_S
        while answers == 0 or loop.time() < end_s:
            data = await asyncio.wait_for(loop.sock_recv(peer, 500), DEADLINE_S)
            if int.from_bytes(data[7:10], "little") == 4:
                answers += 1
            elif answers and data[7:10] == b"\0\0\0":
                break  # a heartbeat later: a second response would have arrived by now
        assert answers == 1


def ping_frame() -> bytes:
    from simulator.dialect import Codec, mavlink

    return Codec(255, 190).encode(mavlink.MAVLink_ping_message(1, 1, 0, 0))


async def test_tcp_both_ways(start):
    """`tcpin:` waits for a ground station, `tcp:` connects to one."""
    connected: asyncio.Queue[bytes] = asyncio.Queue()

    async def accept(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await connected.put(await reader.read(10))
        writer.close()

    async with await asyncio.start_server(accept, "127.0.0.1", 0) as server:
        start("--out", f"tcp:127.0.0.1:{server.sockets[0].getsockname()[1]}")
        assert (await asyncio.wait_for(connected.get(), DEADLINE_S))[0] == 0xFD

    port = free_tcp_port()
    start("--out", f"tcpin:127.0.0.1:{port}")
    loop = asyncio.get_running_loop()
    end_s = loop.time() + DEADLINE_S
    while True:
        try:
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
            break
        except ConnectionRefusedError:
            assert loop.time() < end_s, "it never listened"
            await asyncio.sleep(0.05)
    writer.write(ping_frame())
    data = b""
    while b"\x04\0\0" not in data:
        data += await asyncio.wait_for(reader.read(500), DEADLINE_S)
    writer.close()
