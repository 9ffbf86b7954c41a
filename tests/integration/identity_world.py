"""A world for sign-in by key: a tower, a drone and the channel between them."""

import asyncio
import contextlib
import secrets
from collections.abc import AsyncIterator
from typing import Any

import pytest
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey
from cryptography.hazmat.primitives.asymmetric.x25519 import X25519PrivateKey
from tower_world import NewDrone, TowerWorld
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed
from websockets.typing import Subprotocol

from onboard_agent.link.identity import Identity
from onboard_agent.link.signing_in import KeySignIn
from onboard_agent.link.tower_url import TowerUrl, parse_tower_url
from onboard_agent.sockets.control_channel import NoLink, OpenedChannel, open_channel
from wire.control_messages import (
    KEY_SUBPROTOCOL,
)
from wire.drone_key import DroneKey, public_half
from wire.ids import DroneId
from wire.sign_in import SignInPurpose


def url(world: TowerWorld) -> TowerUrl:
    return parse_tower_url(world.base_url)


def record(world: TowerWorld, drone: NewDrone) -> Any:
    found = world.tower.hub.state.drones.get(DroneId(drone.id))
    assert found is not None
    return found.record


@contextlib.asynccontextmanager
async def signed_in(world: TowerWorld, identity: Identity) -> AsyncIterator[OpenedChannel]:
    opened = await _on_a_busy_machine(world, identity)
    try:
        yield opened
    finally:
        await opened.connection.close()


async def _on_a_busy_machine(world: TowerWorld, identity: Identity) -> OpenedChannel:
    """Retries: on a busy machine the agent gives up an upgrade after 5 s, before it sends anything."""
    for _ in range(5):
        try:
            return await open_channel(url(world), identity)
        except NoLink as error:
            if "does not answer the upgrade" not in str(error):
                raise
    raise AssertionError("the tower never answered")


@contextlib.asynccontextmanager
async def channel(world: TowerWorld, credential: str = "") -> AsyncIterator[ClientConnection]:
    async with connect(
        world.agent_url,
        subprotocols=[Subprotocol(KEY_SUBPROTOCOL)],
        additional_headers={"Authorization": f"Bearer {credential}"} if credential else None,
        proxy=None,
    ) as opened:
        yield opened


async def refused(opened: ClientConnection) -> str:
    """Returns the tower's reason for closing the connection."""
    with pytest.raises(ConnectionClosed):
        await asyncio.wait_for(opened.recv(), 10)
    assert opened.close_code == 4401, opened.close_reason
    return str(opened.close_reason)


def public_half_of(seed: bytes) -> bytes:
    return public_half(Ed25519PrivateKey.from_private_bytes(seed))


def _agent(challenge: Any, key: DroneKey) -> Any:
    return KeySignIn(
        challenge,
        key=key,
        tower="127.0.0.1:1",
        tower_key=None,
        certificate=None,
        purpose=SignInPurpose.LINK,
        private_key=X25519PrivateKey.generate(),
        random_bytes=secrets.token_bytes,
    )
