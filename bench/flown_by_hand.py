"""A drone flown by hand through a real tower, and what its pilot notices: gaps in its frames, lost sticks, holds.

A real agent flies it over UDP; a stub autopilot sends 50 frames per second and records the sticks received; the pilot
is a browser that sends sticks 50 times per second and answers pings.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import re
import time
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

import httpx

from bench.lean_browser import LeanBrowser
from bench.load_tower import LoadTower
from bench.pilot_sticks import take
from bench.process_cost import rss_mb
from bench.relay_sticks import StubAutopilot, real_agent
from bench.run_queue import RunQueue, run_queue_of
from wire.dialect import build, mavlink
from wire.frames import message_id
from wire.ids import DroneId
from wire.lateness import stamp_ms
from wire.tagged import split_tagged, stamp, tag

FRAME_S: Final = 0.02
STICK_S: Final = 0.02
SETTLE_S: Final = 1.0
_ATTITUDE: Final = mavlink.MAVLINK_MSG_ID_ATTITUDE
_WRONG: Final = ("tower_holds_ordered_total", "tower_links_orphaned_total", "tower_hold_steps_total")


class TalkingAutopilot(StubAutopilot):
    """Sends its attitude 50 times per second."""

    def __init__(self, agent_port: int) -> None:
        super().__init__(agent_port)
        self._talking = asyncio.create_task(self._talk())

    async def _talk(self) -> None:
        sequence, due = 0, time.monotonic()
        while True:
            sequence += 1
            message = mavlink.MAVLink_attitude_message(sequence, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
            with contextlib.suppress(OSError):
                self._socket.sendto(build(message, system_id=1, component_id=1, sequence=sequence & 0xFF), self._agent)
            due = max(due + FRAME_S, time.monotonic() - FRAME_S)
            await asyncio.sleep(due - time.monotonic())

    def close(self) -> None:
        self._talking.cancel()
        super().close()


@dataclass
class Noticed:
    """Results for one period of flight."""

    frames_at: list[float] = field(default_factory=list)
    """Arrival time of each message with a frame of the drone, monotonic seconds."""
    queues: list[tuple[RunQueue, RunQueue]] = field(default_factory=list)
    """Of tower and agent, at each of those times."""
    gaps_before_ms: list[float] = field(default_factory=list)
    """Of periods that this one is a sum of."""
    sticks_at: dict[int, float] = field(default_factory=dict)
    own_gap_ms: float = 0.0
    """The longest time that this program itself did not run: a gap below that is not the tower's."""
    sticks_ms: list[float] = field(default_factory=list)
    sticks_lost: int = 0
    wrong: dict[str, float] = field(default_factory=dict)
    """Holds that were ordered or begun, and control channels that were lost."""
    closed: bool = False
    """Whether the pilot's live channel closed."""
    rss_before_mb: float = 0.0
    rss_most_mb: float = 0.0
    rss_after_mb: float = 0.0

    @property
    def gaps_ms(self) -> list[float]:
        own = [(b - a) * 1e3 for a, b in zip(self.frames_at, self.frames_at[1:], strict=False)]
        return self.gaps_before_ms + own

    @property
    def largest_gap_ms(self) -> float:
        return max(self.gaps_ms, default=float("inf"))

    def largest_gaps(self, count: int) -> list[tuple[float, float]]:
        """Returns the largest gaps in ms, each with its beginning in seconds after the first frame."""
        begun_s = (at - self.frames_at[0] for at in self.frames_at)
        return sorted(zip(self.gaps_ms, begun_s, strict=False), reverse=True)[:count]

    def in_largest_gap(self) -> tuple[RunQueue, RunQueue]:
        """Returns how long tower and agent ran and waited for a processor during the largest gap."""
        gaps = self.gaps_ms
        at = gaps.index(max(gaps))
        (tower, agent), (tower_then, agent_then) = self.queues[at + 1], self.queues[at]
        return tower.since(tower_then), agent.since(agent_then)

    def in_all(self) -> tuple[RunQueue, RunQueue]:
        """The same from the first frame to the last."""
        (tower, agent), (tower_then, agent_then) = self.queues[-1], self.queues[0]
        return tower.since(tower_then), agent.since(agent_then)


