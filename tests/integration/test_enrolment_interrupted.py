"""An enrolment survives an interruption at each of its steps."""

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from identity_world import record, signed_in, url
from tower_world import NewDrone, TowerWorld, start_tower

from onboard_agent import cli
from onboard_agent.link import enrolment
from onboard_agent.link.enrolment import enrol
from onboard_agent.link.identity_file import read_identity, write_private
from onboard_agent.link.tower_url import TowerUrl, parse_tower_url
from onboard_agent.unusable import Unusable
from server.kernel.people import Role
from wire.credential import Credential


@pytest.fixture
async def world(tmp_path: Path) -> AsyncIterator[TowerWorld]:
    async with start_tower(tmp_path) as running:
        yield running


@pytest.fixture
async def hawk(world: TowerWorld) -> NewDrone:
    return await world.add_drone("hawk")


# -- the exchange of a credential ------------------------------------------------------------------------------------


@pytest.fixture
async def credential(world: TowerWorld, hawk: NewDrone) -> Credential:
    return await world.give_credential(hawk)


@pytest.fixture
def file(tmp_path: Path, credential: Credential) -> Path:
    """A credential file as an older agent writes it."""
    path = tmp_path / "token"
    path.write_text(f"{credential}\n")
    return path


# -- enrolment -------------------------------------------------------------------------------------------------------


async def test_an_enrolment_survives_whatever_ends_it_between_its_steps(
    world: TowerWorld, hawk: NewDrone, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    root = await world.signed_in(await world.add_user("Root", Role.ADMIN))
    token = (await root.post(f"/api/v1/drones/{hawk.id}/enrolments", json={})).json()["token"]
    folder = tmp_path / "drone"
    folder.mkdir()
    file = folder / "token"
    write_private(file, f"{hawk.key}\n")

    def killed(path: Path, text: str) -> None:
        if path == file:
            raise OSError(28, "No space left on device")
        write_private(path, text)

    with monkeypatch.context() as patched:
        patched.setattr(enrolment, "write_private", killed)
        with pytest.raises(Unusable, match="No space left"):
            await asyncio.to_thread(enrol, url(world), token, file)
    assert read_identity(file).key == hawk.key, "what was there stays there until all is well"
    assert record(world, hawk).public_key != hawk.key.public, "the tower has answered"
    assert await asyncio.to_thread(enrol, url(world), token, file) == "hawk"
    key = read_identity(file).key
    assert key is not None and key.public == record(world, hawk).public_key
    assert list(folder.iterdir()) == [file]
    assert file.stat().st_mode & 0o777 == 0o600
    async with signed_in(world, read_identity(file)):
        pass
    with pytest.raises(Unusable, match="no longer valid"):
        await asyncio.to_thread(enrol, url(world), token, folder / "another")


async def test_an_agent_whose_file_holds_a_token_enrols_itself_at_its_start(
    world: TowerWorld, hawk: NewDrone, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    root = await world.signed_in(await world.add_user("Root", Role.ADMIN))
    token = (await root.post(f"/api/v1/drones/{hawk.id}/enrolments", json={})).json()["token"]
    file = tmp_path / "token"
    write_private(file, f"{token}\n")
    waited: list[float] = []
    away = parse_tower_url("http://127.0.0.1:9")
    towers = iter([away, away, url(world)])

    def enrol_somewhere(_: TowerUrl, token: str, path: Path) -> str:
        return enrol(next(towers), token, path)  # it is not there yet

    monkeypatch.setattr(cli, "enrol_here", enrol_somewhere)
    monkeypatch.setattr(cli.time, "sleep", waited.append)
    await asyncio.to_thread(cli._enrol_first, url(world), file)
    assert len(waited) == 2
    key = read_identity(file).key
    assert key is not None
    assert key.public == record(world, hawk).public_key
    await asyncio.to_thread(cli._enrol_first, url(world), file)
    assert read_identity(file).key == key, "the next start has nothing to enrol"
