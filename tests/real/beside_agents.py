"""Real autopilots for synchronous tests: in their own thread, each at its agent's port.

with beside_agents(program, folder, {port: HOME}) as autopilots:
    autopilots[0].photographs   # its camera's reports since then
"""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final, NamedTuple

from bench.autopilot_tap import AutopilotTap
from bench.real_autopilot import RealAutopilot, Receiver
from wire.dialect import decode, mavlink
from wire.frames import message_id

Home = tuple[float, float, float]
START_S: Final = 200.0
CAMERA: Final = {"CAM1_TYPE": 1, "SERVO9_FUNCTION": 10}
"""Configures a shutter on an output, so that the autopilot takes photographs and reports their positions."""
_FEEDBACK: Final = mavlink.MAVLINK_MSG_ID_CAMERA_FEEDBACK


class Photograph(NamedTuple):
    """Fields of CAMERA_FEEDBACK. `height_m`: above home."""

    number: int
    lat_e7: int
    lon_e7: int
    height_m: float


class PhotographedTap(AutopilotTap):
    """An AutopilotTap that records photographs."""

    def __init__(self, agent: tuple[str, int], autopilot: RealAutopilot) -> None:
        super().__init__(agent, autopilot)
        self.photographs: list[Photograph] = []

    def _keep(self, frame: bytes, now: float) -> bool:
        if message_id(frame) == _FEEDBACK:
            reported = decode(frame)
            assert reported is not None
            self.photographs.append(Photograph(reported.img_idx, reported.lat, reported.lng, reported.alt_rel))
        return super()._keep(frame, now)


class _Squad:
    def __init__(self, program: Path, folder: Path, homes: Mapping[int, Home]) -> None:
        self._program, self._folder, self._homes = program, folder, homes
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._run, name="autopilots")
        self._autopilots: list[RealAutopilot] = []
        self.taps: list[PhotographedTap] = []

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        self._loop.run_forever()
        self._loop.close()

    def start(self) -> None:
        self._thread.start()
        asyncio.run_coroutine_threadsafe(self._start(), self._loop).result(START_S)

    async def _start(self) -> None:
        for number, (port, home) in enumerate(self._homes.items()):
            autopilot = RealAutopilot(
                self._program,
                self._folder / f"autopilot-{number}",
                receiver=Receiver.LOW,
                parameters=CAMERA,
                home=home,
            )
            self._autopilots.append(autopilot)
            await autopilot.start()
            tap = PhotographedTap(("127.0.0.1", port), autopilot)
            tap.open()
            self.taps.append(tap)

    def stop(self) -> None:
        asyncio.run_coroutine_threadsafe(self._stop(), self._loop).result(START_S)
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()

    async def _stop(self) -> None:
        for tap in self.taps:
            tap.close()
        for autopilot in self._autopilots:
            await autopilot.stop()


@contextlib.contextmanager
def beside_agents(program: Path, folder: Path, homes: Mapping[int, Home]) -> Iterator[list[PhotographedTap]]:
    """`homes`: by the UDP port on which the drone's agent listens. Yields once all are ready to arm."""
    squad = _Squad(program, folder, homes)
    try:
        squad.start()
        yield squad.taps
    finally:
        squad.stop()
