"""A tenant, or a thief with a stolen token and cookie, attacks through a real tower while another tenant flies.

alice flies drone 3 by hand and keeps flight logs of drone 1. mallory owns drone 2, and his agent reports what he likes.
"""

import asyncio
import json
import random
import sqlite3
import time
from collections import Counter
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final
from urllib.parse import urlsplit

import httpx
import pytest
import pytest_asyncio
from unharmed import make_patient, unharmed

from bench.flown_by_hand import HandFlight, TalkingAutopilot, flown_by_hand
from bench.lean_browser import LeanBrowser
from bench.load_agents import LoadAgent, kept_alive, sign_in_all
from bench.load_tower import ADMIN, PASSWORD, LoadTower, as_somebody, load_tower
from bench.pilot_sticks import take
from bench.tenant_attacks import attacking_as_tenant
from bench.tenants import draw_zones
from wire.control_messages import ToAgent
from wire.dialect import build, mavlink
from wire.transactions import Outcome, Transaction, TransactionResult

pytestmark = pytest.mark.asyncio(loop_scope="module")

ALICE: Final = "alice"
MALLORY: Final = "mallory"
KEPT_BY_ALICE, OF_MALLORY, FLOWN = 1, 2, 3
MB: Final = 1_000_000
FILES_BUDGET_MB: Final = 4
SETTINGS: Final = {"TOWER_FILES_BUDGET_MB": str(FILES_BUDGET_MB), "TOWER_FILE_LARGEST_MB": str(FILES_BUDGET_MB)}
LAT_E7, LON_E7, UP_MM = 470_000_000, 80_000_000, 50_000
"""Position of alice's drone, which hovers."""
STEP_E7: Final = 1_000
"""Eleven metres north."""
FAR_STEPS: Final = 45
POSITION_S: Final = 0.1
SEARCH_S: Final = 3.0
ATTACK_S: Final = 2.0
PROMISE_S: Final = 1.0
DEADLINE_S: Final = 30.0


def position(north_e7: int, east_e7: int) -> mavlink.MAVLink_message:
    """Returns a stationary position 50 m up, offset by this much from alice's drone."""
    at_ms = round(time.monotonic() * 1000) & 0xFFFFFFFF
    return mavlink.MAVLink_global_position_int_message(
        at_ms, LAT_E7 + north_e7, LON_E7 + east_e7, 400_000 + UP_MM, UP_MM, 0, 0, 0, 0
    )


class HoveringAutopilot(TalkingAutopilot):
    """Also reports its position."""

    def __init__(self, agent_port: int) -> None:
        super().__init__(agent_port)
        self._hovering = asyncio.create_task(self._hover())

    async def _hover(self) -> None:
        while True:
            self._socket.sendto(build(position(0, 0), system_id=1, component_id=1, sequence=0), self._agent)
            await asyncio.sleep(POSITION_S)

    def close(self) -> None:
        self._hovering.cancel()
        super().close()


@dataclass
class Scene:
    """`alice`, `mallory`: the tower with their cookies. `agents`: those of drones 1 and 2."""

    tower: LoadTower
    alice: LoadTower
    mallory: LoadTower
    flight: HandFlight
    agents: dict[int, LoadAgent]
    database: Path
    sent_to_mallory: list[dict[str, Any]] = field(default_factory=list)

    def client(self, who: LoadTower | dict[str, str]) -> httpx.AsyncClient:
        """Returns a client with the cookie of a user, or with other headers."""
        headers = {"Cookie": who.cookie} if isinstance(who, LoadTower) else who
        return httpx.AsyncClient(
            base_url=f"{self.tower.url}/api/v1", headers=headers, trust_env=False, timeout=DEADLINE_S
        )


