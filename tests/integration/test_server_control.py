"""Who may fly, over REST and in the database: one winner of every race, on SQLite and on PostgreSQL alike."""

import asyncio
from pathlib import Path
from typing import Any

import httpx
import pytest
from tower_world import TowerWorld, assert_problem, start_tower

from server.accounts.tables import Role


@pytest.fixture(params=["sqlite", "postgres"])
def database(request: pytest.FixtureRequest) -> dict[str, Any]:
    if request.param == "sqlite":
        return {}
    url: str = request.getfixturevalue("postgres_url")
    return {"database_url": url.replace("postgresql://", "postgresql+asyncpg://")}


async def ask(client: httpx.AsyncClient, drone_id: int, what: str, reason: str = "") -> httpx.Response:
    return await client.post(f"/api/v1/drones/{drone_id}/control/{what}", json={"reason": reason})


async def audit(world: TowerWorld, admin: httpx.AsyncClient) -> list[str]:
    events = (await admin.get("/api/v1/audit")).json()
    rows = events["events"] if isinstance(events, dict) else events
    return [row["action"] for row in rows if row["action"].startswith("control.")]


async def test_the_controls_go_round(tmp_path: Path, database: dict[str, Any]) -> None:
    async with start_tower(tmp_path, **database) as world:
        alice = await world.add_user("alice")
        await world.add_user("root", Role.ADMIN)
        drone = await world.add_drone("Kestrel", alice)
        operator, admin = [await world.signed_in(name) for name in ("alice", "root")]
        assert (await ask(operator, drone.id, "acquire")).json()["epoch"] == 1
        taken = (await ask(admin, drone.id, "take", "gusts")).json()
        assert (taken["holder"]["name"], taken["taken_from"]["name"], taken["epoch"]) == ("root", "alice", 2)
        assert_problem(await ask(operator, drone.id, "acquire"), 409, "taken-away")
        assert_problem(await ask(operator, drone.id, "take"), 403, "admins-only")
        given = (await ask(admin, drone.id, "give")).json()
        assert (given["holder"]["name"], given["taken_from"], given["epoch"]) == ("alice", None, 3)
        assert (await ask(operator, drone.id, "release")).json()["holder"] is None
        assert await audit(world, admin) == [
            "control.release",
            "control.give",
            "control.take",
            "control.acquire",
        ]


async def test_of_many_who_reach_for_one_drone_one_gets_it(tmp_path: Path, database: dict[str, Any]) -> None:
    async with start_tower(tmp_path, **database) as world:
        people = [await world.add_user(f"pilot{number}") for number in range(6)]
        drone = await world.add_drone("Kestrel", *people)
        signed_in = [await world.signed_in(person) for person in people]
        answers = await asyncio.gather(*(ask(client, drone.id, "acquire") for client in signed_in))
        assert sorted(answer.status_code for answer in answers) == [200, 409, 409, 409, 409, 409]
        (winner,) = [answer.json() for answer in answers if answer.status_code == 200]
        assert winner["epoch"] == 1
        seen = (await signed_in[0].get(f"/api/v1/drones/{drone.id}")).json()
        assert (seen["holder"], seen["epoch"]) == (winner["holder"], 1)


async def test_an_operator_who_reaches_for_many_drones_gets_one(tmp_path: Path, database: dict[str, Any]) -> None:
    async with start_tower(tmp_path, **database) as world:
        alice = await world.add_user("alice")
        drones = [await world.add_drone(f"Drone {number}", alice) for number in range(5)]
        operator = await world.signed_in("alice")
        answers = await asyncio.gather(*(ask(operator, drone.id, "acquire") for drone in drones))
        assert sorted(answer.status_code for answer in answers) == [200, 409, 409, 409, 409]
        for answer in answers:
            if answer.status_code == 409:
                assert_problem(answer, 409, "holds-another")
        squad = (await operator.get("/api/v1/drones")).json()
        assert sum(drone["holder"] is not None for drone in squad) == 1


async def test_two_admins_race_for_a_drone_and_one_is_told(tmp_path: Path, database: dict[str, Any]) -> None:
    async with start_tower(tmp_path, **database) as world:
        alice = await world.add_user("alice")
        for name in ("root", "toor"):
            await world.add_user(name, Role.ADMIN)
        drone = await world.add_drone("Kestrel", alice)
        operator, one, two = [await world.signed_in(name) for name in ("alice", "root", "toor")]
        epoch = (await ask(operator, drone.id, "acquire")).json()["epoch"]
        for _ in range(10):
            answers = await asyncio.gather(ask(one, drone.id, "take"), ask(two, drone.id, "take"))
            for answer in answers:
                assert answer.status_code in (200, 409), answer.text
            epochs = [answer.json()["epoch"] for answer in answers if answer.status_code == 200]
            # Whoever came second took it from the first: each success has an epoch of its own.
            assert sorted(epochs) == [epoch + 1 + number for number in range(len(epochs))]
            epoch = max(epochs, default=epoch)
            seen = (await operator.get(f"/api/v1/drones/{drone.id}")).json()
            assert seen["epoch"] == epoch
            assert seen["taken_from"]["name"] == "alice"
