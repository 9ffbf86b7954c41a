"""Uploads plans to a real autopilot and reads them back with the agent's own plan handler, without tower and link."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Final, NamedTuple, Protocol

from bench.real_autopilot import RealAutopilot, Receiver
from bench.rig import wait_for
from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.transactions.plan_handler import PlanHandler, PlanWork
from wire.autopilots.ardupilot_plans import ArduPilot
from wire.dialect import mavlink
from wire.firmware import release_of
from wire.frames import MalformedFrame, split_frames
from wire.plan_fields import KeptFields
from wire.plans import Plan, PlanItem, PlanKind, unpack_plan
from wire.transactions import PlanClearWork, PlanDownloadWork, PlanUploadWork, Transaction, TransactionResult

TICK_S: Final = 0.005
WITHIN_S: Final = 60.0


class Kept(NamedTuple):
    """`plan`: read back from the autopilot afterwards. None: refused, with the reason in `result`."""

    result: TransactionResult
    plan: Plan | None


class _Journal:
    def __init__(self) -> None:
        self._records: dict[PlanKind, bytes] = {}

    def load(self, kind: PlanKind) -> bytes | None:
        return self._records.get(kind)

    def save(self, kind: PlanKind, record: bytes) -> None:
        self._records[kind] = record

    def remove(self, kind: PlanKind) -> None:
        self._records.pop(kind, None)


class Autopilot(Protocol):
    """An autopilot that sends its MAVLink to a socket."""

    @property
    def port(self) -> socket.socket:
        """A non-blocking socket."""


class PlanExchange:
    """Runs one transaction at a time."""

    def __init__(self, autopilot: Autopilot, keeping: KeptFields) -> None:
        self.autopilot = autopilot
        self.keeping = keeping
        self._handler = PlanHandler(FrameMaker(), _Journal())
        self._loop = asyncio.get_running_loop()
        self._address: tuple[str, int] | None = None
        self._number = 0
        home_slot = isinstance(keeping, ArduPilot)
        self._handler.autopilot_came(vehicle_system_id=1, home_slot=home_slot, keeping=keeping, now=self._loop.time())

    async def do(self, work: PlanWork) -> TransactionResult:
        """Runs the work to its result. Raises TimeoutError."""
        self._number += 1
        self._handler.begin(Transaction(id=self._number, epoch=0, deadline_s=WITHIN_S, work=work), self._loop.time())
        async with asyncio.timeout(2 * WITHIN_S):
            while True:
                for reported in self._handler.reports():
                    if isinstance(reported, TransactionResult):
                        return reported
                self._step()
                await asyncio.sleep(TICK_S)

    async def read(self, kind: PlanKind) -> Plan:
        """Reads the plan on board."""
        result = await self.do(PlanDownloadWork(kind))
        assert result.plan is not None, result.words
        return unpack_plan(result.plan)[1]

    async def upload(self, kind: PlanKind, *items: PlanItem) -> Kept:
        """Uploads to an empty vehicle."""
        await self.do(PlanClearWork(kind))
        result = await self.do(PlanUploadWork(kind, items))
        return Kept(result, await self.read(kind) if result.outcome == "done" else None)

    def _step(self) -> None:
        port = self.autopilot.port
        with contextlib.suppress(BlockingIOError, ConnectionError):
            while True:
                data, self._address = port.recvfrom(4096)
                with contextlib.suppress(MalformedFrame):
                    for frame in split_frames(data):
                        self._handler.receive(frame, self._loop.time())
        if self._address is not None:
            for frame in self._handler.due(self._loop.time()):
                port.sendto(frame, self._address)


@contextlib.asynccontextmanager
async def plan_exchange(program: Path, folder: Path, keeping: KeptFields | None = None) -> AsyncIterator[PlanExchange]:
    """Uses a fresh ArduCopter, or the autopilot that `keeping` describes."""
    autopilot = RealAutopilot(program, folder, receiver=Receiver.LOW)
    try:
        await autopilot.start()
        yield PlanExchange(autopilot, keeping or await _of_its_release(autopilot))
    finally:
        await asyncio.shield(autopilot.stop())


async def _of_its_release(autopilot: RealAutopilot) -> ArduPilot:
    """Its table, by the release that it reports."""
    truth = autopilot.truth
    await truth.ask(mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
    await wait_for("the release of the autopilot", lambda: truth.firmware != 0, 3.0)
    return ArduPilot(release=release_of(truth.firmware))
