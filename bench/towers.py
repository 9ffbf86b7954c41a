"""One, two and three towers on one PostgreSQL and one NATS: frames per processor second, what the bus adds, and TAKE.

Each tower has as many drones, and an admin's browser that watches all of them. One drone of the first tower is in focus
twice: in a browser of its own tower and in one of the last. TAKE goes to the last tower, for a drone of the first.

The host of a shared machine stops all of it for milliseconds. `steady` are the frames beside such moments, which a
process of its own notes (`bench.machine_pace`): what the bus adds is their difference.
"""

from __future__ import annotations

import argparse
import asyncio
import itertools
import json
import sys
import tempfile
import time
from contextlib import AsyncExitStack
from pathlib import Path
from typing import Any, Final

import httpx

from bench.lean_browser import LeanBrowser
from bench.load_agents import LoadAgent, Telemetry, fly, kept_alive, sign_in_all
from bench.load_frames import STATE_KINDS, read_tagged
from bench.load_tower import LoadTower, load_tower, make_fleet
from bench.machine_pace import MachinePace, machine_pace
from bench.process_cost import cpu_us, rss_mb, udp_drops
from bench.rows import Report, percentile
from wire.control_messages import HoldOrder, HoldProgress, HoldStep, ToAgent

TOWERS: Final = (1, 2, 3)
DRONES: Final = 30
FLY_S: Final = 20.0
ROUNDS: Final = 50
SETTLE_S: Final = 2.0
OUT_OF_REACH: Final = 503
READY_S: Final = 30.0
ONLINE_S: Final = 0.06
"""Of each light drone, until all are online at the last tower."""
TELEMETRY: Final = Telemetry(frames_per_s=50, kinds=STATE_KINDS)
LIGHT: Final = Telemetry(frames_per_s=1, kinds=STATE_KINDS[:3], burst=1)
STORM: Final = 16
"""Light drones that sign in at the same moment at each tower."""
TAKE_OFFS_PER_S: Final = 40
"""Flights, alerts and their rows begin with each: all at once is a storm that no fleet makes."""
CONFIRMED_S: Final = 10.0
MANY_CONFIRMED_S: Final = 30.0
"""With many drones on two cores a TAKE that is slow is a figure, and not the end of the bench."""
TESTS: Final = Path(__file__).resolve().parents[1] / "tests"
KEY: Final = "TOWER_SECRET_KEYS"


async def run(report: Report, options: argparse.Namespace) -> None:
    """`--drones N` in all, `--seconds S` of flight, `--rounds N` of TAKE. `--spread N`: only three towers with N light
    drones, which send one frame a second each."""
    sys.path.append(str(TESTS))
    from worlds.nats import nats_program, temporary_nats  # type: ignore[import-not-found]
    from worlds.postgres import postgres_programs, temporary_postgres  # type: ignore[import-not-found]

    programs, nats = postgres_programs(), nats_program()
    if programs is None or nats is None:
        report.say("PostgreSQL or NATS is missing (Debian: apt-get install postgresql nats-server)")
        return
    quick = options.quick
    drones = options.drones or (6 if quick else DRONES)
    for_s = options.seconds or (2.0 if quick else FLY_S)
    rounds = options.rounds or (5 if quick else ROUNDS)
    spread = options.spread
    for count in TOWERS[-1:] if spread else TOWERS:
        with (
            tempfile.TemporaryDirectory(prefix="bench-towers-") as folder,
            temporary_postgres(programs) as address,
            temporary_nats(nats) as bus,
        ):
            settings = {"DATABASE_URL": f"{address}/postgres"}
            if count > 1:
                settings["TOWER_BUS_URL"] = bus.url
            measuring = _measure_spread if spread else _measure
            await measuring(report, Path(folder), count, settings, drones=spread or drones, for_s=for_s, rounds=rounds)


async def _start(
    stack: AsyncExitStack, folder: Path, count: int, settings: dict[str, str], drones: int
) -> tuple[list[LoadTower], list[str]]:
    """Returns towers on one database, which end with the stack, and the keys of its drones."""
    from server.runtime.vault import new_key

    url = settings["DATABASE_URL"].replace("postgresql://", "postgresql+asyncpg://")
    keys = await make_fleet(folder, drones, url=url)
    shared = settings | {KEY: new_key()}
    starting = [load_tower(folder / str(number), drones=drones, keys=keys, settings=shared) for number in range(count)]
    return [await stack.enter_async_context(tower) for tower in starting], keys


