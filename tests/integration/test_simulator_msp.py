"""`tower-sim --msp` and the agent's MSP port, over a real TCP connection."""

from __future__ import annotations

import asyncio
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from worlds.free_ports import free_tcp_port, free_udp_ports

from onboard_agent.autopilot_port.schemes import make_port
from simulator.dialect import Codec, mavlink

DEADLINE_S = 30.0


@pytest.fixture
def port(tmp_path: Path) -> Iterator[int]:
    """The MSP port of a vehicle that is ready to arm after half a second."""
    number, said = free_tcp_port(), tmp_path / "said"
    command = [str(Path(sys.executable).with_name("tower-sim")), "--home", "47.3977,8.5456,488,0", "--boot-s", "0.5"]
    command += ["--out", f"udp:127.0.0.1:{free_udp_ports(1)[0]}", "--msp", f"tcpin:127.0.0.1:{number}", "--commander"]
    with said.open("wb") as out:
        process = subprocess.Popen(command, stdout=out, stderr=subprocess.STDOUT)
    yield number
    process.send_signal(signal.SIGINT)
    try:
        assert process.wait(20) == 0, said.read_text()
    finally:
        if process.poll() is None:
            process.kill()
            process.wait()


async def test_the_agents_port_sees_it_and_arms_it(port: int) -> None:
    line, ears, pilot = make_port(f"msp:tcp:127.0.0.1:{port}"), Codec(255, 190), Codec(255, 190)
    seen: dict[str, Any] = {}
    more = asyncio.Event()

    def received(data: bytes) -> None:
        seen.update((message.get_type(), message) for message in ears.decode(data))
        more.set()

    async def until_seen(name: str, what: str, value: int) -> None:
        while name not in seen or not getattr(seen[name], what) & value:
            more.clear()
            await more.wait()

    running = asyncio.create_task(line.run(received))
    try:
        async with asyncio.timeout(DEADLINE_S):
            await until_seen("GLOBAL_POSITION_INT", "lat", -1)
            assert seen["GLOBAL_POSITION_INT"].lat == pytest.approx(473_977_000, abs=20)
            assert not seen["HEARTBEAT"].base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED
            arm = mavlink.MAVLink_command_long_message(1, 1, mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0, 1, *([0.0] * 6))
            line.send(pilot.encode(arm))
            await until_seen("HEARTBEAT", "base_mode", mavlink.MAV_MODE_FLAG_SAFETY_ARMED)
    finally:
        running.cancel()
        await asyncio.wait({running})
