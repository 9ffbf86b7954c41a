"""Sign-in requests that several passkey tests share."""

from typing import Any

import httpx
from control_world import audit
from passkey_world import (
    PARTY_ID,
)
from tower_world import PASSWORD, TowerWorld
from worlds.soft_authenticator import b64

ME = "/api/v1/me"
SESSION = "/api/v1/session"
CREATION = {"rp": {"id": PARTY_ID}, "user": {"id": b64(bytes(32))}, "challenge": b64(bytes(32))}
"""Options that no tower has issued."""


async def with_password(world: TowerWorld, **more: Any) -> httpx.Response:
    return await (await world.client()).post(SESSION, json={"name": "Anna", "password": PASSWORD} | more)


async def refusals(root: httpx.AsyncClient) -> list[str]:
    """Returns the reasons for refused sign-ins, newest first."""
    return [one["detail"]["why"] for one in await audit(root, "session.refused")]
