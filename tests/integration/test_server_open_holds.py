"""Open holds over REST and the live channel: what people see, "stay", an emergency take, and a restarted tower."""

from collections.abc import AsyncIterator
from datetime import datetime
from pathlib import Path

import httpx
import pytest
from control_world import UNDECIDED, ObedientAgent, ask, audit, live, until
from sqlalchemy import select
from sqlalchemy.exc import OperationalError
from tower_world import NewDrone, TowerWorld, assert_problem, start_tower

from server.control.store.tables import ControlLeaseRow
from server.kernel.people import Role
from server.link.core.link_changes import ORDERED_AGAIN
from wire.control_messages import AutopilotState, HoldStep
from wire.ids import DroneId
from wire.open_holds import OPEN_HOLDS, AfterSticks, HoldStage, HoldState, Lost, LostAction, LostPhase, Stay


class Scene:
    """Anna and Bert own hawk, which Anna holds; Root is an admin. The agent supports open holds."""

    def __init__(self, world: TowerWorld, drone: NewDrone, clients: list[httpx.AsyncClient]) -> None:
        self.world, self.drone = world, drone
        self.anna, self.bert, self.root = clients
        self.path = f"/api/v1/drones/{drone.id}"
        self.agent = self.link()
        self._number = 0

    def link(self) -> ObedientAgent:
        agent = ObedientAgent(self.world.tower.hub, self.drone.id, takes=(OPEN_HOLDS,))
        agent.state(armed=True, airborne=True)
        return agent

    def announce(self, phase: LostPhase = LostPhase.QUIET, lost: Lost | None = None, *, is_open: bool = True) -> None:
        self._number += 1
        reported = HoldState(
            number=self._number,
            open=is_open,
            stage=HoldStage.STAY,
            mode="BRAKE",
            sticks=False,
            after_sticks=AfterSticks.STAYS,
            lost=lost,
            phase=phase,
            action=LostAction.RETURN if lost else None,
            due_in_s=25.0 if phase is LostPhase.COUNTING else None,
        )
        self.world.tower.hub.reports.receive(self.agent.link, reported, at=self.world.clock())

    async def hold_open(self) -> bool | None:
        """Returns the stored value."""
        await self.world.tower.event_handler.caught_up()
        async with self.world.database.reading() as session:
            kept = select(ControlLeaseRow.hold_open).where(ControlLeaseRow.drone_id == self.drone.id)
            return await session.scalar(kept)

    @property
    def stays(self) -> list[Stay]:
        return [message for message in self.agent.posted if isinstance(message, Stay)]


async def _scene(world: TowerWorld) -> Scene:
    people = [await world.add_user("Anna"), await world.add_user("Bert"), await world.add_user("Root", Role.ADMIN)]
    drone = await world.add_drone("hawk", *people[:2])
    scene = Scene(world, drone, [await world.signed_in(person) for person in people])
    assert (await ask(scene.anna, drone.id, "acquire")).status_code == 200
    return scene


@pytest.fixture
async def scene(tmp_path: Path) -> AsyncIterator[Scene]:
    async with start_tower(tmp_path) as world:
        yield await _scene(world)


async def test_a_countdown_says_why_nobody_flies_it(scene: Scene) -> None:
    async def because() -> str:
        return str((await scene.bert.get(scene.path)).json()["hold"]["nobody_because"])

    scene.announce(LostPhase.COUNTING, Lost.PERSON, is_open=False)
    assert await because() == "Anna has the controls and is away", "no browser of hers is there"
    await ask(scene.anna, scene.drone.id, "release")
    assert await because() == "Anna released the controls"
    assert (await ask(scene.root, scene.drone.id, "take")).status_code == 200
    assert await because() == "Root has the controls and is away"
    scene.announce(LostPhase.COUNTING, Lost.TOWER, is_open=False)
    assert await because() == "", "then nobody can stop it"


