"""A user who loses a role, session, token or required factor loses open WebSockets too, whichever process removed it.

The tower checks an open connection against the database once a minute; every limit here is far below that.
"""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import AsyncExitStack
from pathlib import Path
from typing import Final

import httpx
import pytest
from control_world import ObedientAgent, ask, until
from sqlalchemy import update
from sqlalchemy.ext.asyncio import AsyncSession
from test_server_fresh_proof import close_code, second_factor_on, token_of
from tower_world import Person, TowerWorld, start_tower
from websockets.asyncio.client import ClientConnection, connect
from websockets.typing import Subprotocol

from server.accounts.store.tables import UserRow
from server.accounts.store.users import UserChange, change_user, reset_second_factor
from server.audit.store.action import AuditAction
from server.audit.store.trail import COMMAND_LINE
from server.kernel.people import Principal, Role
from server.link.api.viewer_sign_in import StillSignedIn, ViewerSignIn
from wire.ids import DroneId
from wire.video import VIEWER_VIDEO_SUBPROTOCOL

WITHIN_S: Final = 20.0
"""It takes two seconds at most; other tests share the machine."""
ENDED, TURNED_AWAY = 4401, 4403
Change = Callable[[AsyncSession, int, AuditAction], Awaitable[object]]
LIVE, VIDEO = "live", "video"


def changed(**what: object) -> Change:
    return lambda session, user_id, action: change_user(
        session,
        user_id=user_id,
        change=UserChange(**what),  # type: ignore[arg-type]
        action=action,
    )


async def disabled_and_enabled(session: AsyncSession, user_id: int, action: AuditAction) -> None:
    for disabled in (True, False):
        await changed(disabled=disabled)(session, user_id, action)


ELSEWHERE: Final[dict[str, Change]] = {
    "role": changed(role=Role.OPERATOR),
    "password": changed(password_hash="x"),
    "password for good": changed(password_hash="x", must_change_password=False),
    "second factor": lambda session, user_id, action: reset_second_factor(session, user_id=user_id, action=action),
    "disabled": changed(disabled=True),
    "disabled and enabled": disabled_and_enabled,
}
"""Changes as by `tower user ...`: another process writes to the database and notifies nobody."""


@pytest.fixture
async def world(tmp_path: Path) -> AsyncIterator[TowerWorld]:
    async with start_tower(tmp_path) as running:
        yield running


@pytest.fixture
async def stack() -> AsyncIterator[AsyncExitStack]:
    async with AsyncExitStack() as opened:
        yield opened


class Sockets:
    """Live and video channels of one drone, opened with given headers."""

    def __init__(self, world: TowerWorld, drone_id: int, stack: AsyncExitStack) -> None:
        base = world.base_url.replace("http", "ws", 1)
        self._ways = {
            LIVE: (world.live_url, "tower.v1"),
            VIDEO: (f"{base}/api/v1/drones/{drone_id}/video", VIEWER_VIDEO_SUBPROTOCOL),
        }
        self._origin = {"Origin": world.base_url}
        self._stack = stack

    async def open(self, kind: str, headers: dict[str, str]) -> ClientConnection:
        url, subprotocol = self._ways[kind]
        opening = connect(
            url, additional_headers=headers | self._origin, subprotocols=[Subprotocol(subprotocol)], proxy=None
        )
        return await self._stack.enter_async_context(opening)

    async def both(self, *many: dict[str, str]) -> list[ClientConnection]:
        """Opens both and waits for their initial state."""
        opened = [await self.open(kind, headers) for headers in many for kind in (LIVE, VIDEO)]
        for one in opened:
            await asyncio.wait_for(one.recv(), WITHIN_S)
        return opened


async def all_end(sockets: list[ClientConnection]) -> None:
    async with asyncio.timeout(WITHIN_S):
        assert await asyncio.gather(*map(close_code, sockets)) == [ENDED] * len(sockets)


async def elsewhere(world: TowerWorld, change: Change, user: Person) -> None:
    async with world.database.writing() as session:
        await change(session, user.id, AuditAction(by=COMMAND_LINE, at=world.clock()))


