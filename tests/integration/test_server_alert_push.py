"""Alerts reach browsers by web push: encrypted, signed, again after a failure, never twice, and only who may know."""

import asyncio
import json
import re
import time
from collections.abc import AsyncIterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import httpx
import pytest
from control_world import ObedientAgent, ask, until
from tower_world import Person, TowerWorld, assert_problem, start_tower
from worlds.push_browser import PushBrowser, unpadded, vapid_claims

from server.alerts.store.channels.outbox import RETRY_AFTER
from server.alerts.store.channels.refusals import MAX_BROWSERS
from server.kernel.people import Role
from server.runtime.vault import new_key

CHANNELS: Final = "/api/v1/me/alert-channels"
BROWSERS: Final = f"{CHANNELS}/browsers"


@dataclass
class Pushed:
    headers: dict[str, str]
    note: dict[str, str]


@dataclass
class PushService:
    """On loopback; reads what it gets with the keys of the browser. `refusals`: statuses of the next answers."""

    port: int = 0
    browsers: dict[str, PushBrowser] = field(default_factory=dict)
    pushed: dict[str, list[Pushed]] = field(default_factory=dict)
    refusals: list[int] = field(default_factory=list)

    def subscription(self, name: str) -> dict[str, str]:
        """Of a new browser with this name."""
        browser = self.browsers[name] = PushBrowser()
        self.pushed[name] = []
        return {"endpoint": f"{self.origin}/{name}", "browser": name, **browser.keys}

    @property
    def origin(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    def heard(self, name: str) -> list[str]:
        return [f"{one.note['happening']} {one.note['title']}" for one in self.pushed[name]]

    async def hears(self, name: str, *what: str) -> None:
        await until(f"{name}: {what}, not {self.heard(name)}", lambda: self.heard(name) == list(what))

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        head = (await reader.readuntil(b"\r\n\r\n")).decode()
        headers = {name.lower(): value for name, value in re.findall(r"(?m)^([\w-]+): (.*)\r$", head)}
        body = await reader.readexactly(int(headers["content-length"]))
        name = head.split()[1].strip("/")
        self.pushed[name].append(Pushed(headers, json.loads(self.browsers[name].decrypt(body))))
        status = self.refusals.pop(0) if self.refusals else 201
        writer.write(f"HTTP/1.1 {status} so\r\nContent-Length: 0\r\nConnection: close\r\n\r\n".encode())
        writer.close()


class Scene:
    """Anna owns hawk, Mallory nothing; Root is an admin."""

    def __init__(self, world: TowerWorld, service: PushService) -> None:
        self.world, self.service = world, service
        self.people: dict[str, Person] = {}
        self.clients: dict[str, httpx.AsyncClient] = {}
        self.counts = world.tower.alert_deliverer.counts
        self.agent: ObedientAgent

    async def settle(self) -> None:
        for name, role in (("Anna", Role.OPERATOR), ("Mallory", Role.OPERATOR), ("Root", Role.ADMIN)):
            self.people[name] = await self.world.add_user(name, role)
            self.clients[name] = await self.world.signed_in(self.people[name])
        drone = await self.world.add_drone("hawk", self.people["Anna"])
        self.drone_id = drone.id
        self.agent = ObedientAgent(self.world.tower.hub, drone.id)

    async def subscribe(self, name: str, browser: str = "", **more: Any) -> dict[str, Any]:
        body = self.service.subscription(browser or name) | more
        answer = await self.clients[name].post(BROWSERS, json=body)
        assert answer.status_code == 201, answer.text
        made: dict[str, Any] = answer.json()
        return made

    async def channels(self, name: str) -> list[dict[str, Any]]:
        found: list[dict[str, Any]] = (await self.clients[name].get(CHANNELS)).json()
        return found

    async def audited(self, action: str) -> list[dict[str, Any]]:
        answer = await self.clients["Root"].get("/api/v1/audit", params={"action": action})
        assert answer.status_code == 200, answer.text
        return [dict(one["detail"], by=one["actor_name"]) for one in answer.json()]

    def flies(self) -> None:
        """Raises `unattended`, a warning."""
        self.agent.state(armed=True, airborne=True)

    def later(self, seconds: float) -> None:
        self.world.clock.advance(seconds)
        self.world.tower.alert_deliverer.wake()


@pytest.fixture
async def scene(tmp_path: Path) -> AsyncIterator[Scene]:
    service = PushService()
    async with await asyncio.start_server(service.serve, "127.0.0.1", 0) as server:
        service.port = server.sockets[0].getsockname()[1]
        more = {"webhooks_may_be_private": True, "security_contact": "mailto:ops@example.org"}
        async with start_tower(tmp_path, **more) as world:
            scene = Scene(world, service)
            await scene.settle()
            yield scene


async def test_a_browser_reads_an_alert_and_its_end_and_a_failure_is_repeated(scene: Scene) -> None:
    anna, service = scene.clients["Anna"], scene.service
    key = (await anna.get(f"{BROWSERS}/key")).json()["public_key"]
    made = await scene.subscribe("Anna", "phone")
    assert (made["kind"], made["browser"], made["is_confirmed"]) == ("push", "phone", True)
    await scene.subscribe("Mallory")
    service.refusals = [500]
    scene.flies()
    await service.hears("phone", "opened hawk: Unattended")
    await until("the failure", lambda: scene.counts["failed"] == 1)
    (channel,) = await scene.channels("Anna")
    assert (channel["problem"], channel["waiting"]) == ("the push service answers 500", 1)
    scene.later(10)
    await service.hears("phone", "opened hawk: Unattended", "opened hawk: Unattended")
    await until("it to be noted", lambda: scene.counts["sent"] == 1)
    assert (await ask(anna, scene.drone_id, "acquire")).status_code == 200
    await service.hears("phone", *["opened hawk: Unattended"] * 2, "closed Over: hawk: Unattended")
    assert service.heard("Mallory") == []

    first, again, end = service.pushed["phone"]
    assert first.note == again.note
    assert first.note["body"] == "Warning: hawk is in the air, and nobody has the controls."
    assert first.note["path"] == f"#/drone/{scene.drone_id}"
    assert len({one.note["tag"] for one in (first, again, end)}) == 1, "the newest one replaces the others"
    assert len({one.headers["topic"] for one in (first, again, end)}) == 1
    sent_as = [(one.headers["urgency"], one.headers["ttl"], one.headers["content-encoding"]) for one in (first, end)]
    assert sent_as == [("normal", "3600", "aes128gcm"), ("normal", "14400", "aes128gcm")]
    claims = vapid_claims(first.headers["authorization"], key)
    assert (claims["aud"], claims["sub"]) == (service.origin, "mailto:ops@example.org")
    assert 0 < claims["exp"] - time.time() <= 86_400
    await until("its end to be noted", lambda: scene.counts["sent"] == 2)
    (channel,) = await scene.channels("Anna")
    assert (channel["problem"], channel["waiting"], channel["sent_at"] is None) == ("", 0, False)


async def test_a_critical_alert_is_urgent(scene: Scene) -> None:
    await scene.subscribe("Anna", severity="critical", drones="own")
    scene.flies()
    hub = scene.world.tower.hub
    await until("it to be in the air", lambda: bool(hub.alerts.live()))
    hub.detach_link(scene.agent.link)
    await scene.service.hears("Anna", "opened hawk: Lost in the air")
    (one,) = scene.service.pushed["Anna"]
    assert (one.headers["urgency"], one.headers["ttl"], one.note["severity"]) == ("high", "14400", "critical")


@pytest.mark.parametrize("status", [404, 410])
async def test_a_browser_that_ended_its_subscription_is_forgotten(scene: Scene, status: int) -> None:
    made = await scene.subscribe("Anna")
    scene.service.refusals = [status]
    scene.flies()
    await until("it to be forgotten", lambda: scene.counts["forgotten"] == 1)
    assert await scene.channels("Anna") == []
    (event,) = await scene.audited("alert_channel.deleted")
    assert (event["channel"], event["by"], event["reason"]) == (made["id"], "tower", "ended by the browser")
    assert "path" not in event and event["target"] == "127.0.0.1"
    scene.later(10)
    assert (await ask(scene.clients["Anna"], scene.drone_id, "acquire")).status_code == 200
    await until("the end of the alert", lambda: not scene.world.tower.hub.alerts.live())
    await scene.world.tower.alert_deliverer.step()
    assert len(scene.service.pushed["Anna"]) == 1, "nothing more is sent"
    assert (scene.counts["failed"], scene.counts["given_up"]) == (0, 0)


async def test_a_test_says_what_became_of_it(scene: Scene) -> None:
    anna, made = scene.clients["Anna"], await scene.subscribe("Anna")
    path = f"{CHANNELS}/{made['id']}"
    assert (await anna.post(f"{path}/test")).json() == {"is_sent": True, "problem": ""}
    (one,) = scene.service.pushed["Anna"]
    assert (one.note["title"], one.note["path"]) == ("A test of your alerts", "#/account/alerts")
    scene.service.refusals = [429, 410]
    refused = {"is_sent": False, "problem": "the push service answers 429"}
    assert (await anna.post(f"{path}/test")).json() == refused
    gone = "the browser has ended its subscription: the channel is deleted"
    assert (await anna.post(f"{path}/test")).json() == {"is_sent": False, "problem": gone}
    assert_problem(await anna.post(f"{path}/test"), 404, "unknown-alert-channel")


async def test_a_sign_out_ends_this_browser_and_no_other(scene: Scene) -> None:
    await scene.subscribe("Anna", "laptop")
    laptop = scene.clients["Anna"]
    scene.clients["Anna"] = await scene.world.signed_in(scene.people["Anna"])
    await scene.subscribe("Anna", "phone")
    assert (await laptop.delete("/api/v1/session")).status_code == 204
    assert [one["browser"] for one in await scene.channels("Anna")] == ["phone"]
    (event,) = await scene.audited("alert_channel.deleted")
    assert (event["by"], event["reason"]) == ("Anna", "its session has ended")
    scene.flies()
    await scene.service.hears("phone", "opened hawk: Unattended")
    assert scene.service.heard("laptop") == []


async def test_a_session_that_is_ended_from_elsewhere_ends_its_browser(scene: Scene) -> None:
    await scene.subscribe("Anna", "laptop")
    here = scene.clients["Anna"] = await scene.world.signed_in(scene.people["Anna"])
    sessions = (await here.get("/api/v1/sessions")).json()
    (other,) = [one["id"] for one in sessions if not one["current"]]
    assert (await here.delete(f"/api/v1/sessions/{other}")).status_code == 204
    assert await scene.channels("Anna") == []


async def test_a_session_that_expires_leaves_its_browser_which_follows_the_next_one(scene: Scene) -> None:
    made = await scene.subscribe("Anna")
    scene.world.clock.advance(scene.world.tower.settings.session_lifetime_s + 1)
    anna = scene.clients["Anna"] = await scene.world.signed_in(scene.people["Anna"])  # deletes expired sessions
    scene.flies()
    await scene.service.hears("Anna", "opened hawk: Unattended")
    assert (await anna.post(f"{BROWSERS}/{made['id']}/keep")).json()["id"] == made["id"]
    assert (await anna.delete("/api/v1/session")).status_code == 204
    scene.clients["Anna"] = await scene.world.signed_in(scene.people["Anna"])
    assert await scene.channels("Anna") == []


@pytest.mark.parametrize("change", [{"disabled": True}, {"password": "another good one 77"}])
async def test_a_disabled_user_and_a_new_password_end_all_browsers(scene: Scene, change: dict[str, Any]) -> None:
    await scene.subscribe("Anna", "laptop")
    await scene.subscribe("Anna", "phone")
    scene.service.refusals = [500, 500]
    scene.flies()
    await until("the failures", lambda: scene.counts["failed"] == 2)
    scene.clients["Root"] = await scene.world.signed_in(scene.people["Root"])
    answer = await scene.clients["Root"].patch(f"/api/v1/users/{scene.people['Anna'].id}", json=change)
    assert answer.status_code == 200, answer.text
    assert len(await scene.audited("alert_channel.deleted")) == 2
    scene.later(10)
    await scene.world.tower.alert_deliverer.step()
    assert [len(scene.service.pushed[name]) for name in ("laptop", "phone")] == [1, 1], "the first attempts only"


async def test_whoever_lost_the_drone_meanwhile_is_not_told(scene: Scene) -> None:
    await scene.subscribe("Anna")
    scene.service.refusals = [503]
    scene.flies()
    await until("the failure", lambda: scene.counts["failed"] == 1)
    owner = f"/api/v1/drones/{scene.drone_id}/owners/{scene.people['Anna'].id}"
    assert (await scene.clients["Root"].delete(owner)).status_code == 200
    scene.later(10)
    await until("the delivery to be forgotten", lambda: scene.counts["forgotten"] == 1)
    assert len(scene.service.pushed["Anna"]) == 1


async def test_a_push_that_is_given_up_is_in_the_list_of_admins(scene: Scene) -> None:
    await scene.subscribe("Anna")
    scene.service.refusals = [500] * (len(RETRY_AFTER) + 1)
    scene.flies()
    for number, wait in enumerate(RETRY_AFTER, 1):
        await until(f"attempt {number}", lambda number=number: scene.counts["failed"] == number)
        scene.later(wait.total_seconds())
    await until("the last one", lambda: scene.counts["given_up"] == 1)
    root = await scene.world.signed_in(scene.people["Root"])
    (one,) = (await root.get("/api/v1/alert-deliveries/given-up")).json()
    assert (one["kind"], one["target"], one["problem"]) == ("push", "127.0.0.1", "the push service answers 500")


async def test_a_browser_belongs_to_whoever_subscribed_last(scene: Scene) -> None:
    body = scene.service.subscription("shared")
    for name in ("Anna", "Mallory", "Mallory"):
        assert (await scene.clients[name].post(BROWSERS, json=body)).status_code == 201
    assert await scene.channels("Anna") == []
    assert len(await scene.channels("Mallory")) == 1
    scene.flies()
    await until("the alert", lambda: bool(scene.world.tower.hub.alerts.live()))
    await scene.world.tower.alert_deliverer.step()
    assert scene.service.heard("shared") == []


async def test_access_and_bounds(scene: Scene) -> None:
    anna, mallory, service = scene.clients["Anna"], scene.clients["Mallory"], scene.service
    made = await scene.subscribe("Anna")
    path = f"{CHANNELS}/{made['id']}"
    keep = f"{BROWSERS}/{made['id']}/keep"
    for request in (
        mallory.post(keep),
        mallory.delete(path),
        mallory.post(f"{path}/test"),
        mallory.patch(path, json={}),
    ):
        assert_problem(await request, 404, "unknown-alert-channel")
    async with httpx.AsyncClient(base_url=str(anna.base_url)) as stranger:
        assert_problem(await stranger.get(f"{BROWSERS}/key"), 401, "not-signed-in")
        assert_problem(await stranger.post(BROWSERS, json=service.subscription("x")), 401, "not-signed-in")
    hook = (await anna.post(CHANNELS, json={"kind": "webhook", "target": f"{service.origin}/x"})).json()["channel"]
    assert_problem(await anna.post(f"{BROWSERS}/{hook['id']}/keep"), 404, "unknown-alert-channel")
    assert (await anna.post(CHANNELS, json={"kind": "push", "target": f"{service.origin}/x"})).status_code == 422
    bad = service.subscription("bad") | {"auth": "AAAA"}
    assert_problem(await anna.post(BROWSERS, json=bad), 409, "bad-alert-channel")
    for number in range(1, MAX_BROWSERS):
        await scene.subscribe("Anna", f"browser{number}")
    assert_problem(await anna.post(BROWSERS, json=service.subscription("more")), 409, "too-many-browsers")
    again = service.subscription("browser1")
    assert (await anna.post(BROWSERS, json=again)).status_code == 201, "the same browser once more is no other one"
    assert len(await scene.channels("Anna")) == MAX_BROWSERS + 1
    assert (await anna.delete(path)).status_code == 204


async def test_without_the_exception_for_tests_only_public_servers_are_called(tmp_path: Path) -> None:
    service = PushService(port=443)
    async with start_tower(tmp_path) as world:
        scene = Scene(world, service)
        await scene.settle()
        anna = scene.clients["Anna"]
        assert_problem(await anna.post(BROWSERS, json=service.subscription("x")), 409, "bad-alert-channel")
        for host in ("127.0.0.1", "169.254.169.254", "10.0.0.1", "[::1]"):
            body = service.subscription("x") | {"endpoint": f"https://{host}/x"}
            made = (await anna.post(BROWSERS, json=body)).json()
            tried = (await anna.post(f"{CHANNELS}/{made['id']}/test")).json()
            assert tried == {"is_sent": False, "problem": "the server is in a private network"}, host


async def test_the_key_is_made_once_and_nobody_reads_it_in_the_database(tmp_path: Path) -> None:
    keys = []
    for _ in range(2):
        async with start_tower(tmp_path) as world:
            keys.append(world.tower.alert_deliverer.push_key.vapid)
    assert keys[0].public_key == keys[1].public_key
    number = keys[0].key.private_numbers().private_value.to_bytes(32, "big")
    held = await asyncio.to_thread(lambda: [file.read_bytes() for file in tmp_path.rglob("*.sqlite3*")])
    assert held and not any(number in one or unpadded(number).encode() in one for one in held)


async def test_a_key_that_cannot_be_opened_is_replaced_and_its_browsers_are_forgotten(scene: Scene) -> None:
    await scene.subscribe("Anna")
    tower = scene.world.tower
    before = tower.alert_deliverer.push_key.vapid.public_key
    foreign = type(tower.vault)(keys=[new_key()], key_file=Path("none"))
    await tower.alert_deliverer.push_key.load(foreign, tower.database)
    assert tower.alert_deliverer.push_key.vapid.public_key != before
    assert await scene.channels("Anna") == []
