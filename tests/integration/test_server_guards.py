"""Common to all responses: problem documents, origins, sizes, security headers, the console's files."""

import gzip
import json
from pathlib import Path

import httpx
import pytest
from tower_world import PASSWORD, TowerWorld, assert_problem, start_tower

from server.http.body import MAX_COLONS
from server.http.problems import MAX_ERRORS
from server.kernel.people import Role
from server.runtime.listening import CannotListen, listen
from server.storage.schema import DatabaseNotReady

SESSION = "/api/v1/session"
SIGN_IN = {"name": "Root", "password": PASSWORD}


@pytest.fixture
async def world(tmp_path: Path):
    async with start_tower(tmp_path, web=_console(tmp_path)) as running:
        await running.add_user("Root", Role.ADMIN)
        yield running


def _console(folder: Path) -> Path:
    built = folder / "dist"
    (built / "assets").mkdir(parents=True)
    (built / "index.html").write_text("<!doctype html><title>console</title>")
    (built / "assets" / "app-1a2b3c.js").write_text("export {}")
    (folder / "secret.txt").write_text("not for you")
    return built


async def test_health_tells_that_the_tower_is_up(world: TowerWorld) -> None:
    answer = await (await world.client()).get("/api/v1/health")
    assert answer.json()["status"] == "ok"


@pytest.mark.parametrize(
    ("method", "path", "status", "slug"),
    [
        ("GET", "/api/v1/nothing", 404, "not-found"),
        ("POST", "/api/v1/nothing", 404, "not-found"),
        ("GET", "/api/", 404, "not-found"),
        ("PUT", "/api/v1/me", 405, "method-not-allowed"),
        ("GET", SESSION, 405, "method-not-allowed"),
        ("POST", "/", 405, "method-not-allowed"),
        ("GET", "/docs.html", 404, "not-found"),
        ("GET", f"/assets/{'x' * 300}.js", 404, "not-found"),
        ("GET", "/api/v1/drones/x", 401, "not-signed-in"),
    ],
)
async def test_every_error_is_a_problem_document(
    world: TowerWorld, method: str, path: str, status: int, slug: str
) -> None:
    assert_problem(await (await world.client()).request(method, path), status, slug)


@pytest.mark.parametrize("drone_id", ["0", "-1", "x", "99999999999999999999"])
async def test_an_impossible_id_is_named(world: TowerWorld, drone_id: str) -> None:
    admin = await world.signed_in("Root")
    document = assert_problem(await admin.get(f"/api/v1/drones/{drone_id}"), 422, "invalid-request")
    assert document["errors"][0]["in"] == "path"
    assert document["errors"][0]["field"] == "drone_id"


@pytest.mark.parametrize("body", [b"{", b'{"name": ', b"\xff\xfe", b"[1,", b"nul"])
async def test_malformed_json(world: TowerWorld, body: bytes) -> None:
    client = await world.client()
    answer = await client.post(SESSION, content=body, headers={"content-type": "application/json"})
    assert_problem(answer, 400, "malformed-json")


@pytest.mark.parametrize("body", [b"[]", b'"text"', b"null", b"7", b""])
async def test_json_that_is_no_object(world: TowerWorld, body: bytes) -> None:
    client = await world.client()
    answer = await client.post(SESSION, content=body, headers={"content-type": "application/json"})
    assert_problem(answer, 422, "invalid-request")


@pytest.mark.parametrize("media_type", ["text/plain", "application/x-www-form-urlencoded", ""])
async def test_only_json_is_taken(world: TowerWorld, media_type: str) -> None:
    client = await world.client()
    answer = await client.post(SESSION, content=json.dumps(SIGN_IN), headers={"content-type": media_type})
    assert_problem(answer, 415, "json-only")