async def _measure(
    report: Report, folder: Path, count: int, settings: dict[str, str], *, drones: int, for_s: float, rounds: int
) -> None:
    case = f"{count} tower{'s' if count > 1 else ''}"
    async with AsyncExitStack() as stack:
        towers, keys = await _start(stack, folder, count, settings, drones)
        agents: list[LoadAgent] = []
        for number, tower in enumerate(towers):
            agents += await sign_in_all(tower.url, keys[number::count])
        await stack.enter_async_context(kept_alive(agents))
        drone = agents[0]
        last = await stack.enter_async_context(
            httpx.AsyncClient(base_url=towers[-1].url, headers={"Cookie": towers[-1].cookie}, trust_env=False)
        )
        await _all_online(last, drones)
        near = _Watcher(await towers[0].browser(), drone.drone_id)
        far = _Watcher(await towers[-1].browser(), drone.drone_id)
        for tower in towers[1:-1]:
            await tower.browser()
        await asyncio.sleep(SETTLE_S)
        before = sum(cpu_us(tower.process.pid) for tower in towers)
        sent = sum(agent.sent_frames for agent in agents)
        near.ages.clear()
        far.ages.clear()
        async with machine_pace() as pace:
            await fly(agents, TELEMETRY, for_s=for_s)
            await asyncio.sleep(0.2)
        used_s = (sum(cpu_us(tower.process.pid) for tower in towers) - before) / 1e6
        sent = sum(agent.sent_frames for agent in agents) - sent
        report.add(case, "frames per processor second", sent / used_s, "1/s")
        report.add(case, "frames", sent, "count")
        report.spread(case, "age at the drone's tower", near.ages_ms, "ms")
        report.spread(case, "age at the last tower", far.ages_ms, "ms")
        near_ms, far_ms = near.steady_ms(pace), far.steady_ms(pace)
        report.spread(case, "steady: age at the drone's tower", near_ms, "ms")
        report.spread(case, "steady: age at the last tower", far_ms, "ms")
        report.add(case, "steady: p99 added", percentile(far_ms, 0.99) - percentile(near_ms, 0.99), "ms")
        added = percentile(far.ages_ms, 0.99) - percentile(near.ages_ms, 0.99)
        report.add(case, "p99 added", added, "ms")
        report.add(case, "the machine stood still", 100 * pace.slow_share, "% of looks")
        confirmed_ms = await _takes(last, far, drone, rounds)
        report.spread(case, "TAKE to confirmed hold", confirmed_ms, "ms")


async def _measure_spread(
    report: Report, folder: Path, count: int, settings: dict[str, str], *, drones: int, for_s: float, rounds: int
) -> None:
    """One admin's browser watches all drones from the last tower; TAKE goes there while they fly."""
    case = f"{drones} light drones, {count} towers"
    async with AsyncExitStack() as stack:
        towers, keys = await _start(stack, folder, count, settings, drones)
        began, before_us = time.monotonic(), [cpu_us(tower.process.pid) for tower in towers]
        shares = await asyncio.gather(
            *(
                sign_in_all(tower.url, keys[number::count], at_once=STORM, tries=20, airborne=False)
                for number, tower in enumerate(towers)
            )
        )
        agents = [agent for share in shares for agent in share]
        await stack.enter_async_context(kept_alive(agents))
        report.add(case, "all have a link", time.monotonic() - began, "s")
        last = await stack.enter_async_context(
            httpx.AsyncClient(
                base_url=towers[-1].url, headers={"Cookie": towers[-1].cookie}, trust_env=False, timeout=30
            )
        )
        await _all_online(last, drones, within_s=max(180.0, drones * ONLINE_S), pause_s=5.0)
        report.add(case, "all online, as the last tower lists them", time.monotonic() - began, "s")
        used_s = (sum(cpu_us(tower.process.pid) for tower in towers) - sum(before_us)) / 1e6
        report.add(case, "sign-in: processor of all towers", used_s, "s")
        used_s = await _take_off(agents, towers)
        report.add(case, "take-off: processor of all towers", used_s, "s")
        far = _Watcher(await towers[-1].browser(), shares[0][0].drone_id)
        await asyncio.sleep(SETTLE_S)
        before_us, sent = [cpu_us(tower.process.pid) for tower in towers], sum(agent.sent_frames for agent in agents)
        began = time.monotonic()
        flying = asyncio.create_task(fly(agents, LIGHT, for_s=for_s))
        refused: list[str] = []
        confirmed_ms = await _takes(last, far, shares[0][0], rounds, refused)
        late_s = await flying
        took_s = time.monotonic() - began
        for number, tower in enumerate(towers):
            share = (cpu_us(tower.process.pid) - before_us[number]) / 1e4 / took_s
            report.add(case, f"tower {number + 1}: processor", share, "% of one")
            report.add(case, f"tower {number + 1}: memory", rss_mb(tower.process.pid), "MB")
            report.add(case, f"tower {number + 1}: datagrams without room", udp_drops(tower.udp_port), "count")
        report.add(case, "frames", (sum(agent.sent_frames for agent in agents) - sent) / took_s, "1/s")
        report.add(case, "drones in the picture at the last tower", len(far.drones), "count")
        report.add(case, "the load was late at the worst", late_s * 1e3, "ms")
        report.spread(case, "age at the last tower", far.ages_ms, "ms")
        report.add(case, "TAKE refused: the drone's tower is not within reach", len(refused), "count")
        if confirmed_ms:
            report.spread(case, "TAKE to confirmed hold", confirmed_ms, "ms")


