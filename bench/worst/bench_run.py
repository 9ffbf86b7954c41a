"""`python -m bench worst`: how long the worst request or message may keep the tower's event loop.

A tower in this process, on asyncio's own loop, with a database as large as it may become (`full_database`): 200 drones,
500 zones of 500 points, 10,000 flights; 100 agents and 10 browsers are connected. An admin asks every route for its
worst: the largest body that its schema allows, bodies that are wrong in every dear way (`bodies`), and named ones
(`named`); an agent and a browser send the worst of each message. Reported for each: the longest that it kept the loop,
in processor time, the answer's size and the growth of memory; and a fixed piece of work, to compare machines by.

Rule: each body goes `--rounds` times (3), the first one uncounted, because it compiles statements; the *smallest* of
the others counts, because the machine's own halts only ever add. See docs/bench.md.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import logging
import os
import tempfile
import time
from collections.abc import Awaitable, Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import httpx
import msgspec
import structlog
from websockets.exceptions import ConnectionClosed

from bench.lean_browser import LeanBrowser, connect_browser
from bench.load_agents import LoadAgent, Telemetry, fly, kept_alive, sign_in_all
from bench.load_frames import STATE_KINDS
from bench.load_tower import ADMIN, BROWSER_SUBPROTOCOL, PASSWORD, make_fleet
from bench.process_cost import rss_mb
from bench.rows import Report
from bench.worst.bodies import WorstBodies
from bench.worst.cases import Case, cases_of
from bench.worst.clocked_loop import ClockedLoop
from bench.worst.full_database import DRONES, fill
from server.app.composition import create_app
from server.app.serving import TowerServer
from server.app.tower import TowerApp
from server.kernel.shares import SHARES, ShareName
from server.live.live_messages import FromBrowser
from server.runtime.garbage import settle_memory
from server.runtime.listening import address_in_words, listen
from server.runtime.settings import Settings
from server.storage.database import open_database
from wire.control_messages import ToTower
from wire.zones.nearby import ZONES

MOST_MS: Final = 20.0
ROUNDS: Final = 3
AGENTS: Final = 100
BROWSERS: Final = 10
SHOWN: Final = 30
MESSAGE_BYTES: Final = 60_000
AFTER_MESSAGE_S: Final = 0.3
"""What a message causes has begun and ended by then."""
START_S: Final = 60.0
DEADLINE_S: Final = 60.0
TOO_MANY: Final = 429
CLOSED: Final = 499
FIXED_STEPS: Final = 200_000


@dataclass
class Worst:
    """Of one route or message."""

    loop_ms: float = 0.0
    body: str = ""
    answer_kb: float = 0.0
    grown_mb: float = 0.0
    statuses: set[int] = field(default_factory=set)

    def add(self, loop_ms: float, body: str) -> None:
        if loop_ms >= self.loop_ms:
            self.loop_ms, self.body = loop_ms, body


async def run(report: Report, options: argparse.Namespace) -> None:
    """`--rounds`, `--case TEXT` (only routes and messages with this in their name)."""
    rounds = max(2, options.rounds or ROUNDS)
    wanted = options.case or [""]
    with tempfile.TemporaryDirectory(prefix="bench-worst-") as place:
        folder = options.keep or Path(place)
        keys = (await make_fleet(folder, DRONES))[:AGENTS]
        settings = Settings(
            var=folder, web=folder / "no-console", port=0, udp_port=0, argon2_memory_kib=64, argon2_rounds=1,
            argon2_process=False, database_timeout_s=20.0, agent_frames_per_s=1_000_000, agent_frames_burst=1_000_000,
            shares=((ShareName.REQUEST_TIME, SHARES[ShareName.REQUEST_TIME].most),),
        )  # fmt: skip
        database = open_database(settings.database_url)
        await fill(database)
        await database.close()
        structlog.configure(wrapper_class=structlog.make_filtering_bound_logger(logging.CRITICAL))
        app = create_app(settings)
        listener = listen("127.0.0.1", 0)
        url = address_in_words(listener)
        listening = asyncio.Event()
        server = TowerServer(app, on_listening=listening.set)
        loop = ClockedLoop()
        serving = asyncio.create_task(server.run_on(listener))
        await asyncio.wait_for(listening.wait(), START_S)
        settle_memory()
        before_ms = fixed_work_ms()
        try:
            with loop.clocking(asyncio.get_running_loop()):
                asking = Asking(url, app, loop, rounds, wanted)
                found = await asyncio.to_thread(lambda: asyncio.run(asking.everything(keys)))
        finally:
            server.should_exit = True
            await serving
        after_ms = fixed_work_ms()
    _report(report, found, min(before_ms, after_ms))


def fixed_work_ms() -> float:
    """Processor time of a fixed piece of work, the best of five."""
    took = []
    for _ in range(5):
        began = time.thread_time()
        sum(number * number for number in range(FIXED_STEPS))
        took.append(1e3 * (time.thread_time() - began))
    return min(took)


def _report(report: Report, found: Mapping[str, Worst], fixed_ms: float) -> None:
    order = sorted(found, key=lambda name: -found[name].loop_ms)
    report.add("conditions", "a fixed piece of work", fixed_ms, "ms")
    report.add("conditions", "routes and messages", len(found), "count")
    report.add("largest", "time on the loop", found[order[0]].loop_ms, "ms")
    report.add("largest", "as times of the fixed piece", found[order[0]].loop_ms / fixed_ms, "ratio")
    report.add("largest", f"above {MOST_MS:.0f} ms", sum(one.loop_ms > MOST_MS for one in found.values()), "count")
    for number, name in enumerate(order):
        one = found[name]
        said = f"{name} ({one.body}; {', '.join(map(str, sorted(one.statuses))) or 'message'})"
        report.add(said, "time on the loop", one.loop_ms, "ms")
        if number < SHOWN:
            report.add(said, "answer", one.answer_kb, "kB")
            report.add(said, "memory grew by", one.grown_mb, "MB")


class Asking:
    """Runs in a thread and a loop of its own, so that its work is not counted."""

    def __init__(self, url: str, app: TowerApp, loop: ClockedLoop, rounds: int, wanted: list[str]) -> None:
        self._url = url
        self._app = app
        self._loop = loop
        self._rounds = rounds
        self._wanted = wanted
        self._cookie = ""
        self._found: dict[str, Worst] = {}

    async def everything(self, keys: list[str]) -> dict[str, Worst]:
        """The worst of each route and message by name."""
        headers = {"Origin": self._url}
        async with contextlib.AsyncExitStack() as stack:
            client = await stack.enter_async_context(
                httpx.AsyncClient(base_url=self._url, headers=headers, trust_env=False, timeout=DEADLINE_S)
            )
            await self._sign_in(client)
            self._cookie = "; ".join(f"{name}={value}" for name, value in client.cookies.items())
            for _ in range(BROWSERS):
                stack.callback((await self._browser()).close)
            agents = await sign_in_all(self._url, keys, takes=(ZONES,), airborne=True)
            await stack.enter_async_context(kept_alive(agents))
            await fly(agents, Telemetry(frames_per_s=4, kinds=STATE_KINDS), for_s=3.0)
            await self._idle()
            await self._messages(keys[0])
            for case in cases_of(self._app):
                if self._is_wanted(case.name):
                    await self._route(client, case)
        return self._found

    async def _browser(self) -> LeanBrowser:
        browser = await connect_browser(
            self._url, path="/api/v1/live", cookie=self._cookie, subprotocol=BROWSER_SUBPROTOCOL
        )
        browser.send_text('{"type":"focus","drone_id":1}')
        return browser

    def _is_wanted(self, name: str) -> bool:
        return any(one in name for one in self._wanted)

    async def _sign_in(self, client: httpx.AsyncClient) -> None:
        answer = await client.post("/api/v1/session", json={"name": ADMIN, "password": PASSWORD})
        answer.raise_for_status()

    async def _idle(self) -> None:
        """What the tower does by itself, in five seconds."""
        self._loop.begin()
        await asyncio.sleep(5.0)
        self._found["nothing asked"] = Worst(1e3 * self._loop.longest_s, "5 s")

    async def _route(self, client: httpx.AsyncClient, case: Case) -> None:
        worst = self._found[case.name] = Worst()
        for body_name, body in case.bodies.items():
            took = []
            before_mb = rss_mb(os.getpid())
            for _ in range(self._rounds):
                answer = await self._asked(client, case, body)
                worst.statuses.add(answer.status_code)
                worst.answer_kb = max(worst.answer_kb, len(answer.content) / 1e3)
                took.append(1e3 * self._loop.longest_s)
                if answer.status_code == 401:
                    await self._sign_in(client)
            worst.grown_mb = max(worst.grown_mb, rss_mb(os.getpid()) - before_mb)
            worst.add(min(took[1:]), body_name)

    async def _asked(self, client: httpx.AsyncClient, case: Case, body: bytes | None) -> httpx.Response:
        headers = {"Content-Type": case.content_type} if body is not None else {}
        while True:
            self._loop.begin()
            try:
                answer = await client.request(case.method, case.path, params=case.query, content=body, headers=headers)
            except httpx.HTTPError:  # the tower has closed the connection
                answer = httpx.Response(CLOSED)
            await asyncio.sleep(0.02)  # what follows it
            if answer.status_code != TOO_MANY:
                return answer
            await asyncio.sleep(min(5.0, float(answer.headers.get("Retry-After", 1.0))))

    async def _messages(self, key: str) -> None:
        """Of an agent and of a browser, which come back when the tower has closed them: that is an answer too."""
        agents: list[LoadAgent] = []
        browsers: list[LeanBrowser] = []

        async def by_agent(text: str) -> None:
            if not agents:
                agents[:] = await sign_in_all(self._url, [key], airborne=True)
            try:
                await agents[0].say_text(text)
            except ConnectionClosed:
                await agents.pop().close()

        async def by_browser(text: str) -> None:
            if not browsers or browsers[0].closed:
                browsers[:] = [await self._browser()]
            browsers[0].send_text(text)

        for who, union, send in (("agent", ToTower, by_agent), ("browser", FromBrowser, by_browser)):
            for name, bodies in _message_bodies(union):
                if self._is_wanted(f"{who}: {name}"):
                    await self._message(f"{who}: {name}", bodies, send)
        for one in agents:
            await one.close()
        for browser in browsers:
            browser.close()

    async def _message(self, name: str, bodies: dict[str, bytes], send: Callable[[str], Awaitable[None]]) -> None:
        worst = self._found[name] = Worst()
        for body_name, body in bodies.items():
            took = []
            for _ in range(self._rounds):
                self._loop.begin()
                await send(body.decode())
                await asyncio.sleep(AFTER_MESSAGE_S)
                took.append(1e3 * self._loop.longest_s)
            worst.add(min(took[1:]), body_name)


def _message_bodies(union: Any) -> Iterator[tuple[str, dict[str, bytes]]]:
    (schema,), components = msgspec.json.schema_components((union,), ref_template="#/{name}")
    make = WorstBodies(components, MESSAGE_BYTES)
    for choice in schema["anyOf"]:
        yield choice["$ref"].rpartition("/")[2], {"largest": make.of(choice), **dict(make.wrong(choice))}