@pytest.mark.parametrize("chunked", [False, True])
async def test_a_body_that_is_too_large(world: TowerWorld, chunked: bool) -> None:
    body = json.dumps({"name": "x" * 70_000, "password": "y"}).encode()

    async def in_pieces():
        for start in range(0, len(body), 8192):
            yield body[start : start + 8192]

    client = await world.client()
    headers = {"content-type": "application/json"}
    answer = await client.post(SESSION, content=in_pieces() if chunked else body, headers=headers)
    assert_problem(answer, 413, "too-large")


async def test_a_body_with_too_many_fields(world: TowerWorld) -> None:
    """Each unknown field is an error that is made on the event loop: 6,500 of them took 30 ms of every frame."""
    client = await world.signed_in(await world.add_user("Pia"))
    many = {f"k{number}": number for number in range(MAX_COLONS + 1)}
    problem = assert_problem(await client.post("/api/v1/teams", json=many), 413, "too-large")
    assert problem["detail"] == "the body has too many fields"
    some = {f"k{number}": number for number in range(MAX_COLONS // 2)}
    problem = assert_problem(await client.post("/api/v1/teams", json=some), 422, "invalid-request")
    assert len(problem["errors"]) == MAX_ERRORS


async def test_another_sites_request_is_refused(world: TowerWorld) -> None:
    client = await world.client()
    own = world.base_url
    for origin, status in (
        ("https://evil.example", 403),
        ("null", 403),
        (own.replace(str(httpx.URL(own).port), "1"), 403),
        (own, 200),
        (None, 200),
    ):
        headers = {"Origin": origin} if origin else {}
        answer = await client.post(SESSION, json=SIGN_IN, headers=headers)
        if status == 403:
            assert_problem(answer, 403, "wrong-origin")
            assert "set-cookie" not in answer.headers
        else:
            assert answer.status_code == 200


async def test_the_public_address_is_an_own_origin(tmp_path: Path) -> None:
    async with start_tower(tmp_path, public_url="https://tower.example") as world:
        await world.add_user("Root", Role.ADMIN)
        client = await world.client(headers={"Origin": "https://tower.example"})
        assert (await client.post(SESSION, json=SIGN_IN)).status_code == 200
        in_the_clear = await world.client(headers={"Origin": "http://tower.example"})
        assert_problem(await in_the_clear.post(SESSION, json=SIGN_IN), 403, "wrong-origin")


async def test_every_answer_carries_the_security_headers(world: TowerWorld) -> None:
    client = await world.client()
    for path in ("/", "/api/v1/me", "/api/v1/nothing", "/assets/app-1a2b3c.js"):
        headers = (await client.get(path)).headers
        assert "default-src 'self'" in headers["content-security-policy"]
        assert "frame-ancestors 'none'" in headers["content-security-policy"]
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["referrer-policy"] == "no-referrer"
        assert "server" not in headers
    assert (await client.get("/api/v1/me")).headers["cache-control"] == "no-store"


async def test_an_unexpected_error_tells_nothing(world: TowerWorld, monkeypatch: pytest.MonkeyPatch) -> None:
    async def broken(*_: object) -> None:
        raise RuntimeError("the inside of the tower")

    monkeypatch.setattr(world.tower.sessions, "find", broken)
    client = await world.client(cookies={"tower_session": "any"})
    answer = await client.get("/api/v1/me")
    assert_problem(answer, 500, "internal-error")
    assert "inside" not in answer.text
    assert "content-security-policy" in answer.headers


async def test_the_console_and_its_pages(world: TowerWorld) -> None:
    client = await world.client()
    answer = await client.get("/")
    assert answer.status_code == 200
    assert "console" in answer.text
    assert answer.headers["cache-control"] == "no-cache"
    for page in ("/control/7", "/sign-in"):
        answer = await client.get(page)
        assert (answer.status_code, answer.headers["location"]) == (303, "/"), "its files would not be found below it"
    asset = await client.get("/assets/app-1a2b3c.js")
    assert "immutable" in asset.headers["cache-control"]
    assert asset.headers["content-type"].startswith("text/javascript")
    assert_problem(await client.get("/assets/gone-000000.js"), 404, "not-found")


async def test_the_console_goes_out_compressed_and_only_once(world: TowerWorld, tmp_path: Path) -> None:
    script = tmp_path / "dist" / "assets" / "app-1a2b3c.js"
    script.with_name("app-1a2b3c.js.gz").write_bytes(gzip.compress(script.read_bytes()))
    client = await world.client()
    plain = await client.get("/assets/app-1a2b3c.js", headers={"Accept-Encoding": "identity"})
    packed = await client.get("/assets/app-1a2b3c.js", headers={"Accept-Encoding": "br, gzip"})
    assert "content-encoding" not in plain.headers
    assert packed.headers["content-encoding"] == "gzip"
    assert packed.headers["content-type"] == plain.headers["content-type"]
    assert packed.headers["vary"] == plain.headers["vary"] == "Accept-Encoding"
    assert packed.text == plain.text == "export {}"
    # A shared cache must never confuse the two.
    assert packed.headers["etag"] != plain.headers["etag"]

    page = await client.get("/")
    again = await client.get("/", headers={"If-None-Match": f'"old", W/{page.headers["etag"]}'})
    assert again.status_code == 304
    assert again.content == b""
    assert again.headers["etag"] == page.headers["etag"]
    assert (await client.get("/", headers={"If-None-Match": '"old"'})).status_code == 200


@pytest.mark.parametrize("path", ["/../secret.txt", "/%2e%2e/secret.txt", "/assets/..%2f..%2fsecret.txt", "/%00"])
async def test_nothing_outside_the_folder_is_served(world: TowerWorld, path: str) -> None:
    answer = await (await world.client()).get(httpx.URL(world.base_url).copy_with(raw_path=path.encode()))
    assert "not for you" not in answer.text


async def test_a_console_that_was_not_built_says_so(tmp_path: Path) -> None:
    async with start_tower(tmp_path) as world:
        answer = await (await world.client()).get("/")
        assert answer.status_code == 503
        assert "make setup" in answer.text


async def test_openapi_tells_of_every_route_and_its_problems(world: TowerWorld) -> None:
    schema = (await (await world.client()).get("/api/v1/openapi.json")).json()
    operations = [one for path in schema["paths"].values() for one in path.values()]
    names = [one["operationId"] for one in operations]
    assert len(names) == len(set(names))
    assert {"sign_in", "list_drones", "create_user", "acquire_control"} <= set(names)
    for one in operations:
        assert one["tags"]
        assert "default" not in one["responses"], "each status that can come is named"
        assert "application/problem+json" in one["responses"]["500"]["content"]
    assert "HTTPValidationError" not in schema["components"]["schemas"]
    assert "unknown-drone" in schema["paths"]["/api/v1/drones/{drone_id}"]["get"]["responses"]["404"]["description"]


async def test_a_port_in_use_is_named(tmp_path: Path) -> None:
    with listen("127.0.0.1", 0) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(CannotListen, match=rf"port {port} .*TOWER_PORT"):
            listen("127.0.0.1", port)


async def test_a_udp_port_in_use_is_named(world: TowerWorld, tmp_path: Path) -> None:
    second = tmp_path / "second"
    second.mkdir()
    with pytest.raises(CannotListen, match=rf"port {world.udp_port} .*TOWER_UDP_PORT"):
        async with start_tower(second, udp_port=world.udp_port):
            raise AssertionError("it must not start")


async def test_a_database_that_was_not_migrated_keeps_the_tower_from_starting(tmp_path: Path) -> None:
    with pytest.raises(DatabaseNotReady, match="tower migrate"):
        async with start_tower(tmp_path, database_url=f"sqlite+aiosqlite:///{tmp_path / 'var' / 'other.sqlite3'}"):
            raise AssertionError("it must not start")