class HandFlight:
    """Created by `flown_by_hand`."""

    def __init__(self, tower: LoadTower, drone_id: int, autopilot: StubAutopilot, browser: LeanBrowser) -> None:
        self.tower = tower
        self._drone_id = drone_id
        self._autopilot = autopilot
        self._browser = browser
        self._noticed = Noticed()
        self._number = 0
        self._before: dict[str, float] = {}
        self.hands_off = False
        """The pilot sends no sticks."""
        self.events: list[dict[str, object]] = []
        browser.on_binary = self._came
        browser.on_text = self._reported

    @property
    def agent_pid(self) -> int:
        """The process of the drone's agent."""
        return self._autopilot.agent_pid

    @contextlib.asynccontextmanager
    async def noticing(self) -> AsyncIterator[Noticed]:
        """Records what the pilot notices in the block; complete when the block has ended."""
        before = self._before = await self._wrong()
        noticed = self._noticed = Noticed(rss_before_mb=rss_mb(self.tower.process.pid))
        watching = asyncio.create_task(self._watch(noticed))
        try:
            yield noticed
        finally:
            self._noticed = Noticed()
            watching.cancel()
            await asyncio.gather(watching, return_exceptions=True)
        await asyncio.sleep(SETTLE_S)  # for sticks in transit
        arrived = self._autopilot.arrived
        noticed.sticks_ms = [(arrived[n] - at) * 1e3 for n, at in noticed.sticks_at.items() if n in arrived]
        noticed.sticks_lost = len(noticed.sticks_at) - len(noticed.sticks_ms)
        after = await self._wrong()
        noticed.rss_after_mb = rss_mb(self.tower.process.pid)
        noticed.wrong = {name: after[name] - before[name] for name in after}
        noticed.closed = self._browser.closed

    async def is_online(self, drone_id: int) -> bool:
        """Returns the tower's view."""
        return bool((await _drone(self.tower, drone_id))["online"])

    async def something_wrong(self) -> None:
        """Returns after a hold or a lost channel since the recording began."""
        while await self._wrong() == self._before:  # noqa: ASYNC110
            await asyncio.sleep(0.2)

    async def fly(self) -> None:
        """Sends sticks until cancelled."""
        due = time.monotonic()
        while True:
            if self.hands_off:
                await asyncio.sleep(STICK_S)
                due = time.monotonic()
                continue
            self._number = self._number % 0xFFFF + 1
            message = mavlink.MAVLink_manual_control_message(1, 0, 0, 500, 0, self._number)
            frame = build(message, system_id=255, component_id=190, sequence=self._number & 0xFF)
            now = time.monotonic()
            self._noticed.own_gap_ms = max(self._noticed.own_gap_ms, (now - due) * 1e3)
            self._noticed.sticks_at[self._number] = now
            self._autopilot.arrived.pop(self._number, None)
            if not self._browser.closed:
                self._browser.send_binary(stamp(stamp_ms(now)) + tag(DroneId(self._drone_id), frame))
            due = max(due + STICK_S, now)
            await asyncio.sleep(due - time.monotonic())

    async def _watch(self, noticed: Noticed) -> None:
        while True:
            noticed.rss_most_mb = max(noticed.rss_most_mb, rss_mb(self.tower.process.pid))
            await asyncio.sleep(0.5)

    async def _wrong(self) -> dict[str, float]:
        figures = await figures_of(self.tower)
        return {name: sum(value for key, value in figures.items() if key.startswith(name)) for name in _WRONG}

    def _came(self, message: bytes) -> None:
        if any(
            drone_id == self._drone_id and message_id(frame) == _ATTITUDE for drone_id, frame in split_tagged(message)
        ):
            self._noticed.frames_at.append(time.monotonic())
            self._noticed.queues.append((run_queue_of(self.tower.process.pid), run_queue_of(self.agent_pid)))

    def _reported(self, text: bytes) -> None:
        event = json.loads(text)
        if event["type"] == "ping":
            self._browser.send_text(json.dumps({"type": "pong", "sequence": event["sequence"]}))
        else:
            self.events.append(event)


async def figures_of(tower: LoadTower) -> dict[str, float]:
    """Returns the tower's metrics, by name with labels."""
    async with httpx.AsyncClient(
        base_url=tower.url, headers={"Cookie": tower.cookie}, trust_env=False, timeout=60
    ) as http:
        answer = await http.get("/metrics")
        answer.raise_for_status()
    return {key: float(value) for key, value in re.findall(r"^(tower_\S+) (\S+)$", answer.text, re.MULTILINE)}


@contextlib.asynccontextmanager
async def flown_by_hand(
    folder: Path,
    tower: LoadTower,
    *,
    pilot: LoadTower | None = None,
    made: Callable[[int], TalkingAutopilot] = TalkingAutopilot,
) -> AsyncIterator[HandFlight]:
    """Flies the tower's last drone until the block ends: as the admin, or as `pilot`, the tower with another user's
    cookie. `made`: creates its autopilot, for a port."""
    drone_id = len(tower.keys)
    pilot = pilot or tower
    async with real_agent(folder, tower.url, tower.keys[-1], made) as autopilot:
        browser = await pilot.browser()
        flight = HandFlight(tower, drone_id, autopilot, browser)
        browser.send_text(json.dumps({"type": "focus", "drone_id": drone_id}))
        await take(pilot, drone_id, "acquire")
        flying = asyncio.create_task(flight.fly())
        autopilot.is_armed = True
        try:
            async with asyncio.timeout(60):
                while not await _is_heard(flight) or not await _is_armed(tower, drone_id):
                    pass
            yield flight
        finally:
            flying.cancel()
            await asyncio.gather(flying, return_exceptions=True)


async def _drone(tower: LoadTower, drone_id: int) -> dict[str, object]:
    async with httpx.AsyncClient(base_url=tower.url, headers={"Cookie": tower.cookie}, trust_env=False) as http:
        answer = await http.get(f"/api/v1/drones/{drone_id}")
        answer.raise_for_status()
        return dict(answer.json())


async def _is_armed(tower: LoadTower, drone_id: int) -> bool:
    """A disarmed drone would never be held."""
    return bool((await _drone(tower, drone_id))["armed"])


async def _is_heard(flight: HandFlight) -> bool:
    """Returns whether frames arrive at the rate at which they are sent."""
    async with flight.noticing() as noticed:
        await asyncio.sleep(1.0)
    return len(noticed.frames_at) > 0.5 / FRAME_S
