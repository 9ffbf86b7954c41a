"""`/metrics`: who may read it, and that it shows the tower's traffic."""

import asyncio
import re
import time
from collections.abc import AsyncIterator
from pathlib import Path

import httpx
import pytest
from control_world import ObedientAgent, ask, live, until
from prometheus_client.parser import text_string_to_metric_families
from tower_world import NewDrone, Person, TowerWorld, assert_problem, start_tower

from server.kernel.people import Role
from wire.dialect import build, mavlink
from wire.ids import DroneId, Epoch
from wire.sealing import read_link_id
from wire.tagged import tag

SECRET = "a-secret-of-more-than-twenty-characters"


@pytest.fixture
async def world(tmp_path: Path) -> AsyncIterator[TowerWorld]:
    async with start_tower(tmp_path, metrics_token=SECRET) as world:
        yield world


@pytest.fixture
async def root(world: TowerWorld) -> Person:
    return await world.add_user("root", Role.ADMIN)


@pytest.fixture
async def drone(world: TowerWorld) -> NewDrone:
    return await world.add_drone("Kestrel")


def bearer(secret: str) -> dict[str, str]:
    return {"Authorization": f"Bearer {secret}"}


async def figures(client: httpx.AsyncClient, **headers: str) -> dict[str, float]:
    """Returns every sample, by its name with its labels in brackets."""
    answer = await client.get("/metrics", headers=headers)
    assert answer.status_code == 200, answer.text
    found = {}
    for family in text_string_to_metric_families(answer.text):
        for sample in family.samples:
            labels = ",".join(f"{key}={value}" for key, value in sorted(sample.labels.items()))
            found[f"{sample.name}[{labels}]" if labels else sample.name] = sample.value
    return found


async def test_who_may_read_it(world: TowerWorld, root: Person) -> None:
    operator = await world.add_user("operator")
    anonymous = await world.client()
    assert_problem(await anonymous.get("/metrics"), 401, "not-signed-in")
    assert_problem(await anonymous.get("/metrics", headers=bearer("x" + SECRET[1:])), 401, "bad-token")
    assert_problem(await (await world.signed_in(operator)).get("/metrics"), 403, "admins-only")
    for headers in (bearer(SECRET), {"Authorization": f"bearer {SECRET}"}):
        answer = await anonymous.get("/metrics", headers=headers)
        assert answer.status_code == 200
        assert answer.headers["content-type"].startswith("text/plain")
        assert answer.headers["cache-control"] == "no-store"
    admin = await world.signed_in(root)
    assert (await admin.get("/metrics")).status_code == 200
    opened = (await admin.get("/metrics", headers={"Accept": "application/openmetrics-text; version=1.0.0"})).text
    assert opened.endswith("# EOF\n")


async def test_whoever_shows_the_secret_is_no_stranger(tmp_path: Path) -> None:
    async with start_tower(tmp_path, metrics_token=SECRET, trusted_proxies="192.0.2.1") as world:
        client = await world.client()
        await client.get("/api/v1/health")
        assert len(world.tower.anonymous.connections) == 1
        await figures(client, Authorization=f"Bearer {SECRET}")
        assert len(world.tower.anonymous.connections) == 0


async def test_api_tokens_need_the_scope(world: TowerWorld, root: Person) -> None:
    admin, program = await world.signed_in(root), await world.client()
    for scope, status in (("metrics", 200), ("watch", 403)):
        made = await admin.post("/api/v1/tokens", json={"name": scope, "scopes": [scope]})
        answer = await program.get("/metrics", headers=bearer(made.json()["secret"]))
        assert answer.status_code == status, answer.text


async def test_no_secret_set_is_no_secret_that_opens(tmp_path: Path) -> None:
    async with start_tower(tmp_path) as world:
        assert_problem(await (await world.client()).get("/metrics", headers=bearer("none")), 401, "bad-token")


async def test_the_figures_follow_what_passes(world: TowerWorld, root: Person, drone: NewDrone) -> None:
    hub, admin = world.tower.hub, await world.signed_in(root)
    agent = ObedientAgent(hub, drone.id)
    agent.state()
    reader = await world.client(headers=bearer(SECRET))
    async with live(world, admin) as browser:
        before = await figures(reader)
        assert (before["tower_browsers"], before["tower_agents"], before["tower_drones_online"]) == (1, 1, 1)
        ack = build(mavlink.MAVLink_command_ack_message(400, 0), system_id=1, component_id=1, sequence=0)
        for datagram in agent._sealed.seal_frames(Epoch(0), [ack] * 5, time.monotonic()):
            hub.datagram(datagram, read_link_id(datagram), ("203.0.113.1", 5), time.monotonic())
        received = b""
        async with asyncio.timeout(30):
            while len(received) < 5 * len(tag(DroneId(drone.id), ack)):
                message = await browser.socket.recv()
                received += message if isinstance(message, bytes) else b""
        assert (await ask(admin, drone.id, "acquire")).status_code == 200
        arm = build(
            mavlink.MAVLink_command_long_message(1, 1, 400, 0, 0, 0, 0, 0, 0, 0, 0),
            system_id=255,
            component_id=190,
            sequence=0,
        )
        await browser.socket.send(tag(DroneId(drone.id), arm) + tag(DroneId(drone.id + 1), arm))
        await browser.event("notice", code="unknown-drone")
        hub.holds.order(DroneId(drone.id), "a test")
        await until("it is confirmed", lambda: hub.state.traffic.hold_steps["confirmed"] == 1)
        await until("the hub's clock has beaten", lambda: sum(hub.state.traffic.loop_late.counts) > 0)
        after = await figures(reader)

    def grown(name: str) -> float:
        return after[name] - before.get(name, 0.0)

    assert grown("tower_frames_total[direction=in,peer=agent]") == 5
    assert grown("tower_frames_total[direction=out,peer=browser]") == 5
    assert grown("tower_frames_total[direction=in,peer=browser]") == 2
    assert grown("tower_frames_total[direction=out,peer=agent]") == 1
    assert grown("tower_bytes_total[direction=in,peer=agent]") > 5 * len(ack)
    assert grown("tower_bytes_total[direction=out,peer=browser]") >= 5 * len(ack)
    assert grown("tower_messages_total[direction=in,peer=browser]") == 1
    assert grown("tower_drops_total[reason=unknown-drone]") == 1
    assert grown("tower_refusals_total[code=unknown-drone]") == 1
    assert grown("tower_up_latency_seconds_count") >= 1
    assert grown("tower_down_latency_seconds_count") == 1
    assert 0 < grown("tower_up_latency_seconds_sum") < 10
    assert grown("tower_control_events_total[event=acquired]") == 1
    assert grown("tower_hold_steps_total[step=confirmed]") == 1
    assert grown("tower_holds_ordered_total") == 1
    assert after["tower_drones_held"] == 1
    assert after["tower_loop_late_seconds_count"] > 0
    assert after["process_resident_memory_bytes"] > 0


async def test_every_metric_is_in_the_documentation_and_none_besides(world: TowerWorld, root: Person) -> None:
    answer = await (await world.signed_in(root)).get("/metrics")
    reported = {
        family.name for family in text_string_to_metric_families(answer.text) if family.name.startswith("tower_")
    }
    page = (Path(__file__).parents[2] / "docs" / "metrics.md").read_text()
    documented = {name.removesuffix("_total") for name in re.findall(r"^\| `(tower_[a-z_]+)`", page, re.MULTILINE)}
    assert documented == {name.removesuffix("_total") for name in reported}
