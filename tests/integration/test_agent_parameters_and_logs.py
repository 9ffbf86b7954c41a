"""A whole agent between a fake tower and a simulated drone: parameters and logs, over real sockets."""

from __future__ import annotations

import asyncio
import contextlib
import ssl
import sys
from collections.abc import AsyncIterator
from pathlib import Path
from random import Random
from typing import Any, NamedTuple

import pytest
from agent_fakes import DRONE, TICKET, FakeTower, keep_key, running_tower, until
from file_tower import FileTower
from worlds.free_ports import free_udp_ports

from bench.tls_front import make_certificate
from onboard_agent.link.tower_url import TowerUrl
from onboard_agent.sockets import file_sender
from onboard_agent.sockets.file_sender import TowerFileSender
from onboard_agent.transactions.file_sending import NotSent, Sending, Sent
from simulator.failure_modes import Failure
from simulator.flight_state import FlightSettings
from simulator.geodesy import Place
from simulator.links import Endpoint
from simulator.logbook import Log
from simulator.shell import Clock, VehicleSlot, _berth, _keep_time
from simulator.vehicle import Vehicle, VehicleSettings
from wire.dialect import build, decode, mavlink
from wire.parameters import unpack_table
from wire.transactions import (
    TRANSACTIONS,
    CancelTransaction,
    LogDownloadWork,
    LogEntry,
    LogListWork,
    Outcome,
    ParameterCache,
    ParameterChanged,
    ParameterRefusal,
    ParametersReadWork,
    ParametersWriteWork,
    ParameterTable,
    Transaction,
    TransactionResult,
)

LOG = Random(1).randbytes(60_000)


class World(NamedTuple):
    tower: FakeTower
    files: FileTower
    vehicle: Vehicle
    state: Path

    async def begin(self, number: int, work: Any) -> None:
        await self.tower.announce(Transaction(id=number, epoch=self.tower.epoch, deadline_s=60, work=work))

    async def result(self, number: int) -> TransactionResult:
        found = await until(
            lambda: [m for m in self.tower.messages if isinstance(m, TransactionResult) and m.id == number],
            what=f"result {number}",
        )
        return found[0]

    async def do(self, number: int, work: Any) -> TransactionResult:
        await self.begin(number, work)
        return await self.result(number)

    def reported(self, what: type) -> list[Any]:
        return [m for m in self.tower.messages if isinstance(m, what)]


@contextlib.asynccontextmanager
async def simulated(vehicle: Vehicle, port: int) -> AsyncIterator[None]:
    clock, stop = Clock(1.0), asyncio.Event()
    berth = VehicleSlot(vehicle, await _berth(vehicle, Endpoint("udp", "127.0.0.1", port), clock))
    with contextlib.closing(berth.link):
        task = asyncio.create_task(_keep_time([berth], clock, stop, None, None))
        try:
            yield
        finally:
            stop.set()
            await task


@pytest.fixture
async def world(tmp_path: Path) -> AsyncIterator[World]:
    flight = FlightSettings(Place(47.397742, 8.545594, 488.0), boot_s=0.5)
    failures = {Failure.PARAMETERS_DROPPED, Failure.LOG_DATA_DROPPED}
    vehicle = Vehicle(VehicleSettings(flight), failures)
    vehicle._logbook.logs = [Log(1_767_225_600, bytearray(LOG))]
    token = tmp_path / "token"
    keep_key(token)
    (port,) = free_udp_ports(1)
    async with running_tower() as tower, FileTower(tower.port).running() as files:
        tower.takes = (TRANSACTIONS,)
        agent = await asyncio.create_subprocess_exec(
            sys.executable,
            *("-c", "from onboard_agent.cli import main; main()", "run", "--tower", f"http://127.0.0.1:{files.port}"),
            *("--token", str(token), "--autopilot", f"udpin:127.0.0.1:{port}", "--state", str(tmp_path / "state")),
        )
        try:
            async with simulated(vehicle, port):
                await tower.linked()
                yield World(tower, files, vehicle, tmp_path / "state" / f"drone-{DRONE}")
        finally:
            agent.terminate()
            await agent.wait()


