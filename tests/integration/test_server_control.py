"""Control rights over REST and in the database: one winner of every race, on SQLite and on PostgreSQL alike."""

import asyncio
from pathlib import Path
from typing import Any

import pytest
from control_world import ObedientAgent, ask, audit, live
from tower_world import TowerWorld, assert_problem, start_tower

from server.kernel.people import Role
from wire.control_messages import ControlChanged


@pytest.fixture(params=["sqlite", "postgres"])
def database(request: pytest.FixtureRequest) -> dict[str, Any]:
    if request.param == "sqlite":
        return {}
    url: str = request.getfixturevalue("migrated_postgres_url")
    return {"database_url": url.replace("postgresql://", "postgresql+asyncpg://")}


def who(drone: dict[str, Any]) -> tuple[str | None, str | None, bool, str | None, int]:
    """Returns holder, taken from, offered, assistant, epoch."""
    named = [drone[part]["name"] if drone[part] else None for part in ("holder", "taken_from", "assistant")]
    return named[0], named[1], drone["offered"], named[2], drone["epoch"]


async def test_the_controls_go_round(tmp_path: Path, database: dict[str, Any]) -> None:
    async with start_tower(tmp_path, **database) as world:
        alice = await world.add_user("alice")
        await world.add_user("root", Role.ADMIN)
        drone = await world.add_drone("Kestrel", alice)
        operator, admin = [await world.signed_in(name) for name in ("alice", "root")]
        agent = ObedientAgent(world.tower.hub, drone.id)

        acquired = await ask(operator, drone.id, "acquire")
        assert who(acquired.json()) == ("alice", None, False, None, 1)
        taken = await ask(admin, drone.id, "take", reason="gusts")
        assert who(taken.json()) == ("root", "alice", False, None, 2)
        assert_problem(await ask(operator, drone.id, "acquire"), 409, "taken-away")
        offered = await ask(admin, drone.id, "give")
        assert who(offered.json()) == ("root", "alice", True, None, 3)
        assert_problem(await ask(operator, drone.id, "acquire"), 409, "offered")
        assert_problem(await ask(operator, drone.id, "accept"), 409, "sticks-not-centred")
        withdrawn = await ask(admin, drone.id, "take")
        assert who(withdrawn.json()) == ("root", "alice", False, None, 4)
        assert_problem(await ask(operator, drone.id, "accept", sticks_centred=True), 409, "nothing-offered")
        await ask(admin, drone.id, "give")
        accepted = await ask(operator, drone.id, "accept", sticks_centred=True)
        assert who(accepted.json()) == ("alice", None, False, None, 6)
        assisted = await ask(admin, drone.id, "assist", reason="landing")
        assert who(assisted.json()) == ("alice", None, False, "root", 7)
        alone = await ask(admin, drone.id, "unassist")
        assert who(alone.json()) == ("alice", None, False, None, 8)
        released = await ask(operator, drone.id, "release")
        assert who(released.json()) == (None, None, False, None, 9)

        # Each change reached the agent, and each hold with the epoch of its change.
        reported = [message.epoch for message in agent.posted if isinstance(message, ControlChanged)]
        assert [epoch for epoch in range(1, 10) if epoch not in reported] == []
        assert [(one.epoch, one.reason) for one in agent.decided_holds] == [
            (2, "gusts"),
            (3, "controls given by root"),
            (5, "controls given by root"),
            (6, "controls accepted by alice"),
        ]
        trail = await audit(admin, "control.")
        assert [(one["action"], one["detail"]["result"]) for one in reversed(trail)] == [
            ("control.acquire", "done"),
            ("control.take", "done"),
            ("control.acquire", "refused"),
            ("control.give", "done"),
            ("control.acquire", "refused"),
            ("control.accept", "refused"),
            ("control.take", "done"),
            ("control.accept", "refused"),
            ("control.give", "done"),
            ("control.accept", "done"),
            ("control.assist", "done"),
            ("control.assist-end", "done"),
            ("control.release", "done"),
        ]
        take = trail[-2]
        assert (take["actor_name"], take["drone_id"], take["detail"]["reason"]) == ("root", drone.id, "gusts")
        assert (take["detail"]["epoch"], take["detail"]["holder"], take["detail"]["taken_from"]) == (2, "root", "alice")
        assert take["detail"]["took_ms"] >= 0


