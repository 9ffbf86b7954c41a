"""Invalid messages on a WebSocket: the channel ends with a code, a counter grows, nothing is logged."""

import logging
import time
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
import structlog
from agent_fakes import until
from cryptography.hazmat.primitives.asymmetric.x25519 import X25519PrivateKey
from structlog.testing import capture_logs
from tower_world import NewDrone, TowerWorld, start_tower
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.typing import Subprotocol

from server.anonymous.core.limits import LIMITS
from server.app.log import configure_log
from server.kernel.people import Role
from wire.control_messages import AGENT_SUBPROTOCOL, AutopilotState, Hello, encode_message
from wire.drops import DropReason
from wire.key_agreement import public_bytes


@pytest.fixture
async def world(tmp_path: Path) -> AsyncIterator[TowerWorld]:
    async with start_tower(tmp_path) as world:
        yield world


async def agent_channel(world: TowerWorld) -> ClientConnection:
    drone: NewDrone = await world.add_drone("Kestrel")
    credential = await world.give_credential(drone)
    return await connect(
        world.agent_url,
        subprotocols=[Subprotocol(AGENT_SUBPROTOCOL)],
        additional_headers={"Authorization": f"Bearer {credential}"},
        compression=None,
        proxy=None,
    )


async def live_channel(world: TowerWorld) -> ClientConnection:
    root = await world.add_user("root", Role.ADMIN)
    client = await world.signed_in(root)
    connection = await connect(
        world.live_url,
        additional_headers={**world.cookie_header(client), "Origin": world.base_url},
        compression=None,
        proxy=None,
    )
    await connection.recv()
    return connection


async def how_it_ends(connection: ClientConnection) -> int | None:
    with pytest.raises(ConnectionClosed):
        while True:
            await connection.recv()
    return connection.close_code


@pytest.mark.parametrize(
    ("first", "is_text", "code"),
    [
        (b"\x01\x02", False, 4400),
        ('{"type":"' + "空" * 300 + '"}', True, 4400),
        (b'{"type":"hello","more":' + b"[" * 5000, True, 4400),
        (b'{"type":"\xff"}', True, 1007),
        (b" " * 70_000, True, 1009),
    ],
    ids=["bytes", "words too long for a close frame", "nested", "no UTF-8", "too large"],
)
async def test_a_first_message_that_is_no_hello_ends_the_agents_channel(
    world: TowerWorld, first: bytes | str, is_text: bool, code: int
) -> None:
    connection = await agent_channel(world)
    await connection.send(first, text=is_text)
    assert await how_it_ends(connection) == code
    assert world.tower.hub.state.drops == {DropReason.MALFORMED: 1}


async def test_a_linked_agents_message_that_makes_no_sense_costs_itself_alone(world: TowerWorld) -> None:
    connection = await agent_channel(world)
    hello = Hello(agent_version="1.0", public_key=public_bytes(X25519PrivateKey.generate()))
    await connection.send(encode_message(hello))
    await connection.recv()
    for nonsense in ('{"type":"of_a_later_release"}', '{"type":"autopilot_state","heard":7}', "[" * 5000, "no JSON"):
        await connection.send(nonsense)
    await connection.send(encode_message(AutopilotState(heard=True, armed=True, airborne=True)))
    (drone,) = world.tower.hub.state.drones.values()
    await until(lambda: drone.armed)
    assert connection.close_code is None
    assert world.tower.hub.state.drops[DropReason.MALFORMED] == 4


@pytest.mark.parametrize(
    ("message", "code"), [(b'{"type":"\xff"}', 1007), (b" " * 70_000, 1009)], ids=["no UTF-8", "too large"]
)
async def test_what_cannot_even_be_read_ends_a_browsers_channel(world: TowerWorld, message: bytes, code: int) -> None:
    connection = await live_channel(world)
    await connection.send(message, text=True)
    assert await how_it_ends(connection) == code
    assert world.tower.hub.state.drops == {DropReason.MALFORMED: 1}


async def test_a_browser_that_talks_nonsense_is_answered_briefly_and_ended_at_last(world: TowerWorld) -> None:
    connection = await live_channel(world)
    for _ in range(20):
        await connection.send('{"type":"watch","rate_hz":5,"more":' + "[" * 60_000)
    answers = []
    with pytest.raises(ConnectionClosed):
        while True:
            answers.append(await connection.recv())
    assert connection.close_code == 4400
    assert answers
    assert max(map(len, answers)) < 500
    assert world.tower.hub.state.drops == {DropReason.MALFORMED: 20}


async def test_unknown_agents_write_few_log_lines(world: TowerWorld) -> None:
    """Before the fix each wrote one line."""
    tries, began = 60, time.monotonic()
    headers = {"Authorization": "Bearer nonsense"}
    with capture_logs() as lines:
        for _ in range(tries):
            with pytest.raises(InvalidStatus):
                await connect(
                    world.agent_url,
                    subprotocols=[Subprotocol(AGENT_SUBPROTOCOL)],
                    additional_headers=headers,
                    proxy=None,
                )
    written = sum(line["event"] == "agent_refused" for line in lines)
    allowed = LIMITS.log_lines_burst + LIMITS.log_lines_per_s * (time.monotonic() - began) + 1
    assert 0 < written <= allowed
    assert world.tower.anonymous.log.left_out == tries - written


def test_a_text_that_is_no_utf8_leaves_no_traceback_in_the_log(capsys: pytest.CaptureFixture[str]) -> None:
    before = logging.getLogger().handlers[:], logging.getLogger().level
    structlog_before = structlog.get_config()
    try:
        configure_log("json")
        log = logging.getLogger("uvicorn.error")
        try:
            b"\xff".decode()
        except UnicodeDecodeError:
            log.exception("Invalid UTF-8 sequence received from client.")
        try:
            raise KeyError("ours")
        except KeyError:
            log.exception("Exception in ASGI application")
    finally:
        logging.getLogger().handlers[:], logging.getLogger().level = before
        structlog.configure(**structlog_before)
    said = capsys.readouterr().err
    assert "UTF-8" not in said
    assert "Exception in ASGI application" in said