async def _take_off(agents: list[LoadAgent], towers: list[LoadTower]) -> float:
    """All take off, one after the other, while all send telemetry. Returns the processor time of the towers, s."""
    before_us = sum(cpu_us(tower.process.pid) for tower in towers)
    every_s = 1.0 / TAKE_OFFS_PER_S
    flying = asyncio.create_task(fly(agents, LIGHT, for_s=len(agents) * every_s + SETTLE_S))
    began = time.monotonic()
    for number, agent in enumerate(agents):
        await asyncio.sleep(max(0.0, began + number * every_s - time.monotonic()))
        await agent.report_state()
    await flying
    return (sum(cpu_us(tower.process.pid) for tower in towers) - before_us) / 1e6


async def _takes(
    client: httpx.AsyncClient, watcher: _Watcher, drone: LoadAgent, rounds: int, refused: list[str] | None = None
) -> list[float]:
    """Returns how long each TAKE took to its confirmed hold, ms. `refused`: gets the words of those that a tower
    refused because the other one was not within reach; without it that ends the bench."""
    confirming: set[asyncio.Task[None]] = set()

    def obey(message: ToAgent) -> None:
        if isinstance(message, HoldOrder):
            progress = HoldProgress(
                order_id=message.order_id,
                epoch=message.epoch,
                step=HoldStep.CONFIRMED,
                detail="ALT_HOLD",
                elapsed_ms=0.0,
            )
            task = asyncio.create_task(drone.say(progress))
            confirming.add(task)
            task.add_done_callback(confirming.discard)

    drone.on_message = obey
    path = f"/api/v1/drones/{drone.drone_id}/control"
    took_ms = []
    for _ in range(rounds):
        watcher.confirmed.clear()
        began = time.monotonic()
        answer = await client.post(f"{path}/take", json={})
        if refused is not None and answer.status_code == OUT_OF_REACH:
            refused.append(answer.text)
            await asyncio.sleep(0.5)
            continue
        _check(answer)
        await watcher.confirmation(CONFIRMED_S if refused is None else MANY_CONFIRMED_S)
        took_ms.append((time.monotonic() - began) * 1000.0)
        _check(await client.post(f"{path}/release", json={}))
        await asyncio.sleep(0.05)
    return took_ms


def _check(answer: httpx.Response) -> None:
    if not answer.is_success:
        raise RuntimeError(f"{answer.request.url.path}: {answer.status_code} {answer.text}")


async def _all_online(
    client: httpx.AsyncClient, drones: int, *, within_s: float = READY_S, pause_s: float = 0.1
) -> None:
    async with asyncio.timeout(within_s):
        for _ in itertools.count():
            answer = await client.get("/api/v1/drones")
            # A tower that is busy with sign-ins may refuse: the next answer counts.
            if answer.is_success and sum(one["online"] for one in answer.json()) == drones:
                return
            if not answer.is_success:
                print(f"GET /drones: {answer.status_code} {answer.text}", file=sys.stderr)
            await asyncio.sleep(pause_s)


class _Watcher:
    """Notes the age of each frame of the drone in focus, and each confirmed hold."""

    def __init__(self, browser: LeanBrowser, drone_id: int) -> None:
        self.ages: list[tuple[int, float]] = []
        """When each frame was sent, monotonic us, and its age, ms."""
        self.drones: set[int] = set()
        """Whose frames came."""
        self.confirmed = asyncio.Event()
        self.steps: list[str] = []
        """Of all holds that it was told of."""
        self._browser = browser
        self._drone_id = drone_id
        browser.on_binary, browser.on_text = self._frames, self._event
        browser.send_text(json.dumps({"type": "focus", "drone_id": drone_id}))

    @property
    def ages_ms(self) -> list[float]:
        return [age for _, age in self.ages]

    def steady_ms(self, pace: MachinePace) -> list[float]:
        """Without frames that met a halt of the machine."""
        return [age for sent_us, age in self.ages if not pace.stood_still_at(sent_us)]

    async def confirmation(self, within_s: float) -> None:
        """Waits for a confirmed hold. Raises RuntimeError with what the browser saw instead."""
        try:
            async with asyncio.timeout(within_s):
                await self.confirmed.wait()
        except TimeoutError:
            last = f"hold steps: {self.steps[-3:]}; the browser is {'closed' if self._browser.closed else 'open'}"
            raise RuntimeError(f"no hold was confirmed within {within_s:g} s; {last}") from None

    def _frames(self, message: bytes) -> None:
        now_us = time.monotonic() * 1e6
        frames = list(read_tagged(message))
        self.drones.update(one.drone_id for one in frames)
        self.ages += [
            (one.sent_us, (now_us - one.sent_us) / 1000.0) for one in frames if one.drone_id == self._drone_id
        ]

    def _event(self, text: bytes) -> None:
        if text.startswith(b'{"type":"hold"'):
            event: dict[str, Any] = json.loads(text)
            self.steps.append(f"{event['drone_id']} {event['step']}")
            if event["step"] == "confirmed" and event["drone_id"] == self._drone_id:
                self.confirmed.set()
        elif text.startswith(b'{"type":"ping"'):
            self._browser.send_text(json.dumps({"type": "pong", "sequence": json.loads(text)["sequence"]}))