class Victim:
    """A second admin at the controls of a drone, with a session and a token, and all channels open with both."""

    def __init__(self, world: TowerWorld, stack: AsyncExitStack) -> None:
        self.world, self.stack = world, stack

    async def set_up(self) -> None:
        world = self.world
        self.root = await world.add_user("Root", Role.ADMIN)
        self.person = await world.add_user("Second", Role.ADMIN)
        self.client = await world.signed_in(self.person)
        await second_factor_on(world, self.client)
        hawk = await world.add_drone("hawk")
        self.agent = ObedientAgent(world.tower.hub, hawk.id)
        self.drone_id = DroneId(hawk.id)
        token = await token_of(self.client, "watch", "fly", "admin")
        sockets = Sockets(world, hawk.id, self.stack)
        self.by_session = await sockets.both(world.cookie_header(self.client))
        self.by_token = await sockets.both(token)
        taken = await ask(self.client, hawk.id, "take")
        assert taken.status_code == 200, taken.text
        self.agent.posted.clear()

    def has_the_controls(self) -> bool:
        drone = self.world.tower.hub.state.drones.get(self.drone_id)
        assert drone is not None
        return drone.holder_id == self.person.id

    async def is_out(self) -> None:
        await all_end(self.by_session + self.by_token)
        await until("the end of the lease", lambda: not self.has_the_controls())
        await until("the hold", lambda: self.agent.holds)


@pytest.fixture
async def victim(world: TowerWorld, stack: AsyncExitStack) -> Victim:
    made = Victim(world, stack)
    await made.set_up()
    return made


@pytest.mark.parametrize("way", ["role", "password", "second factor", "disabled", "deleted"])
async def test_what_an_admin_takes_ends_every_connection(world: TowerWorld, victim: Victim, way: str) -> None:
    root = await world.signed_in(victim.root)
    path = f"/api/v1/users/{victim.person.id}"
    asked = {
        "role": lambda: root.patch(path, json={"role": "operator"}),
        "password": lambda: root.patch(path, json={"password": "four words are longer"}),
        "second factor": lambda: root.delete(f"{path}/second-factor"),
        "disabled": lambda: root.patch(path, json={"disabled": True}),
        "deleted": lambda: root.delete(path),
    }
    answer = await asked[way]()
    assert answer.is_success, answer.text
    await victim.is_out()


@pytest.mark.parametrize("way", [way for way in ELSEWHERE if way != "password"])
async def test_what_another_process_takes_ends_every_connection(world: TowerWorld, victim: Victim, way: str) -> None:
    """Before the fix, a reset password, a removed factor and a briefly disabled account took a minute: the session is
    gone and nothing else has changed."""
    await elsewhere(world, ELSEWHERE[way], victim.person)
    await victim.is_out()


async def test_a_password_of_another_process_ends_every_connection(world: TowerWorld, victim: Victim) -> None:
    await elsewhere(world, ELSEWHERE["password"], victim.person)
    await all_end(victim.by_session + victim.by_token)


async def test_other_sessions_and_their_pilots_are_left_alone(world: TowerWorld, victim: Victim) -> None:
    """They are rechecked, because the fleet has changed around them, and stay open."""
    anna = await world.add_user("Anna")
    sockets = Sockets(world, victim.drone_id, victim.stack)
    hers = await sockets.open(LIVE, world.cookie_header(await world.signed_in(anna)))
    await elsewhere(world, ELSEWHERE["second factor"], victim.person)
    await victim.is_out()
    await world.tower.roster.refresh()
    await hers.send("{}")
    async with asyncio.timeout(WITHIN_S):
        while "malformed" not in str(await hers.recv()):
            pass


@pytest.mark.parametrize("way", ["role", "password for good", "second factor"])
@pytest.mark.parametrize("kind", [LIVE, VIDEO])
async def test_what_is_taken_while_a_connection_opens_ends_it_too(
    world: TowerWorld, victim: Victim, monkeypatch: pytest.MonkeyPatch, kind: str, way: str
) -> None:
    """The change comes after the sign-in was looked up and before the hub has the connection."""
    look_up = ViewerSignIn.sign_in

    async def then_it_changes(*given: object) -> object:
        viewer = await look_up(*given)  # type: ignore[arg-type]
        await elsewhere(world, ELSEWHERE[way], victim.person)
        await world.tower.roster.refresh()
        return viewer

    monkeypatch.setattr(ViewerSignIn, "sign_in", then_it_changes)
    late = await Sockets(world, victim.drone_id, victim.stack).open(kind, world.cookie_header(victim.client))
    if kind == VIDEO and way == "role":  # a non-admin does not see the drone: the request is refused as well
        assert await asyncio.wait_for(close_code(late), WITHIN_S) in (ENDED, 4404)
    else:
        await all_end([late])