def listened(browser: LeanBrowser, reported: list[dict[str, Any]]) -> None:
    """Reads the connection and collects its events."""

    def hear(text: bytes) -> None:
        event = json.loads(text)
        reported.append(event)
        if event["type"] == "ping":
            browser.send_text(json.dumps({"type": "pong", "sequence": event["sequence"]}))

    browser.on_text = hear


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def scene(tmp_path_factory: pytest.TempPathFactory) -> AsyncIterator[Scene]:
    folder: Path = tmp_path_factory.mktemp("tenants")
    async with AsyncExitStack() as stack:
        tower = await stack.enter_async_context(
            load_tower(folder, drones=3, settings=SETTINGS, operators=[ALICE, MALLORY])
        )
        async with httpx.AsyncClient(
            base_url=f"{tower.url}/api/v1", headers={"Cookie": tower.cookie}, trust_env=False
        ) as admin:
            ids = {one["name"]: one["id"] for one in (await admin.get("/users")).json()}
            for drone_id, owner in ((KEPT_BY_ALICE, ALICE), (OF_MALLORY, MALLORY), (FLOWN, ALICE)):
                answer = await admin.put(f"/drones/{drone_id}/owners/{ids[owner]}")
                answer.raise_for_status()
        alice, mallory = await as_somebody(tower, ALICE), await as_somebody(tower, MALLORY)
        flying = flown_by_hand(folder, tower, pilot=alice, made=HoveringAutopilot)
        flight = await stack.enter_async_context(flying)
        make_patient(tower, FLOWN)
        agents = await sign_in_all(tower.url, tower.keys[:2])
        await stack.enter_async_context(kept_alive(agents))
        made = Scene(tower, alice, mallory, flight, {one.drone_id: one for one in agents}, folder / "tower.sqlite3")
        listened(await mallory.browser(), made.sent_to_mallory)
        yield made


async def until(what: str, condition: Callable[[], Awaitable[bool]]) -> None:
    deadline = time.monotonic() + DEADLINE_S
    while True:
        if await condition():
            return
        assert time.monotonic() < deadline, f"{what} did not come to pass"
        await asyncio.sleep(0.05)


# -- a made-up drone as an oracle ----------------------------------------------------------------------------------


def separation(events: list[dict[str, Any]]) -> list[dict[str, Any]]:
    return [one for one in events if one["type"] == "separation"]


async def is_placed(scene: Scene) -> bool:
    """Whether the tower knows the position of alice's drone; otherwise there is nothing to find."""
    async with scene.client(scene.alice) as client:
        drone = (await client.get(f"/drones/{FLOWN}")).json()
    return bool(drone["armed"] and drone["airborne"])


async def test_a_made_up_drone_that_is_everywhere_finds_nobody_and_alarms_nobody(scene: Scene) -> None:
    """It jumps through alice's position, armed and with a heartbeat, a hundred times a second."""
    await until("alice's drone in the air", lambda: is_placed(scene))
    liar, chance, sent = scene.agents[OF_MALLORY], random.Random(16), 0
    await liar.report_state(armed=True, airborne=True)
    mode = 81 | mavlink.MAV_MODE_FLAG_SAFETY_ARMED
    beat = build(mavlink.MAVLink_heartbeat_message(2, 3, mode, 5, 4, 3), system_id=1, component_id=1, sequence=0)
    alarms_before = len(separation(scene.flight.events))

    async def is_found_out() -> bool:
        async with scene.client(scene.mallory) as client:
            return bool((await client.get(f"/drones/{OF_MALLORY}")).json()["suspicious_motion"] == "jump")

    async def search() -> None:
        nonlocal sent
        while True:
            sent += 1
            far = FAR_STEPS if sent % 2 else 1  # beside her, and half a kilometre away
            north, east = (chance.randint(-far, far) * STEP_E7 for _ in range(2))
            place = build(position(north, east), system_id=1, component_id=1, sequence=sent & 0xFF)
            liar.send([beat, place], time.monotonic())
            await asyncio.sleep(0.01)

    async with unharmed(scene.flight):
        searching = asyncio.create_task(search())
        try:
            await asyncio.sleep(SEARCH_S)
            await until("the tower finds it out", is_found_out)
        finally:
            searching.cancel()
            await asyncio.gather(searching, return_exceptions=True)
    assert sent > 50
    assert separation(scene.sent_to_mallory) == []
    assert len(separation(scene.flight.events)) == alarms_before
    assert str(FLOWN) not in {str(one.get("drone_id")) for one in scene.sent_to_mallory}


