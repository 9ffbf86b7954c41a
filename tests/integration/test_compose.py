"""docker-compose.yml, built and started as the documents say: sign-in, simulated drone, deaths, a restored backup."""

from __future__ import annotations

import re
import shutil
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from containers import Compose, lacking
from test_bare_roots import mirror

pytestmark = pytest.mark.long("builds the images and starts the whole compose file")

UP_S = 120.0
ARCHIVE = "/var/lib/control-tower/before.tar"


def eventually(what: str, condition: Callable[[], object], patience_s: float = UP_S) -> float:
    began = time.monotonic()
    while not condition():
        assert time.monotonic() < began + patience_s, f"not within {patience_s} s: {what}"
        time.sleep(0.5)
    return time.monotonic() - began


@pytest.fixture
def compose(tmp_path: Path, missing: Callable[[str], None]) -> Iterator[Compose]:
    if lacks := lacking():
        missing(lacks)
    compose = Compose(tmp_path, {"POSTGRES_PASSWORD": "d1ce" * 6, "BUS_PASSWORD": "8e71c0ffee"})
    try:
        yield compose
    finally:
        compose.close()


def is_ready(compose: Compose) -> bool:
    answer = compose.ask("GET", "/health/ready")
    return answer is not None and answer["status"] == "ok"


def is_online(compose: Compose) -> bool:
    drones = compose.ask("GET", "/drones")
    return drones is not None and [one["online"] for one in drones] == [True]


def sign_in(compose: Compose, password: str) -> None:
    eventually("the sign-in", lambda: compose.ask("POST", "/session", {"name": "ada", "password": password}))


def test_the_compose_file_is_a_tower(compose: Compose, tmp_path: Path) -> None:
    began = time.monotonic()
    compose.build(mirror())
    print(f"built after {time.monotonic() - began:.0f} s")

    compose.up()
    print(f"ready {eventually('the tower', lambda: is_ready(compose)):.0f} s after compose was done")
    first = re.search(r"The first user is (\w+) with the password (\S+),", compose.run("logs", "tower"))
    assert first is not None
    said = compose.ask("POST", "/session", {"name": first[1], "password": first[2]})
    assert said["must_change_password"] is True
    added = compose.run("exec", "-T", "tower", "tower", "user", "add", "ada", "--role", "admin", "--for-good")
    password = added.split("password: ")[1].split()[0]

    compose.run(
        "exec", "-T", "tower", "tower", "drone", "add", "Kestrel", "--owner", "ada", "--token-file", "/tmp/token"
    )
    token = compose.run("exec", "-T", "tower", "cat", "/tmp/token").strip()
    with (compose.checkout / ".env").open("a") as settings:
        settings.write(f"SIM_TOKEN={token}\n")
    compose.up("simulator", "agent", profile="sim")
    sign_in(compose, password)
    print(f"the simulated drone is online after {eventually('the drone', lambda: is_online(compose)):.0f} s")

    for service in ("bus", "database", "proxy", "tower"):
        compose.kill(service)
        if service == "tower":
            compose.run("--profile=sim", "restart", "simulator", "agent")
        after_s = eventually(f"everything after the end of {service}", lambda: is_ready(compose) and is_online(compose))
        print(f"{service} killed: all is well after {after_s:.0f} s")

    compose.run("exec", "-T", "tower", "tower", "backup", ARCHIVE)
    archive = compose.checkout / "tower.tar"
    compose.podman("cp", f"control-tower_tower_1:{ARCHIVE}", str(archive))
    shutil.chown(archive, 10001, 10001)
    compose.run("--profile=sim", "down")
    compose.podman("volume", "rm", "control-tower_tower-data", "control-tower_database-data")
    compose.up("database", "bus")
    restore = ("tower", "tower", "restore", "/backup/tower.tar")
    mount = f"{archive}:/backup/tower.tar:ro"
    eventually("the database", lambda: "accepting" in compose.run("exec", "-T", "database", "pg_isready"))
    said = compose.run("run", "--rm", "--no-deps", "-T", "-v", mount, *restore)
    assert "restored the backup" in said
    compose.up("tower", "proxy")
    eventually("the restored tower", lambda: is_ready(compose))
    sign_in(compose, password)
    assert [one["name"] for one in compose.ask("GET", "/drones")] == ["Kestrel"]
    compose.up("simulator", "agent", profile="sim")
    eventually("the drone, enrolled as before", lambda: is_online(compose))