def still_signed_in(world: TowerWorld, viewer: Principal, *, revision: int) -> StillSignedIn:
    tower = world.tower
    return StillSignedIn(tower.hub, tower.sessions, tower.api_tokens, viewer, revision=revision)


async def refused_everywhere(world: TowerWorld, stack: AsyncExitStack, drone_id: int, *many: dict[str, str]) -> None:
    sockets = Sockets(world, drone_id, stack)
    for headers in many:
        for kind in (LIVE, VIDEO):
            code = await asyncio.wait_for(close_code(await sockets.open(kind, headers)), WITHIN_S)
            assert code == TURNED_AWAY, kind


async def test_an_operator_who_becomes_an_admin_without_the_demanded_factor(
    tmp_path: Path, stack: AsyncExitStack
) -> None:
    async with start_tower(tmp_path, admins_need_second_factor=True) as world:
        root, anna = await world.add_user("Root", Role.ADMIN), await world.add_user("Anna")
        hawk = await world.add_drone("hawk", anna)
        admin, operator = await world.signed_in(root), await world.signed_in(anna)
        await second_factor_on(world, admin)
        headers = [world.cookie_header(operator), await token_of(operator, "watch", "fly")]
        opened = await Sockets(world, hawk.id, stack).both(*headers)
        answer = await admin.patch(f"/api/v1/users/{anna.id}", json={"role": "admin"})
        assert answer.status_code == 200, answer.text
        await all_end(opened)
        await refused_everywhere(world, stack, hawk.id, *headers)


async def test_a_tower_that_comes_back_with_the_demand(tmp_path: Path, stack: AsyncExitStack) -> None:
    async with start_tower(tmp_path) as world:
        root = await world.add_user("Root", Role.ADMIN)
        hawk = await world.add_drone("hawk", root)
        admin = await world.signed_in(root)
        headers = [world.cookie_header(admin), await token_of(admin, "watch", "fly")]
        opened = await Sockets(world, hawk.id, stack).both(*headers)
    assert len(await asyncio.gather(*map(close_code, opened))) == 4
    async with start_tower(tmp_path, admins_need_second_factor=True) as world:
        await refused_everywhere(world, stack, hawk.id, *headers)


async def test_the_database_is_asked_for_more_than_whether_the_session_is_there(tmp_path: Path) -> None:
    """A factor removed without notice ends the connection at its next check."""
    async with start_tower(tmp_path, admins_need_second_factor=True) as world:
        client = await world.signed_in(await world.add_user("Root", Role.ADMIN))
        await second_factor_on(world, client)
        cookie = client.cookies["tower_session"]
        viewer = await world.tower.sessions.find(cookie, world.clock())
        assert viewer is not None
        still = still_signed_in(world, viewer, revision=world.tower.hub.fleet.revision)
        assert await still.ask(world.clock()) == viewer
        assert not still.comes_into_doubt()
        async with world.database.writing() as session:
            await session.execute(update(UserRow).values(totp_sealed=None))
        said = await still.ask(world.clock())
        assert isinstance(said, str)
        assert "second factor" in said


async def test_a_session_that_began_after_the_snapshot_is_asked_about_and_stands(
    world: TowerWorld, stack: AsyncExitStack
) -> None:
    """The fleet's snapshot lacks the session. That requires a check, but does not end it."""
    anna = await world.add_user("Anna")
    client: httpx.AsyncClient = await world.signed_in(anna)
    viewer = await world.tower.sessions.find(client.cookies["tower_session"], world.clock())
    assert viewer is not None
    assert not world.tower.hub.fleet.knows_sign_in(viewer.session_id)
    still = still_signed_in(world, viewer, revision=-1)
    assert still.comes_into_doubt()
    assert not still.comes_into_doubt()
    assert await still.ask(world.clock()) == viewer
    await world.add_drone("hawk", anna)
    assert world.tower.hub.fleet.knows_sign_in(viewer.session_id)
    assert not still.comes_into_doubt(), "the newest snapshot has it"
