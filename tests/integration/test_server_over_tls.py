"""Behind a proxy that ends TLS, and without one: cookies, headers, origins, and files on the disk."""

import stat
from collections.abc import AsyncIterator
from datetime import datetime
from pathlib import Path
from typing import Final

import httpx
import pytest
from tower_world import PASSWORD, TowerWorld, assert_problem, start_tower
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

from server.http.security_headers import TABLE
from server.kernel.people import Role
from server.runtime.private_files import make_private_folder
from server.runtime.settings import SettingsError, read_settings
from server.storage.database import open_database

SIGN_IN: Final = {"name": "Root", "password": PASSWORD}
TLS: Final = {"X-Forwarded-Proto": "https"}
SECURE: Final = "__Host-tower_session"
PLAIN: Final = "tower_session"


@pytest.fixture
async def world(tmp_path: Path) -> AsyncIterator[TowerWorld]:
    async with start_tower(tmp_path, security_contact="mailto:security@tower.example") as running:
        await running.add_user("Root", Role.ADMIN)
        yield running


def cookies_in(answer: httpx.Response) -> dict[str, list[str]]:
    """Maps the name of each cookie set to its value and attributes."""
    found = {}
    for header in answer.headers.get_list("set-cookie"):
        pair, *attributes = [one.strip() for one in header.split(";")]
        name, _, value = pair.partition("=")
        found[name] = [value, *sorted(attributes)]
    return found


async def test_the_session_over_tls_from_sign_in_to_sign_out(world: TowerWorld) -> None:
    client = await world.client(headers=TLS)
    answer = await client.post("/api/v1/session", json=SIGN_IN)
    assert answer.status_code == 200
    ((name, (token, *attributes)),) = cookies_in(answer).items()
    assert name == SECURE
    assert {"HttpOnly", "Path=/", "SameSite=strict", "Secure"} <= set(attributes)
    assert not any(one.lower().startswith("domain") for one in attributes)

    async def me(cookie: str, **more: str) -> httpx.Response:
        return await (await world.client()).get("/api/v1/me", headers={"Cookie": cookie, **more})

    assert (await me(f"{SECURE}={token}", **TLS)).json()["name"] == "Root"
    assert (await me(f"other=1; {SECURE}={token}; more=2", **TLS)).status_code == 200
    # An attacker on the path, or a sibling domain, can set the plain name: the tower ignores and deletes it.
    planted = await me(f"{PLAIN}={token}", **TLS)
    assert_problem(planted, 401, "not-signed-in")
    assert cookies_in(planted)[PLAIN][0] == "" and "Max-Age=0" in cookies_in(planted)[PLAIN]
    both = await me(f"{PLAIN}=planted; {SECURE}={token}", **TLS)
    assert both.status_code == 200
    # The reverse: without TLS the cookie of TLS is ignored.
    assert_problem(await me(f"{SECURE}={token}"), 401, "not-signed-in")

    out = await (await world.client()).delete("/api/v1/session", headers={**TLS, "Cookie": f"{SECURE}={token}"})
    assert cookies_in(out)[SECURE][0] in ("", '""') and "Max-Age=0" in cookies_in(out)[SECURE]
    assert "Secure" in cookies_in(out)[SECURE]
    assert_problem(await me(f"{SECURE}={token}", **TLS), 401, "session-expired")


async def test_the_live_channel_over_tls_takes_the_same_cookie_and_the_same_origin(world: TowerWorld) -> None:
    client = await world.client(headers=TLS)
    answer = await client.post("/api/v1/session", json=SIGN_IN)
    token = cookies_in(answer)[SECURE][0]
    own = world.base_url.replace("http://", "https://")

    async def first_word(cookie: str, origin: str) -> str:
        options = {"additional_headers": {"Cookie": cookie, **TLS}, "origin": origin, "subprotocols": ["tower.v1"]}
        async with connect(world.live_url, **options) as socket:
            try:
                return str(await socket.recv())[:20]
            except ConnectionClosed as closed:
                return str(closed.rcvd.code if closed.rcvd else 0)

    assert "welcome" in await first_word(f"{SECURE}={token}", own)
    assert await first_word(f"{PLAIN}={token}", own) == "4401"
    assert await first_word(f"{SECURE}={token}", world.base_url) == "4403", "http is another origin than https"


