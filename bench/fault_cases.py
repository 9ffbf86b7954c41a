"""The faults, and how each is repaired."""

from __future__ import annotations

import asyncio
import contextlib
import signal
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Final

from bench.fault_rig import FaultRig

ENDS_WITHIN_S: Final = 20.0
LASTS_S: Final = 4.0
"""Longer than a tower may be silent (3.0 s) before another one may declare it dead (3.3 s)."""

Act = Callable[[FaultRig, int], Awaitable[None]]
"""`home`: the tower that had the drone before the fault."""


@dataclass(frozen=True)
class Case:
    """`pilot_is_near`: the pilot's browser is at the drone's tower. `takes_after_s`: an admin's TAKE in the fault."""

    name: str
    inject: Act
    heal: Act
    lasts_s: float = LASTS_S
    pilot_is_near: bool = False
    takes_after_s: float | None = None
    needs_small_disk: bool = False


async def _kill_home(rig: FaultRig, home: int) -> None:
    rig.process(home).kill()
    await rig.process(home).wait()


async def _kill_other(rig: FaultRig, home: int) -> None:
    await _kill_home(rig, 1 - home)


async def _start_home(rig: FaultRig, home: int) -> None:
    await rig.start_tower_number(home)


async def _start_other(rig: FaultRig, home: int) -> None:
    await rig.start_tower_number(1 - home)


async def _drain_home(rig: FaultRig, home: int) -> None:
    await rig.drain(home)
    await asyncio.wait_for(rig.process(home).wait(), ENDS_WITHIN_S)


async def _freeze_home(rig: FaultRig, home: int) -> None:
    rig.process(home).send_signal(signal.SIGSTOP)


async def _thaw_home(rig: FaultRig, home: int) -> None:
    """It was declared dead meanwhile, ends by itself, and is started again."""
    rig.process(home).send_signal(signal.SIGCONT)
    await asyncio.wait_for(rig.process(home).wait(), ENDS_WITHIN_S)
    await rig.start_tower_number(home)


async def _kill_postgres(rig: FaultRig, _home: int) -> None:
    rig.postgres.kill()


async def _start_postgres(rig: FaultRig, _home: int) -> None:
    await rig.postgres.start()


async def _freeze_postgres(rig: FaultRig, _home: int) -> None:
    rig.postgres.freeze()


async def _thaw_postgres(rig: FaultRig, _home: int) -> None:
    rig.postgres.thaw()


async def _kill_nats(rig: FaultRig, _home: int) -> None:
    rig.nats.kill()


async def _start_nats(rig: FaultRig, _home: int) -> None:
    await asyncio.to_thread(rig.nats.start)


async def _freeze_nats(rig: FaultRig, _home: int) -> None:
    rig.nats.signal(signal.SIGSTOP)


async def _thaw_nats(rig: FaultRig, _home: int) -> None:
    rig.nats.signal(signal.SIGCONT)


async def _fill_disk(rig: FaultRig, _home: int) -> None:
    await asyncio.to_thread(rig.postgres.fill_disk)
    await rig.postgres.spend_log()


async def _empty_disk(rig: FaultRig, _home: int) -> None:
    rig.postgres.empty_disk()
    await rig.postgres.start()  # it may have ended itself


async def _lock(rig: FaultRig, _home: int) -> None:
    await rig.postgres.lock("control_leases")


async def _unlock(rig: FaultRig, _home: int) -> None:
    with contextlib.suppress(OSError):
        await rig.postgres.unlock()


CASES: Final = (
    Case("the drone's tower drained", _drain_home, _start_home, lasts_s=2.0),
    Case("the drone's tower killed", _kill_home, _start_home),
    Case("the drone's tower frozen", _freeze_home, _thaw_home, lasts_s=6.0),
    Case("the pilot's tower killed", _kill_other, _start_other),
    Case("PostgreSQL killed", _kill_postgres, _start_postgres, takes_after_s=1.0),
    Case("PostgreSQL frozen", _freeze_postgres, _thaw_postgres, takes_after_s=1.0),
    Case("NATS killed, pilot at another tower", _kill_nats, _start_nats),
    Case("NATS frozen, pilot at another tower", _freeze_nats, _thaw_nats),
    Case("NATS killed, pilot at the drone's tower", _kill_nats, _start_nats, pilot_is_near=True),
    Case("the leases locked", _lock, _unlock, takes_after_s=1.0),
    Case("the database's disk full", _fill_disk, _empty_disk, takes_after_s=1.0, needs_small_disk=True),
)