async def test_an_open_hold_is_shown_by_rest_and_live_alike(scene: Scene) -> None:
    assert (await scene.anna.get(scene.path)).json()["hold"] is None
    async with live(scene.world, scene.bert) as screen:
        scene.announce(LostPhase.COUNTING, Lost.PERSON)
        reported = (await screen.event("drone"))["drone"]["hold"]
        shown = (await scene.anna.get(scene.path)).json()["hold"]
        assert {**reported, "due_at": 0, "as_of": 0} == {**shown, "due_at": 0, "as_of": 0}
        assert (shown["stage"], shown["lost"], shown["phase"], shown["action"]) == (
            "stay",
            "person",
            "counting",
            "return",
        )
        due_in = datetime.fromisoformat(shown["due_at"]) - scene.world.clock()
        assert 0 < due_in.total_seconds() <= 25
        scene.announce(is_open=False)
        assert (await screen.event("drone"))["drone"]["hold"] is None


async def test_unknown_is_unknown(scene: Scene) -> None:
    async def shown() -> tuple[object, object, object]:
        view = (await scene.anna.get(scene.path)).json()
        return view["autopilot_heard"], view["armed"], view["airborne"]

    assert await shown() == (True, True, True)
    silent = AutopilotState(heard=False, armed=False, airborne=False)
    async with live(scene.world, scene.bert) as screen:
        scene.world.tower.hub.reports.receive(scene.agent.link, silent)
        reported = (await screen.event("drone"))["drone"]
        assert (reported["armed"], reported["airborne"]) == (None, None)
    assert await shown() == (False, None, None)
    scene.agent.state()
    assert await shown() == (True, False, False)
    scene.world.tower.hub.detach_link(scene.agent.link)
    assert await shown() == (False, None, None)
    again = await scene.root.post(f"{scene.path}/rehearsal", json={"what": "tower"})
    assert_problem(again, 409, "offline")


async def test_stay_reaches_the_agent_with_who_said_it(scene: Scene) -> None:
    scene.announce(LostPhase.COUNTING, Lost.PERSON)
    for client, name in ((scene.anna, "Anna"), (scene.bert, "Bert"), (scene.root, "Root")):
        answer = await ask(client, scene.drone.id, "stay", reason="we are coming")
        assert answer.status_code == 200, answer.text
        assert answer.json()["hold"]["phase"] == "counting", "the agent has the last word"
        assert scene.stays[-1].by == name
    assert len({one.order_id for one in scene.stays}) == 3
    newest = (await audit(scene.root, "control.stay"))[0]
    assert (newest["actor_name"], newest["detail"]["result"], newest["drone_id"]) == ("Root", "done", scene.drone.id)
    assert newest["detail"]["reason"] == "we are coming"


@pytest.mark.parametrize(
    ("phase", "lost"),
    [
        (LostPhase.QUIET, None),
        (LostPhase.STAYED, Lost.PERSON),
        (LostPhase.ASKING, Lost.PERSON),
        (LostPhase.COUNTING, Lost.TOWER),
    ],
)
async def test_where_nothing_is_counted_for_a_person_there_is_nothing_to_stay(
    scene: Scene, phase: LostPhase, lost: Lost | None
) -> None:
    scene.announce(phase, lost)
    assert_problem(await ask(scene.anna, scene.drone.id, "stay"), 409, "nothing-to-stay")
    assert scene.stays == []
    (refused,) = await audit(scene.root, "control.stay")
    assert (refused["detail"]["result"], refused["detail"]["code"]) == ("refused", "nothing-to-stay")


async def test_who_is_shut_out_or_a_stranger_may_not_say_stay(scene: Scene) -> None:
    scene.announce(LostPhase.COUNTING, Lost.PERSON)
    stranger = await scene.world.signed_in(await scene.world.add_user("Mallory"))
    assert_problem(await ask(stranger, scene.drone.id, "stay"), 404, "unknown-drone")
    await ask(scene.root, scene.drone.id, "take")
    assert_problem(await ask(scene.anna, scene.drone.id, "stay"), 409, "taken-away")
    assert (await ask(scene.bert, scene.drone.id, "stay")).status_code == 200, "another owner"
    await ask(scene.root, scene.drone.id, "give")
    assert (await ask(scene.anna, scene.drone.id, "stay")).status_code == 200, "offered to her"
    scene.world.tower.hub.detach_link(scene.agent.link)
    assert_problem(await ask(scene.anna, scene.drone.id, "stay"), 409, "offline")


