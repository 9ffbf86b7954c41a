"""Flies a real autopilot without tower and agent: a ground station's sticks and commands go straight to its port."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any, Final

from bench.real_autopilot import RealAutopilot, Receiver
from bench.rig import wait_for
from bench.truth import Truth
from wire.dialect import mavlink

STICKS_S: Final = 0.05
GROUND_STATION: Final = 255
ACCEPTED: Final = mavlink.MAV_RESULT_ACCEPTED
MODES: Final = {"STABILIZE": 0, "ALT_HOLD": 2, "GUIDED": 4, "LOITER": 5, "RTL": 6, "CIRCLE": 7, "LAND": 9, "BRAKE": 17}
CENTRED, DOWN, CLIMB, DESCEND = (0, 0, 500, 0), (0, 0, 0, 0), (0, 0, 1000, 0), (0, 0, 0, 0)
RELEASED: Final = (32767,) * 4


class ByWire:
    """Sends `sticks` 20 times a second; None: sends none."""

    def __init__(self, autopilot: RealAutopilot) -> None:
        self.autopilot = autopilot
        self.truth: Truth = autopilot.truth
        self.sticks: tuple[int, ...] | None = None
        self._streaming = asyncio.create_task(self._stream())

    async def _stream(self) -> None:
        while True:
            if self.sticks is not None:
                message: Any = mavlink.MAVLink_manual_control_message(1, *self.sticks, 0)
                self.truth.send(message, system_id=GROUND_STATION, component_id=190)
            await asyncio.sleep(STICKS_S)

    @property
    def now(self) -> float:
        return asyncio.get_running_loop().time()

    @property
    def mode(self) -> str:
        return next((name for name, number in MODES.items() if number == self.truth.mode), str(self.truth.mode))

    async def change_mode(self, name: str) -> int:
        """Returns the MAV_RESULT. If accepted, waits until the autopilot shows the mode."""
        result = await self.truth.ask(mavlink.MAV_CMD_DO_SET_MODE, 1, MODES[name])
        if result == ACCEPTED:
            await wait_for(name, lambda: self.mode == name, 3)
        return result

    async def arm(self) -> tuple[int, str]:
        """Returns the MAV_RESULT, and the autopilot's text about it."""
        count = len(self.truth.texts)
        result = await self.truth.ask(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1)
        await asyncio.sleep(0.3)
        return result, "; ".join(text for _, text in self.truth.texts[count:])

    async def up(self, height_m: float) -> None:
        """Arms in GUIDED with throttle down, climbs, and continues in ALT_HOLD with centred sticks."""
        await self.change_mode("GUIDED")
        self.sticks = DOWN
        await asyncio.sleep(0.5)

        async def armed() -> bool:
            return bool((await self.arm())[0] == ACCEPTED)

        await wait_for("it to arm", armed, 40)
        assert await self.truth.ask(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, height_m) == ACCEPTED
        self.sticks = CENTRED
        await wait_for("the height", lambda: self.truth.alt_m > height_m - 0.5, 40)
        await self.change_mode("ALT_HOLD")
        await asyncio.sleep(2.0)

    async def passed(self, seconds: float) -> None:
        until = self.now + seconds
        await wait_for("time to pass", lambda: self.now >= until, seconds + 5)

    async def end(self) -> None:
        self._streaming.cancel()
        await asyncio.gather(self._streaming, return_exceptions=True)


@contextlib.asynccontextmanager
async def by_wire(
    program: Path, folder: Path, receiver: Receiver, parameters: dict[str, float] | None = None
) -> AsyncIterator[ByWire]:
    """A fresh autopilot on the ground, ready to arm."""
    autopilot = RealAutopilot(program, folder, receiver=receiver, parameters=parameters)
    try:
        await autopilot.start()
        hands = ByWire(autopilot)
        try:
            yield hands
        finally:
            await hands.end()
    finally:
        await asyncio.shield(autopilot.stop())