# -- storage for files --------------------------------------------------------------------------------------------


class LogSender:
    """A drone whose agent uploads logs of any size, or announces sizes and never sends them. `holder` requests them."""

    def __init__(self, scene: Scene, holder: LoadTower, drone_id: int) -> None:
        self._scene, self._holder, self._drone_id = scene, holder, drone_id
        self._agent = scene.agents[drone_id]
        self._asked: asyncio.Queue[Transaction] = asyncio.Queue()
        self._agent.on_message = self._hear

    def _hear(self, message: ToAgent) -> None:
        if isinstance(message, Transaction):
            self._asked.put_nowait(message)

    @property
    def path(self) -> str:
        return f"/drones/{self._drone_id}"

    async def take(self) -> None:
        await take(self._holder, self._drone_id, "acquire")

    async def kept(self) -> list[int]:
        async with self._scene.client(self._holder) as client:
            return sorted(one["id"] for one in (await client.get(f"{self.path}/logs")).json()["kept"])

    @asynccontextmanager
    async def asked_for(self, log_id: int) -> AsyncIterator[Transaction]:
        """Yields the transaction that fetches the log. It ends with the block."""
        async with self._scene.client(self._holder) as client:
            begun = await client.post(f"{self.path}/logs/{log_id}/fetch", headers={"Prefer": "respond-async"})
            assert begun.status_code == 202, begun.text
        async with asyncio.timeout(DEADLINE_S):
            transaction = await self._asked.get()
        yield transaction
        await self._agent.say(TransactionResult(id=transaction.id, outcome=Outcome.DONE, words="Sent."))

        async def is_over() -> bool:
            async with self._scene.client(self._holder) as client:
                operation = (await client.get(f"/operations/{begun.json()['id']}")).json()
            return bool(operation["state"] != "running")

        await until("the end of the transaction", is_over)

    async def send(self, log_id: int, size: int) -> int:
        """Uploads a log and returns the HTTP status."""
        async with self.asked_for(log_id) as transaction, self._client() as agent:
            answer = await agent.put(f"/agent/files/{transaction.id}", content=bytes(size))
        return answer.status_code

    async def promise(self, log_id: int, size: int, times: int) -> None:
        """Opens many connections that announce a size and send only some bytes."""

        place = urlsplit(self._scene.tower.url)

        async def one(transaction: Transaction) -> None:
            _, writer = await asyncio.open_connection(place.hostname, place.port)
            try:
                head = f"PUT /api/v1/agent/files/{transaction.id} HTTP/1.1\r\nHost: tower\r\nContent-Length: {size}\r\n"
                writer.write(f"{head}Authorization: Bearer {self._agent.ticket}\r\n\r\n".encode() + bytes(1000))
                await writer.drain()
                await asyncio.sleep(PROMISE_S)
            finally:
                writer.transport.abort()

        async with self.asked_for(log_id) as transaction:
            await asyncio.gather(*(one(transaction) for _ in range(times)))

    def _client(self) -> httpx.AsyncClient:
        return self._scene.client({"Authorization": f"Bearer {self._agent.ticket}"})


async def test_one_tenants_files_push_out_nothing_of_another_and_disturb_no_flight(scene: Scene) -> None:
    hers = LogSender(scene, scene.tower, KEPT_BY_ALICE)  # she holds one drone at a time: an admin fetches
    his = LogSender(scene, scene.mallory, OF_MALLORY)
    await hers.take()
    await his.take()
    for log_id in (1, 2):
        assert await hers.send(log_id, MB) == 204
    async with unharmed(scene.flight):
        await his.promise(1, FILES_BUDGET_MB * MB, 10)
        assert await hers.kept() == [1, 2], "nothing came, nothing goes"
        statuses = [await his.send(log_id, MB) for log_id in range(2, 8)]
    assert statuses == [204] * 6
    assert await hers.kept() == [1, 2], "they are her share"
    assert await his.kept() == [6, 7], "of his own the oldest go"


# -- credentials ---------------------------------------------------------------------------------------------------


