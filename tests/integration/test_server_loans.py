"""Lending a drone: the borrower sees and flies it within limits, and only until the loan ends."""

from collections.abc import AsyncIterator
from datetime import timedelta
from pathlib import Path
from typing import Any

import httpx
import pytest
from control_world import ObedientAgent, ask, audit, live, until
from tower_world import NewDrone, Person, TowerWorld, assert_problem, start_tower

from server.control.core.loan_limits import Home
from server.kernel.people import Role
from server.live.hub_events import LoanLimitPassed
from wire.dialect import build, mavlink
from wire.ids import DroneId, UserId
from wire.tagged import tag


@pytest.fixture
async def world(tmp_path: Path) -> AsyncIterator[TowerWorld]:
    async with start_tower(tmp_path) as running:
        yield running


@pytest.fixture
async def root(world: TowerWorld) -> httpx.AsyncClient:
    return await world.signed_in(await world.add_user("Root", Role.ADMIN))


@pytest.fixture
async def anna(world: TowerWorld) -> Person:
    return await world.add_user("Anna")


@pytest.fixture
async def hawk(world: TowerWorld) -> NewDrone:
    return await world.add_drone("hawk", await world.add_user("Olga"))


async def lend(
    world: TowerWorld, root: httpx.AsyncClient, drone: NewDrone, person: Person, *, for_s: float = 600, **terms: Any
) -> httpx.Response:
    ends = (world.clock() + timedelta(seconds=for_s)).isoformat()
    return await root.put(f"/api/v1/drones/{drone.id}/loans/{person.id}", json={"until": ends, **terms})


async def test_a_borrower_flies_until_the_time_is_over(
    world: TowerWorld, root: httpx.AsyncClient, anna: Person, hawk: NewDrone
) -> None:
    agent = ObedientAgent(world.tower.hub, hawk.id)
    agent.state(armed=True, airborne=True)
    borrower = await world.signed_in(anna)
    assert (await borrower.get("/api/v1/drones")).json() == []
    view = (await lend(world, root, hawk, anna, may_arm=False, max_height_m=50)).json()
    loan = view["loans"][0]
    assert (loan["user"]["name"], loan["may_arm"], loan["max_height_m"], loan["radius_m"]) == ("Anna", False, 50, None)
    assert (await ask(borrower, hawk.id, "acquire")).status_code == 200
    async with live(world, borrower) as screen:
        world.clock.advance(601)
        await screen.event("drone_removed", drone_id=hawk.id)
        drone = world.tower.hub.state.drones.get(DroneId(hawk.id))
        assert drone is not None
        await until("the revocation", lambda: drone.lease.holder is None)
    assert [order.reason for order in agent.decided_holds] == ["the loan is over"]
    borrower = await world.signed_in(anna)
    assert_problem(await ask(borrower, hawk.id, "acquire"), 404, "unknown-drone")
    root = await world.signed_in("Root")
    assert (await root.get(f"/api/v1/drones/{hawk.id}")).json()["loans"] == []
    actions = {one["action"] for one in await audit(root, "drone.l")}
    assert actions == {"drone.lent", "drone.loan_expired"}


async def test_an_admin_ends_it_before_its_time(
    world: TowerWorld, root: httpx.AsyncClient, anna: Person, hawk: NewDrone
) -> None:
    borrower = await world.signed_in(anna)
    await lend(world, root, hawk, anna)
    await ask(borrower, hawk.id, "acquire")
    after = (await root.delete(f"/api/v1/drones/{hawk.id}/loans/{anna.id}")).json()
    assert (after["loans"], after["holder"]) == ([], None)
    assert_problem(await borrower.get(f"/api/v1/drones/{hawk.id}"), 404, "unknown-drone")
    assert (await root.delete(f"/api/v1/drones/{hawk.id}/loans/{anna.id}")).status_code == 200


async def test_what_is_no_loan(world: TowerWorld, root: httpx.AsyncClient, anna: Person, hawk: NewDrone) -> None:
    document = assert_problem(await lend(world, root, hawk, anna, for_s=-1), 422, "invalid-request")
    assert document["errors"][0]["field"] == "until"
    assert_problem(await lend(world, root, hawk, anna, radius_m=-5), 422, "invalid-request")
    olga = (await root.get(f"/api/v1/drones/{hawk.id}")).json()["owners"][0]
    assert_problem(await lend(world, root, hawk, Person(olga["id"], "Olga", Role.OPERATOR)), 409, "owner-already")
    assert_problem(await lend(world, root, hawk, Person(999, "x", Role.OPERATOR)), 404, "unknown-user")
    assert_problem(await lend(world, await world.signed_in(anna), hawk, anna), 404, "unknown-drone")
    assert_problem(await lend(world, await world.signed_in("Olga"), hawk, anna), 403, "admins-only")


