"""A signed-in operator, with a drone and an agent of his own, who tries to disturb others: one process for each kind.

`python -m bench.tenant_attacks KIND URL COOKIE DRONE_KEY SECONDS NICE`. At the end a line of JSON on standard output
reports what was done.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import random
import sys
import time
from collections import Counter
from collections.abc import AsyncIterator, Awaitable, Callable
from typing import Any, Final

import httpx

from bench.load_agents import LoadAgent, kept_alive, sign_in_all
from onboard_agent.sockets.control_channel import NoLink
from wire.dialect import build, mavlink

LAT_E7, LON_E7 = 470_000_000, 80_000_000
ITEMS: Final = 724
AT_A_TIME: Final = 4
DEADLINE_S: Final = 60.0


class TenantAttack:
    """His means, and what he has done."""

    def __init__(self, url: str, cookie: str, key: str, seconds: float) -> None:
        self.url = url
        self.key = key
        self._cookie = cookie
        self._ends_at = time.monotonic() + seconds
        self._agent_lock = asyncio.Lock()
        self._agent: LoadAgent | None = None
        self.done: Counter[str] = Counter()
        self.chance = random.Random(41)

    @property
    def goes_on(self) -> bool:
        return time.monotonic() < self._ends_at

    def client(self, *, signed_in: bool = True) -> httpx.AsyncClient:
        headers = {"Cookie": self._cookie, "Origin": self.url} if signed_in else {}
        return httpx.AsyncClient(base_url=f"{self.url}/api/v1", headers=headers, trust_env=False, timeout=DEADLINE_S)

    async def again_and_again(self, ask: Callable[[httpx.AsyncClient], Awaitable[httpx.Response]], *,
                              at_a_time: int = AT_A_TIME, signed_in: bool = True) -> None:  # fmt: skip
        """Asks on several connections, each as soon as it has its answer."""

        async def one() -> None:
            async with self.client(signed_in=signed_in) as client:
                while self.goes_on:
                    try:
                        answer = await ask(client)
                    except httpx.HTTPError as error:
                        self.done[type(error).__name__] += 1
                        continue
                    self.done[str(answer.status_code)] += 1
                    if answer.status_code == 429:
                        await asyncio.sleep(0.2)

        await asyncio.gather(*(one() for _ in range(at_a_time)))

    @contextlib.asynccontextmanager
    async def agent(self) -> AsyncIterator[LoadAgent]:
        """His drone, armed and in the air: one for whatever goes on at the same time."""
        if self._agent is not None:
            yield self._agent
            return
        async with self._agent_lock:
            if self._agent is None:
                agent = await self._signed_in()
                mode = 81 | mavlink.MAV_MODE_FLAG_SAFETY_ARMED
                agent.send([_frame(mavlink.MAVLink_heartbeat_message(2, 3, mode, 5, 4, 3))], time.monotonic())
                self._agent = agent
        async with kept_alive([self._agent]):
            yield self._agent

    async def _signed_in(self) -> LoadAgent:
        """As an agent does, he goes on trying on a busy machine."""
        while True:
            try:
                (agent,) = await sign_in_all(self.url, [self.key], airborne=True)
            except NoLink:
                self.done["sign-ins that failed"] += 1
                await asyncio.sleep(0.5)
            else:
                return agent

    async def say(self, per_s: float, message: Callable[[int], Any]) -> None:
        """His vehicle sends this so often."""
        async with self.agent() as agent:
            number = 0
            while self.goes_on:
                number += 1
                agent.send([_frame(message(number))], time.monotonic())
                self.done["frames"] += 1
                await asyncio.sleep(1 / per_s)


def _frame(message: Any) -> bytes:
    return build(message, system_id=1, component_id=1, sequence=0)


async def shapes(attack: TenantAttack) -> None:
    """A KML of 400 kB: placemarks in placemarks, around as many shapes as there may be elements."""
    deep, many = 34, 45_000
    text = f"<kml><Document>{'<Placemark>' * deep}{'<Point/>' * many}{'</Placemark>' * deep}</Document></kml>"
    await attack.again_and_again(lambda client: client.post("/zones/shapes", json={"text": text}))


async def plans(attack: TenantAttack) -> None:
    """A mission of 724 items in the middle of all zones, and only asked about."""
    chance = attack.chance
    items = [
        [16, 3, [0, 0, 0, None], LAT_E7 + chance.randint(-900_000, 900_000), LON_E7 + chance.randint(-900_000, 900_000),
         50, 1] for _ in range(ITEMS)
    ]  # fmt: skip
    async with attack.agent() as agent:
        place = mavlink.MAVLink_global_position_int_message(1, LAT_E7, LON_E7, 450_000, 50_000, 0, 0, 0, 0)
        agent.send([_frame(place)], time.monotonic())
        await attack.again_and_again(lambda client: client.post("/drones/2/mission/kept", json={"items": items}))


async def openapi(attack: TenantAttack) -> None:
    """Eight connections of a stranger."""
    await attack.again_and_again(lambda client: client.get("/openapi.json"), at_a_time=8, signed_in=False)


async def preferences(attack: TenantAttack) -> None:
    """Writes, one after the other, on eight connections."""
    await attack.again_and_again(
        lambda client: client.put("/me/preferences/x", json={"n": attack.chance.random()}), at_a_time=8
    )


async def zones(attack: TenantAttack) -> None:
    """Zones of 500 points for a team of his own, until there is no room, and on."""
    async with attack.client() as client:
        team_id = (await client.post("/teams", json={"name": "Coast"})).json().get("id")
    ring = [[47.3 + 0.0001 * (n % 2), 8.3 + 0.00001 * n] for n in range(250)]
    body = {"name": "x", "kind": "no-fly", "points": ring + [[lat + 0.01, lon] for lat, lon in reversed(ring)]}
    await attack.again_and_again(lambda client: client.post("/zones", json=body | {"team_id": team_id}))


async def nowhere(attack: TenantAttack) -> None:
    """Positions that are on no earth."""

    def message(number: int) -> Any:
        lat = attack.chance.choice((950_000_000, -2_000_000_000, 2**31 - 1))
        return mavlink.MAVLink_global_position_int_message(number, lat, LON_E7, 0, 0, 32767, -32768, 32767, 0)

    await attack.say(100.0, message)


async def aircraft(attack: TenantAttack) -> None:
    """Aircraft that do not exist, all around."""

    def message(number: int) -> Any:
        place = (LAT_E7 + attack.chance.randint(-300_000, 300_000), LON_E7 + attack.chance.randint(-300_000, 300_000))
        return mavlink.MAVLink_adsb_vehicle_message(
            number % 5000, *place, 0, 450_000, 9000, 6000, 0, b"FAKE", 7, 0, 31, 0
        )

    await attack.say(400.0, message)


async def texts(attack: TenantAttack) -> None:
    """Failsafes without end, each about something new."""

    def message(number: int) -> Any:
        letters = "".join(chr(97 + int(digit)) for digit in str(number))
        return mavlink.MAVLink_statustext_message(2, f"failsafe {letters}".encode())

    await attack.say(50.0, message)


async def everything(attack: TenantAttack) -> None:
    """All of it at the same time."""
    await asyncio.gather(*(one(attack) for one in KINDS.values()))


KINDS: Final[dict[str, Callable[[TenantAttack], Awaitable[None]]]] = {
    "shapes": shapes,
    "plans": plans,
    "openapi": openapi,
    "preferences": preferences,
    "zones": zones,
    "nowhere": nowhere,
    "aircraft": aircraft,
    "texts": texts,
}
EVERYTHING: Final = "everything"


@contextlib.asynccontextmanager
async def attacking_as_tenant(
    kind: str, url: str, cookie: str, key: str, seconds: float, *, nice: int = 5
) -> AsyncIterator[asyncio.Task[Counter[str]]]:
    """Runs the attack in a process of this priority until the block ends; then the task has what was done."""
    words = [sys.executable, "-m", "bench.tenant_attacks", kind, url, cookie, key, str(seconds), str(nice)]
    process = await asyncio.create_subprocess_exec(
        *words, stdin=asyncio.subprocess.DEVNULL, stdout=asyncio.subprocess.PIPE
    )

    async def done() -> Counter[str]:
        said, _ = await process.communicate()
        return Counter(json.loads(said)) if said.strip() else Counter()

    task = asyncio.create_task(done())
    try:
        yield task
        await task
    finally:
        if process.returncode is None:
            process.kill()
        await asyncio.gather(task, return_exceptions=True)


async def run(kind: str, url: str, cookie: str, key: str, seconds: float) -> Counter[str]:
    attack = TenantAttack(url, cookie, key, seconds)
    await (everything if kind == EVERYTHING else KINDS[kind])(attack)
    return attack.done


def main(words: list[str]) -> None:
    kind, url, cookie, key, seconds, nice = words
    os.setpriority(os.PRIO_PROCESS, 0, int(nice))
    print(json.dumps(asyncio.run(run(kind, url, cookie, key, float(seconds)))))


if __name__ == "__main__":
    main(sys.argv[1:])