async def stolen(scene: Scene) -> tuple[dict[str, str], dict[str, str]]:
    """Stolen from the admin: a token with every scope, and the cookie of a session whose proof has expired."""
    async with scene.client({}) as thief:
        (await thief.post("/session", json={"name": ADMIN, "password": PASSWORD})).raise_for_status()
        scopes = ["watch", "fly", "admin", "metrics"]
        token = await thief.post("/tokens", json={"name": "program", "scopes": scopes})
        token.raise_for_status()
        newest = max(one["id"] for one in (await thief.get("/sessions")).json() if one["current"])
        cookie = {"Cookie": "; ".join(f"{name}={value}" for name, value in thief.cookies.items())}
    with sqlite3.connect(scene.database, timeout=DEADLINE_S) as database:  # expires the proof of the session
        database.execute("UPDATE sessions SET proved_at = NULL WHERE id = ?", (newest,))
    database.close()
    return {"Authorization": f"Bearer {token.json()['secret']}"}, cookie


async def tries(client: httpx.AsyncClient, alice_id: int, admin_id: int) -> Counter[tuple[str, str]]:
    """Tries every way to take over an account or to create one for later. Returns (attempt, answer) counts."""
    new = "four words are longer"
    asked: list[tuple[str, str, dict[str, Any] | None]] = [
        ("DELETE", f"/users/{admin_id}/second-factor", None),
        ("DELETE", f"/users/{alice_id}/second-factor", None),
        ("PATCH", f"/users/{admin_id}", {"password": new}),
        ("PATCH", f"/users/{alice_id}", {"password": new}),
        ("PATCH", f"/users/{alice_id}", {"disabled": True}),
        ("DELETE", f"/users/{alice_id}", None),
        ("POST", "/users", {"name": "Eve", "password": new, "role": "admin"}),
        ("POST", "/tokens", {"name": "for ever", "scopes": ["watch", "fly"]}),
        ("POST", "/me/second-factor", None),
        ("POST", "/me/password", {"old_password": PASSWORD, "new_password": new}),
    ]
    answers: Counter[tuple[str, str]] = Counter()
    for method, path, body in asked:
        answer = await client.request(method, path, **({} if body is None else {"json": body}))
        answers[f"{method} {path}", f"{answer.status_code} {answer.json().get('type', '')}"] += 1
    return answers


async def test_a_stolen_token_or_cookie_takes_over_nobody_and_no_drone(scene: Scene) -> None:
    async with scene.client(scene.tower) as admin:
        ids = {one["name"]: one["id"] for one in (await admin.get("/users")).json()}
    by_token, by_cookie = await stolen(scene)
    expected = {"by token": "403 /problems/in-person-only", "by cookie": "403 /problems/proof-needed"}
    async with unharmed(scene.flight):
        for how, headers in (("by token", by_token), ("by cookie", by_cookie)):
            async with scene.client(headers) as thief:
                answers = await tries(thief, ids[ALICE], ids[ADMIN])
            assert {answer for _, answer in answers} == {expected[how]}, answers
    async with scene.client(scene.tower) as admin:
        assert (await admin.get(f"/drones/{FLOWN}")).json()["holder"]["name"] == ALICE
        assert {one["name"] for one in (await admin.get("/users")).json()} == {ADMIN, ALICE, MALLORY}
    assert (await as_somebody(scene.tower, ALICE)).cookie, "her password is what it was"


# -- as much work as there may be ----------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["shapes", "plans", "nowhere", "texts"])
async def test_whatever_an_operator_asks_for_or_his_vehicle_says_holds_up_no_stick(scene: Scene, kind: str) -> None:
    """Before, one file stopped the tower for 10 s, and a plan for 6 s; `python -m bench tenants` measures more."""
    if kind == "plans":
        await draw_zones(scene.tower, 20)
    async with unharmed(scene.flight):
        key = scene.tower.keys[OF_MALLORY - 1]
        async with attacking_as_tenant(kind, scene.tower.url, scene.mallory.cookie, key, ATTACK_S) as attack:
            await attack
    done = attack.result()
    assert done["200"] + done["frames"] > 0, done
    assert done.keys() <= {"200", "429", "frames"}