async def test_without_tls_the_cookie_keeps_its_plain_name(world: TowerWorld) -> None:
    answer = await (await world.client()).post("/api/v1/session", json=SIGN_IN)
    ((name, (_, *attributes)),) = cookies_in(answer).items()
    assert name == PLAIN and "Secure" not in attributes


async def test_headers_are_those_of_the_table_and_hsts_is_for_tls_alone(world: TowerWorld) -> None:
    client = await world.client()
    for path in ("/", "/api/v1/me", "/api/v1/nothing", "/.well-known/security.txt"):
        clear, tls = await client.get(path), await client.get(path, headers=TLS)
        for one in TABLE:
            assert tls.headers[one.name] == one.value
            assert clear.headers.get(one.name) == (None if one.tls_only else one.value)
        for feature in ("gamepad=(self)", "geolocation=(self)", "fullscreen=(self)"):
            assert feature in clear.headers["permissions-policy"]
    assert "strict-transport-security" in tls.headers


async def test_the_public_address_over_tls_counts_even_where_the_proxy_does_not_say_so(tmp_path: Path) -> None:
    async with start_tower(tmp_path, public_url="https://tower.example") as world:
        await world.add_user("Root", Role.ADMIN)
        client = await world.client(headers={"Host": "tower.example", "Origin": "https://tower.example"})
        answer = await client.post("/api/v1/session", json=SIGN_IN)
        assert list(cookies_in(answer)) == [SECURE]
        assert "strict-transport-security" in answer.headers
        here = await (await world.client()).post("/api/v1/session", json=SIGN_IN)
        assert list(cookies_in(here)) == [PLAIN], "from this very machine, as ever"


async def test_who_finds_a_weakness_learns_whom_to_tell(world: TowerWorld, tmp_path: Path) -> None:
    answer = await (await world.client()).get("/.well-known/security.txt")
    assert answer.headers["content-type"] == "text/plain; charset=utf-8"
    fields = dict(line.split(": ", 1) for line in answer.text.splitlines())
    assert fields["Contact"] == "mailto:security@tower.example"
    expires = datetime.fromisoformat(fields["Expires"])
    assert 100 < (expires - world.clock()).days < 366
    other = tmp_path / "other"
    other.mkdir()
    async with start_tower(other) as without:
        assert_problem(await (await without.client()).get("/.well-known/security.txt"), 404, "not-found")


@pytest.mark.parametrize(
    "contact", ["me", "http://tower.example", "mailto:a b", "mailto:ü", "https://x\nExpires: never"]
)
def test_a_contact_is_an_address(contact: str) -> None:
    with pytest.raises(SettingsError, match="TOWER_SECURITY_CONTACT"):
        read_settings({"TOWER_SECURITY_CONTACT": contact})


def mode_of(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


async def test_the_database_is_for_the_towers_user_alone_also_an_old_one(world: TowerWorld) -> None:
    var = world.settings.var
    await world.add_user("Zoe")
    there = [path for path in var.iterdir() if path.name.startswith("tower.sqlite3")]
    assert len(there) >= 2, "with what SQLite keeps beside it"
    assert {mode_of(path) for path in there} == {0o600}
    there = [path for path in there if ".tower-" not in path.name]  # the life file is its own process's
    for path in there:
        path.chmod(0o644)
    again = open_database(world.settings.database_url)
    async with again.reading() as session:
        assert session is not None
        await session.connection()
    await again.close()
    assert {mode_of(path) for path in there if path.exists()} == {0o600}


async def test_the_data_folder_is_closed_at_the_start_and_no_other_folder(tmp_path: Path) -> None:
    async with start_tower(tmp_path) as world:
        var = world.settings.var
    var.chmod(0o755)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir(mode=0o755)
    elsewhere.chmod(0o755)
    make_private_folder(elsewhere)
    make_private_folder(tmp_path / "not there")
    async with start_tower(tmp_path):
        assert mode_of(var) == 0o700
    assert mode_of(elsewhere) == 0o755
