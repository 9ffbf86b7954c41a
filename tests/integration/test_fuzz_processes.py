"""The short form of `python -m bench fuzz` through real sockets: a tower and an agent as processes."""

import asyncio
import contextlib
import json
import sys
from pathlib import Path

import pytest
from agent_fakes import DRONE, FakeTower, keep_key, running_autopilot, running_tower, until
from worlds.processes import free_udp_ports

from bench.fuzz import KINDS
from bench.fuzz_cores import chance_of
from bench.fuzz_datagrams import DatagramFuzzer
from bench.fuzz_tower import fuzzed_tower
from wire.control_messages import HoldOrder, encode_message
from wire.dialect import build, mavlink

pytestmark = pytest.mark.long("fuzzing of whole programs; test_fuzz_datagrams.py does it in one")

MESSAGES = 400
DATAGRAMS = 2000
PING = build(mavlink.MAVLink_ping_message(1, 2, 1, 1), system_id=255, component_id=190, sequence=0)


async def test_a_tower_under_attack_keeps_account_and_serves_the_others(tmp_path: Path) -> None:
    async with fuzzed_tower(tmp_path) as tower:
        await tower.send_datagrams(chance_of(6, "datagrams"), DATAGRAMS)
        assert await tower.drone_online(2)
        for kind in KINDS:
            account = await tower.attack(kind, chance_of(6, kind), MESSAGES)
            assert account.wrong == []
            assert account.messages == MESSAGES
            assert account.accepted
            assert account.refused
        assert tower.alive
        assert await tower.drone_online(1)
        await tower.witness.stop()
        await until(lambda: not tower.witness.lost(), what="every event at the other browser")
        assert tower.errors_in_log() == []


async def test_an_agent_under_attack_of_its_own_tower_serves_on(tmp_path: Path) -> None:
    """Its socket accepts datagrams from the tower's address only, so the tower itself has to attack."""
    token = tmp_path / "token"
    keep_key(token)
    port = free_udp_ports(1)[0]
    log = tmp_path / "agent.log"
    async with running_tower() as tower:
        command = [str(Path(sys.executable).parent / "tower-agent"), "run"]
        command += ["--tower", f"http://127.0.0.1:{tower.port}", "--token", str(token)]
        command += ["--autopilot", f"udpin:127.0.0.1:{port}", "--state", str(tmp_path / "state")]
        with log.open("wb") as out:
            agent = await asyncio.create_subprocess_exec(*command, stdout=out, stderr=out)
        try:
            await tower.linked(timeout_s=20)
            async with running_autopilot(port) as autopilot:
                await until(lambda: tower.frames, what="the autopilot's first frame")
                await _attack(tower)
                # A new sign-in corrects an epoch that the mutations have falsified.
                assert tower.connection is not None
                tower.connection.transport.abort()
                await tower.linked(times=2, timeout_s=20)
                await _gets_through(tower, autopilot.frames)
            assert agent.returncode is None
        finally:
            with contextlib.suppress(ProcessLookupError):
                agent.terminate()
            await agent.wait()
    said = log.read_text(errors="replace")
    assert "Traceback" not in said
    assert "CRITICAL" not in said


async def _attack(tower: FakeTower) -> None:
    assert tower.sealed is not None
    order = json.loads(encode_message(HoldOrder(order_id=1, epoch=1, reason="the controls were taken")))
    fuzzer = DatagramFuzzer(
        chance_of(6, "agent"), sender=tower.sealed, urgent=order, epoch=lambda: tower.epoch, fenced=True
    )
    for number in range(DATAGRAMS):
        tower.send_raw(fuzzer.next().datagram)
        if number % 16 == 0:
            await asyncio.sleep(0.002)


async def _gets_through(tower: FakeTower, frames: list[bytes]) -> None:
    async with asyncio.timeout(30):
        while PING not in frames:
            tower.send_frames(PING, drone_id=DRONE)
            await asyncio.sleep(0.02)