async def test_a_program_says_that_it_is_there_for_as_long_as_it_has_the_controls(tmp_path: Path) -> None:
    async with start_tower(tmp_path) as world:
        users = [await world.add_user("alice"), await world.add_user("bob")]
        drone = await world.add_drone("Kestrel", *users)
        foreign = await world.add_drone("Merlin")
        alice, bob = [await world.signed_in(name) for name in ("alice", "bob")]
        assert_problem(await ask(alice, drone.id, "keep-alive"), 409, "not-the-holder")
        await ask(alice, drone.id, "acquire")
        there = world.tower.hub.state.drones.get(drone.id)
        assert there is not None
        assert not there.somebody_flies()
        kept = await ask(alice, drone.id, "keep-alive")
        assert (kept.status_code, kept.json()["holder"]["name"]) == (200, "alice")
        assert there.somebody_flies()
        assert_problem(await ask(bob, drone.id, "keep-alive"), 409, "not-the-holder")
        assert_problem(await ask(bob, foreign.id, "keep-alive"), 404, "unknown-drone")


async def test_every_way_to_be_refused(tmp_path: Path, database: dict[str, Any]) -> None:
    async with start_tower(tmp_path, **database) as world:
        alice, bob = [await world.add_user(name) for name in ("alice", "bob")]
        for name in ("root", "toor"):
            await world.add_user(name, Role.ADMIN)
        drone, other = await world.add_drone("Kestrel", alice, bob), await world.add_drone("Merlin", alice)
        await world.add_user("eve")
        one, two, eve, root, toor = [await world.signed_in(name) for name in ("alice", "bob", "eve", "root", "toor")]
        everything = ("acquire", "release", "take", "give", "accept", "assist", "unassist")
        for what in everything:
            assert_problem(await ask(eve, drone.id, what), 404, "unknown-drone")
            assert_problem(await ask(root, 77, what), 404, "unknown-drone")

        async def refused(client: Any, status: int, code: str, what: str, **body: Any) -> None:
            assert_problem(await ask(client, drone.id, what, **body), status, code)

        await refused(one, 409, "not-the-holder", "release")
        await refused(one, 403, "admins-only", "take")
        await refused(one, 403, "admins-only", "assist")
        await refused(root, 409, "nobody-to-assist", "assist")
        await refused(root, 409, "nobody-assists", "unassist")
        await refused(root, 409, "nothing-to-give", "give")
        assert (await ask(one, other.id, "acquire")).is_success
        await refused(one, 409, "holds-another", "acquire")
        assert (await ask(one, other.id, "release")).is_success
        assert (await ask(one, drone.id, "acquire")).is_success
        await refused(one, 409, "already-yours", "acquire")
        await refused(two, 409, "held-by-other", "acquire")
        await refused(two, 409, "not-the-holder", "release")
        await refused(two, 409, "nothing-offered", "accept", sticks_centred=True)
        assert (await ask(root, drone.id, "assist")).is_success
        await refused(root, 409, "already-assisting", "assist")
        await refused(toor, 409, "assisted-by-other", "assist")
        await refused(one, 403, "admins-only", "unassist")
        assert (await ask(root, drone.id, "take")).is_success
        await refused(root, 409, "already-yours", "take")
        await refused(toor, 409, "cannot-assist", "assist")
        await refused(toor, 409, "not-the-holder", "give")
        assert (await ask(one, other.id, "acquire")).is_success
        await refused(root, 409, "cannot-receive", "give")
        assert (await ask(one, other.id, "release")).is_success
        assert (await ask(root, drone.id, "give")).is_success
        await refused(root, 409, "already-offered", "give")
        await refused(two, 409, "not-offered-to-you", "accept", sticks_centred=True)
        assert (await ask(one, other.id, "acquire")).is_success
        await refused(one, 409, "holds-another", "accept", sticks_centred=True)


async def test_who_is_shut_out_watches_or_not_as_the_admin_says(tmp_path: Path) -> None:
    async with start_tower(tmp_path) as world:
        alice = await world.add_user("alice")
        await world.add_user("root", Role.ADMIN)
        drone = await world.add_drone("Kestrel", alice)
        operator, admin = [await world.signed_in(name) for name in ("alice", "root")]
        await ask(operator, drone.id, "acquire")
        await ask(admin, drone.id, "take", watch=False)
        path = f"/api/v1/drones/{drone.id}"
        assert (await operator.get(path)).json()["may_watch"] is False
        assert (await admin.get(path)).json()["may_watch"] is True
        await ask(admin, drone.id, "give")
        accepted = (await ask(operator, drone.id, "accept", sticks_centred=True)).json()
        assert accepted["may_watch"] is True
        await ask(admin, drone.id, "take")
        assert (await operator.get(path)).json()["may_watch"] is True