async def test_parameters_and_logs(world: World) -> None:
    await until(lambda: any(m.hash and m.verified for m in world.reported(ParameterCache)), what="the table")
    assert (await world.do(1, ParametersReadWork())).outcome is Outcome.DONE
    table = {row.name: row.value for row in unpack_table(world.reported(ParameterTable)[0].packed)}
    assert table == pytest.approx({one.name: one.value for one in world.vehicle.parameters})
    values = [m for m in map(decode, world.tower.frames) if m is not None and m.get_type() == "PARAM_VALUE"]
    assert len(values) < 100  # what the failsafes need; the list itself is not forwarded

    message = mavlink.MAVLink_param_set_message(1, 1, b"RTL_ALT", 2222.0, 6)
    world.tower.send_frames(build(message, system_id=255, component_id=190, sequence=0))
    changed = await until(lambda: world.reported(ParameterChanged), what="the change")
    assert (changed[0].name, changed[0].value) == ("RTL_ALT", 2222.0)

    asked = (("RTL_ALT", 3000.0), ("FS_THR_ENABLE", 1.5), ("LAND_SPEED", 61.0))
    result = await world.do(2, ParametersWriteWork(asked))
    assert result.words == "2 of 3 parameters are written and read back, not FS_THR_ENABLE."
    assert result.refusals == (ParameterRefusal("FS_THR_ENABLE", 1.5, 1.0, "Whole numbers only."),)
    assert (world.vehicle.parameters["RTL_ALT"], world.vehicle.parameters["LAND_SPEED"]) == (3000.0, 61.0)

    assert (await world.do(3, LogListWork())).logs == (LogEntry(1, len(LOG), 1_767_225_600),)
    world.files.answers = [0]
    await world.begin(4, LogDownloadWork(1))
    await until(lambda: world.files.stuck, what="the file is on its way")
    await world.tower.announce(CancelTransaction(id=4))
    assert (await world.result(4)).outcome is Outcome.CANCELLED
    world.files.answers = [413]
    refused = await world.do(5, LogDownloadWork(1))
    assert (refused.outcome, "The tower has no room for it. The drone keeps" in refused.words) == (Outcome.FAILED, True)
    assert (await world.do(6, LogDownloadWork(1))).outcome is Outcome.DONE
    assert world.files.files == [(f"/api/v1/agent/files/{number}", LOG) for number in (5, 6)]
    assert list((world.state / "logs").iterdir()) == []
    assert [path.suffix for path in (world.state / "parameters").iterdir()] == [".parameters"]


# The file sender alone.


async def ended(sender: TowerFileSender) -> Sent | NotSent:
    await until(lambda: not isinstance(sender.state, Sending), what="the file has gone")
    assert not isinstance(sender.state, Sending)
    return sender.state


async def test_a_tower_that_is_away_is_tried_again_and_a_wrong_credential_is_the_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(file_sender, "AGAIN_AFTER_S", 0.05)
    (tmp_path / "file").write_bytes(LOG)
    async with FileTower().running() as tower:
        port = tower.port
    sender = TowerFileSender(lambda: TowerUrl("127.0.0.1", port, secure=False), lambda: TICKET)
    sender.begin(7, tmp_path / "file")
    await asyncio.sleep(0.02)
    assert sender.state == Sending(0)
    sender.stop()
    async with FileTower().running() as tower:
        sender = TowerFileSender(lambda: TowerUrl("127.0.0.1", tower.port, secure=False), lambda: TICKET)
        sender.begin(8, tmp_path / "file")
        assert await ended(sender) == Sent()
        assert tower.files == [("/api/v1/agent/files/8", LOG)]
        sender.begin(9, tmp_path / "no file")
        assert await ended(sender) == NotSent("it is not on the disk any more")
        tower.answers = [503, 404]
        sender.begin(10, tmp_path / "file")
        assert await ended(sender) == NotSent("The tower has no room for it")


async def test_a_file_goes_to_no_tower_whose_certificate_nobody_trusts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    certificate, key = make_certificate(tmp_path, "127.0.0.1")
    secure = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    secure.load_cert_chain(certificate, key)
    (tmp_path / "file").write_bytes(LOG)
    async with FileTower().running(secure) as tower:
        sender = TowerFileSender(lambda: TowerUrl("127.0.0.1", tower.port, secure=True), lambda: TICKET)
        sender.begin(1, tmp_path / "file")
        await asyncio.sleep(0.3)
        assert (sender.state, tower.files) == (Sending(0), [])
        trusting = ssl.create_default_context(cafile=str(certificate))
        monkeypatch.setattr(file_sender, "trust", lambda: trusting)
        sender.begin(2, tmp_path / "file")
        assert await ended(sender) == Sent()
        assert tower.files == [("/api/v1/agent/files/2", LOG)]