async def test_stay_needs_no_database(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    scene.announce(LostPhase.COUNTING, Lost.PERSON)

    def broken(*_: object, **__: object) -> None:
        raise OperationalError("INSERT", None, OSError("disk full"))

    monkeypatch.setattr("server.control.store.stay_service.record", broken)
    assert (await ask(scene.anna, scene.drone.id, "stay")).status_code == 200
    assert len(scene.stays) == 1


@pytest.mark.parametrize(("body", "interrupts"), [({}, False), ({"interrupt": True}, True)])
async def test_only_an_emergency_interrupts_a_return(scene: Scene, body: dict[str, bool], interrupts: bool) -> None:
    assert (await ask(scene.root, scene.drone.id, "take", **body)).status_code == 200
    assert [order.interrupts for order in scene.agent.decided_holds] == [interrupts]
    assert interrupts or not any(order.interrupts for order in scene.agent.holds)
    (taken,) = await audit(scene.root, "control.take")
    assert taken["detail"]["interrupt"] is interrupts
    await until("its answer", lambda: not scene.agent.link.interrupts)
    await ask(scene.root, scene.drone.id, "give")
    assert [order.interrupts for order in scene.agent.decided_holds] == [interrupts, False]


@pytest.mark.parametrize(("session_s", "change_s"), [(30.0, 0.0), (0.0, 30.0)])
async def test_a_database_that_takes_its_time_adds_a_hold_which_interrupts_too(
    scene: Scene, monkeypatch: pytest.MonkeyPatch, session_s: float, change_s: float
) -> None:
    assert (await scene.root.get("/api/v1/drones")).status_code == 200  # the tower remembers who Root is
    monkeypatch.setattr("server.control.api.routes.DECIDED_WITHIN_S", session_s)
    monkeypatch.setattr("server.control.store.service.DECIDED_WITHIN_S", change_s)
    assert (await ask(scene.root, scene.drone.id, "take", interrupt=True)).status_code == 200
    first, second = scene.agent.holds
    assert UNDECIDED in first.reason
    assert (first.interrupts, second.interrupts) == (True, True)
    assert (first.epoch, second.epoch) == (1, 2)
    assert scene.agent.decided_holds == [second]


async def test_a_hold_ordered_while_the_drone_is_offline_outlives_the_tower(tmp_path: Path) -> None:
    async with start_tower(tmp_path) as world:
        scene = await _scene(world)
        world.tower.hub.detach_link(scene.agent.link)
        assert (await ask(scene.root, scene.drone.id, "take")).status_code == 200
        assert await scene.hold_open() is True
    async with start_tower(tmp_path) as world:
        agent = ObedientAgent(world.tower.hub, scene.drone.id, takes=(OPEN_HOLDS,), answer=HoldStep.NOT_NEEDED)
        (order,) = agent.holds
        assert (order.reason, order.interrupts) == (ORDERED_AGAIN, False)
        live_drone = world.tower.hub.state.drones.get(DroneId(scene.drone.id))
        assert live_drone is not None
        await until("the end of the hold", lambda: not live_drone.hold_noted)
        scene.world = world
        assert await scene.hold_open() is False
    async with start_tower(tmp_path) as world:
        assert ObedientAgent(world.tower.hub, scene.drone.id, takes=(OPEN_HOLDS,)).holds == []


async def test_a_hold_that_was_open_outlives_the_tower(tmp_path: Path) -> None:
    async with start_tower(tmp_path) as world:
        scene = await _scene(world)
        scene.announce()
        assert await scene.hold_open() is True
        await ask(scene.anna, scene.drone.id, "release")
        assert await scene.hold_open() is True, "the lease is written beside it"
    async with start_tower(tmp_path) as world:
        assert ObedientAgent(world.tower.hub, scene.drone.id, takes=(OPEN_HOLDS,)).holds[0].reason == ORDERED_AGAIN