async def test_everybody_is_told_who_why_and_how_the_hold_went(tmp_path: Path) -> None:
    async with start_tower(tmp_path) as world:
        alice = await world.add_user("alice")
        await world.add_user("root", Role.ADMIN)
        drone = await world.add_drone("Kestrel", alice)
        operator, admin = [await world.signed_in(name) for name in ("alice", "root")]
        ObedientAgent(world.tower.hub, drone.id)
        async with live(world, operator) as screen:  # who is not there makes the drone hold after a while
            await ask(operator, drone.id, "acquire")
            await ask(admin, drone.id, "take", reason="gusts")
            reported = await screen.event("control", event="taken")
            assert (reported["by"]["name"], reported["holder"]["name"], reported["reason"]) == ("root", "root", "gusts")
            assert (await screen.event("hold", step="ordered"))["epoch"] == 2
            await screen.event("hold", step="confirmed")
            await ask(admin, drone.id, "give")
            assert (await screen.event("control", event="given"))["holder"]["name"] == "root"
            await ask(operator, drone.id, "accept", sticks_centred=True)
            assert (await screen.event("control", event="accepted"))["holder"]["name"] == "alice"
            await ask(admin, drone.id, "assist")
            await screen.event("control", event="assisting")
            await ask(admin, drone.id, "unassist")
            await screen.event("control", event="assist_ended")
        await world.tower.event_handler.caught_up()
        held = await audit(admin, "hold.")
        assert [one["action"] for one in held] == ["hold.confirmed"] * 3
        first = held[-1]["detail"]
        assert (first["cause"], first["reason"], first["epoch"], first["elapsed_ms"]) == ("order", "gusts", 2, 4.5)


async def test_nobody_assists_in_a_tower_that_was_started_again(tmp_path: Path, database: dict[str, Any]) -> None:
    async with start_tower(tmp_path, **database) as world:
        alice = await world.add_user("alice")
        await world.add_user("root", Role.ADMIN)
        drone = await world.add_drone("Kestrel", alice)
        operator, admin = [await world.signed_in(name) for name in ("alice", "root")]
        await ask(operator, drone.id, "acquire")
        before = who((await ask(admin, drone.id, "assist")).json())
        assert before == ("alice", None, False, "root", 2)
    async with start_tower(tmp_path, **database) as world:
        admin = await world.signed_in("root")
        after = who((await admin.get(f"/api/v1/drones/{drone.id}")).json())
        assert after == ("alice", None, False, None, 3)


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
            # The second one took it from the first: each success has its own epoch.
            epoch += sum(answer.status_code == 200 for answer in answers)
            seen = (await operator.get(f"/api/v1/drones/{drone.id}")).json()
            assert seen["epoch"] == epoch
            assert seen["taken_from"]["name"] == "alice"
            assert _live_fenced(world, drone.id) is False


async def test_give_and_acceptance_race_with_a_withdrawal(tmp_path: Path, database: dict[str, Any]) -> None:
    async with start_tower(tmp_path, **database) as world:
        alice = await world.add_user("alice")
        await world.add_user("root", Role.ADMIN)
        drone = await world.add_drone("Kestrel", alice)
        operator, admin = [await world.signed_in(name) for name in ("alice", "root")]
        await ask(operator, drone.id, "acquire")
        for _ in range(5):
            await ask(admin, drone.id, "take")
            await ask(admin, drone.id, "give")
            accepted, withdrawn = await asyncio.gather(
                ask(operator, drone.id, "accept", sticks_centred=True), ask(admin, drone.id, "take")
            )
            # A withdrawal after the acceptance takes control again; before it, there is nothing to accept.
            assert withdrawn.status_code == 200 or accepted.status_code == 200
            seen = (await admin.get(f"/api/v1/drones/{drone.id}")).json()
            assert seen["offered"] is False
            if withdrawn.status_code == 200:
                assert (seen["holder"]["name"], seen["taken_from"]["name"]) == ("root", "alice")


def _live_fenced(world: TowerWorld, drone_id: int) -> bool:
    drone = next(one for one in world.tower.hub.state.drones.values() if one.drone_id == drone_id)
    return drone.fenced
