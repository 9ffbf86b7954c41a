"""A tower configured for https://tower.example.org, and people whose browsers have passkeys for it."""

from dataclasses import dataclass
from typing import Any

import httpx
from tower_world import Person, TowerWorld
from worlds.soft_authenticator import SoftAuthenticator

PUBLIC_URL = "https://tower.example.org"
PARTY_ID = "tower.example.org"
OPTIONS = "/api/v1/session/passkey/options"
SIGN_IN = "/api/v1/session/passkey"
PASSKEYS = "/api/v1/me/passkeys"


def new_authenticator(**kind: Any) -> SoftAuthenticator:
    return SoftAuthenticator(PUBLIC_URL, **kind)


async def asked(client: httpx.AsyncClient, path: str = OPTIONS) -> dict[str, Any]:
    answer = await client.post(path)
    assert answer.status_code == 200, answer.text
    options: dict[str, Any] = answer.json()["public_key"]
    return options


async def added(
    client: httpx.AsyncClient, authenticator: SoftAuthenticator, name: str = "telephone", **faults: Any
) -> httpx.Response:
    made = authenticator.make(await asked(client, f"{PASSKEYS}/options"), **faults)
    return await client.post(PASSKEYS, json={"name": name, "credential": made})


async def signs_in(client: httpx.AsyncClient, authenticator: SoftAuthenticator, **faults: Any) -> httpx.Response:
    """Signs in with the passkey alone."""
    answer = authenticator.get(await asked(client), **faults)
    return await client.post(SIGN_IN, json={"credential": answer})


@dataclass
class Owner:
    """A user with one passkey, and the browser in which they added it."""

    person: Person
    client: httpx.AsyncClient
    authenticator: SoftAuthenticator
    recovery_codes: list[str]
    passkey_id: int


async def new_owner(world: TowerWorld, person: Person, **kind: Any) -> Owner:
    client = await world.signed_in(person)
    authenticator = new_authenticator(**kind)
    answer = await added(client, authenticator)
    assert answer.status_code == 201, answer.text
    body = answer.json()
    return Owner(person, client, authenticator, body["recovery_codes"], body["passkey"]["id"])