REFUSED: dict[str, tuple[Any, str]] = {
    "arming": (
        mavlink.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0),
        "without the right to arm it, and this could start its motors.",
    ),
    "a mission start, for which a PX4 arms": (
        mavlink.MAVLink_command_int_message(1, 1, 0, 300, 0, 0, 0, 0, 0, 0, 0, 0, 0),
        "without the right to arm it, and this could start its motors.",
    ),
    "sticks in the corner that arms": (
        mavlink.MAVLink_manual_control_message(1, 0, 0, 0, 1000, 0),
        "without the right to arm it, and this could start its motors.",
    ),
    "a place too far": (
        mavlink.MAVLink_command_int_message(1, 1, 6, 192, 0, 0, -1, 0, 0, 0, 470100000, 80000000, 10),
        "within 100 m of home, and this goes further.",
    ),
    "a take-off too high": (
        mavlink.MAVLink_command_long_message(1, 1, 22, 0, 0, 0, 0, 0, 0, 0, 60),
        "up to 50 m above home, and this goes higher.",
    ),
    "an item of a mission too high": (
        mavlink.MAVLink_mission_item_int_message(1, 1, 1, 6, 16, 0, 1, 0, 0, 0, 0, 470000000, 80000000, 60),
        "up to 50 m above home, and this goes higher.",
    ),
    "the height of the fence": (
        mavlink.MAVLink_param_set_message(1, 1, b"FENCE_ALT_MAX", 900.0, 9),
        "within limits: its parameters, fences, home and the like are its owner's to change.",
    ),
}
PASSES: tuple[Any, ...] = (
    mavlink.MAVLink_manual_control_message(1, 0, 0, 500, 0, 0),
    mavlink.MAVLink_command_int_message(1, 1, 6, 192, 0, 0, -1, 0, 0, 0, 470001000, 80000000, 40),
    mavlink.MAVLink_command_long_message(1, 1, 20, 0, 0, 0, 0, 0, 0, 0, 0),
)


async def test_no_way_leads_round_the_limits_and_each_refusal_says_which(
    world: TowerWorld, root: httpx.AsyncClient, anna: Person, hawk: NewDrone
) -> None:
    agent = ObedientAgent(world.tower.hub, hawk.id)
    agent.state()
    agent.parameters()
    drone = world.tower.hub.state.drones.get(DroneId(hawk.id))
    assert drone is not None
    drone.home = Home(47.0, 8.0, 500.0)
    await lend(world, root, hawk, anna, may_arm=False, max_height_m=50, radius_m=100)
    borrower = await world.signed_in(anna)
    await ask(borrower, hawk.id, "acquire")
    traffic, drops = world.tower.hub.state.traffic, world.tower.hub.state.drops
    async with live(world, borrower) as screen:
        for number, (message, _) in enumerate(REFUSED.values(), 1):
            frame = build(message, system_id=255, component_id=190, sequence=0)
            await screen.socket.send(tag(DroneId(hawk.id), frame))
            await until(f"refusal {number}", lambda number=number: drops["loan"] == number)  # type: ignore[index, misc]
        reported = {"hawk is lent to you " + words for _, words in REFUSED.values()}
        while reported:
            reported.discard((await screen.event("notice", code="loan"))["text"])
        assert traffic.frames_to_agents == 0
        for message in PASSES:
            await screen.socket.send(tag(DroneId(hawk.id), build(message, system_id=255, component_id=190, sequence=0)))
        await until("what is within the limits to pass", lambda: traffic.frames_to_agents == len(PASSES))
    assert drops["loan"] == len(REFUSED)  # type: ignore[index]


async def test_beyond_the_limit_the_drone_holds_and_it_is_written_down(
    world: TowerWorld, root: httpx.AsyncClient, anna: Person, hawk: NewDrone
) -> None:
    agent = ObedientAgent(world.tower.hub, hawk.id)
    agent.state(armed=True, airborne=True)
    await lend(world, root, hawk, anna, max_height_m=50)
    passed = LoanLimitPassed(DroneId(hawk.id), UserId(anna.id), "above the 50 m of the loan")
    world.tower.event_handler.noticed(passed)
    assert [order.reason for order in agent.holds] == ["above the 50 m of the loan"]
    await world.tower.event_handler.caught_up()
    assert len(await audit(root, "control.loan_limit")) == 1
