"""The command `tower-agent` as a process: its exit codes, one line for each mistake, signals, systemd."""

import asyncio
import contextlib
import os
import pty
import signal
import socket
import sys
import tty
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from agent_fakes import DRONE, KEY, keep_key, running_tower, until

from wire.dialect import build, mavlink

FRAME = build(mavlink.MAVLink_heartbeat_message(2, 3, 81, 5, 4, 3), system_id=1, component_id=1, sequence=7)
STARTED_WITHIN_S = 60.0


@pytest.fixture
def token(tmp_path: Path) -> Path:
    file = tmp_path / "token"
    keep_key(file)
    return file


@contextlib.asynccontextmanager
async def process(*arguments: str, **environment: str) -> AsyncIterator[asyncio.subprocess.Process]:
    started = await asyncio.create_subprocess_exec(
        sys.executable,
        "-c",
        "from onboard_agent.cli import main; main()",
        *arguments,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
        env={**os.environ, **environment},
    )
    try:
        yield started
    finally:
        with contextlib.suppress(ProcessLookupError):
            started.kill()
        await started.communicate()


async def ends(*arguments: str, **environment: str) -> tuple[int | None, list[str]]:
    async with process(*arguments, **environment) as started:
        _, errors = await asyncio.wait_for(started.communicate(), STARTED_WITHIN_S)
        return started.returncode, errors.decode().splitlines()


async def test_what_a_restart_does_not_cure_ends_with_code_2_and_one_line(token: Path, tmp_path: Path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        good = {"--tower": "http://127.0.0.1:9", "--token": str(token), "--autopilot": "udpin:127.0.0.1:0"}
        broken = tmp_path / "broken"
        broken.write_text("not a token")
        mistakes = [
            ({"--tower": "http://203.0.113.5"}, "plain http"),
            ({"--token": str(tmp_path / "nothing")}, "cannot be read"),
            ({"--token": str(broken)}, "does not contain a drone's key"),
            ({"--autopilot": "bluetooth:1"}, "is of no known kind; known: udpin:HOST:PORT"),
            ({"--autopilot": f"udpin:127.0.0.1:{taken.getsockname()[1]}"}, "used by another program"),
        ]
        for mistake, said in mistakes:
            arguments = [text for pair in (good | mistake).items() for text in pair]
            code, lines = await ends("run", *arguments)
            assert code == 2, (mistake, lines)
            assert said in lines[-1]
            assert not any("Traceback" in line for line in lines)


async def test_a_whole_agent_on_a_serial_line_under_systemd(token: Path, tmp_path: Path) -> None:
    notifications = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    notifications.bind(str(tmp_path / "notify"))
    notifications.setblocking(False)
    master, device = pty.openpty()
    tty.setraw(master)
    os.set_blocking(master, False)
    reported: list[str] = []

    def notified(text: str) -> bool:
        with contextlib.suppress(BlockingIOError):
            while True:
                reported.append(notifications.recv(4096).decode())
        return text in reported

    def from_agent() -> bytes:
        with contextlib.suppress(BlockingIOError):
            return os.read(master, 65536)
        return b""

    try:
        async with (
            running_tower() as tower,
            process(
                "run",
                TOWER_AGENT_TOWER=f"http://127.0.0.1:{tower.port}",
                TOWER_AGENT_TOKEN=str(token),
                TOWER_AGENT_AUTOPILOT=f"serial:{os.ttyname(device)}:115200",
                STATE_DIRECTORY=str(tmp_path / "state"),
                NOTIFY_SOCKET=str(tmp_path / "notify"),
                WATCHDOG_USEC="300000",
            ) as started,
        ):
            await tower.linked(timeout_s=STARTED_WITHIN_S)
            await until(lambda: notified("READY=1"))
            await until(lambda: notified("WATCHDOG=1"))
            assert (tmp_path / "state" / f"drone-{DRONE}").is_dir()
            os.write(master, FRAME)
            await until(lambda: FRAME in tower.frames)
            await until(lambda: notified("STATUS=tower linked, autopilot heard, disarmed"))
            await until(lambda: b"\xfd" in from_agent(), what="the agent asks its autopilot for rates")
            started.send_signal(signal.SIGTERM)
            _, errors = await asyncio.wait_for(started.communicate(), 30.0)
            assert started.returncode == 0, errors.decode()
            assert "Traceback" not in errors.decode()
            assert str(KEY) not in errors.decode()
            assert notified("STOPPING=1")
    finally:
        notifications.close()
        os.close(master)
        os.close(device)


async def test_check_says_in_words_what_works(token: Path) -> None:
    async with running_tower() as tower:
        arguments = ("check", "--tower", f"http://127.0.0.1:{tower.port}", "--token", str(token))
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as autopilot:
            autopilot.bind(("127.0.0.1", 0))
            autopilot.setblocking(False)
            port = autopilot.getsockname()[1]
            async with process(*arguments, "--autopilot", f"udpout:127.0.0.1:{port}") as started:
                finished = asyncio.create_task(started.communicate())

                def answer() -> bool:
                    with contextlib.suppress(BlockingIOError):
                        _, sender = autopilot.recvfrom(4096)
                        autopilot.sendto(FRAME, sender)
                    return finished.done()

                await until(answer, STARTED_WITHIN_S)
                said = (await finished)[0].decode()
                assert started.returncode == 0, said
        assert said.count("ok ") == 3
        assert "accepts the drone's key" in said
        assert "the autopilot is heard: system 1" in said
        assert not tower.hellos, "a check takes no link from a flying agent"
