"""A whole day in small, with real programs. Then all output is searched for every secret of the day.

Includes forced tracebacks, because they often leak secrets.
"""

import base64
import re
import sqlite3
from base64 import urlsafe_b64encode
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from urllib.parse import quote

import httpx
import pyotp
import pytest
from worlds.processes import PASSWORD, World, free_udp_ports, wait_for

from onboard_agent.link.identity_file import read_identity
from wire.drone_key import DroneKey, enrolment_statement, key_text
from wire.ids import DroneId

METRICS_SECRET = "metrics-0f8c2d7a41b6e95d3c"
WRONG = "wrong horse/battery+staple"
NEW_PASSWORD = "another horse & battery"
TOWER = "/api/v1"


def spellings(secret: str) -> set[str]:
    """Returns the forms of a secret in a text: as it is, in a URL, in JSON, in base64 at any offset."""
    found = {secret, quote(secret), quote(secret, safe=""), secret.replace("&", "\\u0026")}
    raw = secret.encode()
    for before in range(3):
        # The characters at both ends depend on their neighbours.
        coded = base64.b64encode(b"\0" * before + raw).decode().rstrip("=")
        inner = coded[(0, 2, 3)[before] : len(coded) - 1]
        found |= {inner, inner.replace("+", "-").replace("/", "_")}
    return found


@dataclass
class Day:
    """Secrets that must never be written, by what they are."""

    secrets: dict[str, str] = field(default_factory=dict)
    codes: dict[str, str] = field(default_factory=dict)
    """Six-digit codes. Matched only as whole numbers, because the microseconds of a timestamp have six digits too."""

    def found_in(self, text: str) -> set[str]:
        names = {name for name, secret in self.secrets.items() if any(one in text for one in spellings(secret))}
        return names | {name for name, code in self.codes.items() if re.search(rf"(?<![\d.]){code}(?!\d)", text)}


class LoudWorld(World):
    """Logs for people, including tracebacks."""

    log_format = "human"

    @property
    def environment(self) -> dict[str, str]:
        reported = {"TOWER_LOG_FORMAT": self.log_format, "TOWER_METRICS_TOKEN": METRICS_SECRET}
        return super().environment | reported | {"TOWER_AGENT_LOG_LEVEL": "debug"}


@pytest.fixture
def world(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[LoudWorld]:
    with LoudWorld(tmp_path) as world:
        world.log_format = request.param
        world.add_user("alice")
        world.add_user("ben")
        world.add_user("root", "admin")
        world.start_tower()
        yield world


def client(world: World, **headers: str) -> httpx.Client:
    return httpx.Client(base_url=world.address, trust_env=False, timeout=30, headers=headers)


def sign_in(day: Day, browser: httpx.Client, name: str, password: str = PASSWORD, **code: str) -> httpx.Response:
    answer = browser.post(f"{TOWER}/session", json={"name": name, "password": password, **code})
    if answer.status_code == 200:
        day.secrets[f"cookie {len(day.secrets)} of {name}"] = browser.cookies["tower_session"]
    return answer


def enrol_and_fly(day: Day, world: World, root: httpx.Client) -> None:
    """Enrols a drone and its agent at the most verbose level, and flies."""
    drone = root.post(f"{TOWER}/drones", json={"name": "Kestrel"}).json()
    number = drone["drone"]["id"]
    alice = next(one["id"] for one in root.get(f"{TOWER}/users").json() if one["name"] == "alice")
    assert root.put(f"{TOWER}/drones/{number}/owners/{alice}").status_code == 200
    begun = root.post(f"{TOWER}/drones/{number}/enrolments", json={}).json()
    day.secrets["enrolment token"] = begun["token"]
    port = free_udp_ports(1)[0]
    kept = world.folder / "kestrel.token"
    words = ("enrol", world.address, begun["token"], "--token", str(kept), "--autopilot", f"udpin:127.0.0.1:{port}")
    world.start("agent", "tower-agent", *words)
    world.start("simulator", "tower-sim", "--home", "47.3977,8.5456,488,0", "--out", f"udp:127.0.0.1:{port}")
    wait_for("the drone", lambda: root.get(f"{TOWER}/drones/{number}").json()["online"])
    day.secrets["key"] = str(read_identity(kept).key)
    another = DroneKey(DroneId(1), b"x" * 32)
    signature = another.sign(enrolment_statement(begun["token"], another.public))
    asked = {
        "token": begun["token"],
        "public_key": key_text(another.public),
        "signature": urlsafe_b64encode(signature).decode().rstrip("="),
    }
    assert root.post(f"{TOWER}/enrol", json=asked).status_code == 403, "it was used"


def second_factor(day: Day, world: World, alice: httpx.Client) -> None:
    begun = alice.post(f"{TOWER}/me/second-factor").json()
    day.secrets["authenticator"] = begun["secret"]
    day.codes["code"] = pyotp.TOTP(begun["secret"]).now()
    confirmed = alice.post(f"{TOWER}/me/second-factor/confirm", json={"code": day.codes["code"]})
    assert confirmed.status_code == 200, confirmed.text
    recovery = confirmed.json()["recovery_codes"]
    day.secrets |= {f"recovery code {number}": code for number, code in enumerate(recovery)}
    with client(world) as other:
        assert sign_in(day, other, "alice", code="wrong-code-typed").status_code == 401
        day.secrets["wrong code"] = "wrong-code-typed"
        assert sign_in(day, other, "alice", code=recovery[0]).status_code == 200
        assert sign_in(day, other, "alice", code=recovery[0]).status_code == 401


def connect(day: Day, world: World, alice: httpx.Client) -> None:
    asked = {"name": "GCS", "scopes": ["watch", "fly"]}
    day.secrets["API token"] = token = alice.post(f"{TOWER}/tokens", json=asked).json()["secret"]
    with client(world, Authorization=f"Bearer {token}") as program:
        assert program.get(f"{TOWER}/drones").status_code == 200
    (world.folder / "gcs.token").write_text(token)
    where = ("--tower", world.address, "--token-file", str(world.folder / "gcs.token"))
    world.start("connect", "tower", "connect", "Kestrel", *where, "--tcp", "127.0.0.1:0")
    wait_for("tower connect", lambda: "Kestrel is at" in world.log_of("connect"))


def force_traces(day: Day, world: World, alice: httpx.Client) -> None:
    """An exception during a sign-in with password and code, one in a statement, and bad input of all kinds."""
    with sqlite3.connect(world.folder / "tower.sqlite3") as database:
        # Ben's account gets Alice's sealed secret, which does not decrypt for him.
        database.execute(
            "UPDATE users SET totp_sealed = (SELECT totp_sealed FROM users WHERE name = 'alice') WHERE name = 'ben'"
        )
    day.codes["code at the wrong moment"] = "418297"
    with client(world) as browser:
        assert sign_in(day, browser, "ben", code=day.codes["code at the wrong moment"]).status_code == 500
        for body in (f'{{"password": "{WRONG}"', f'["{WRONG}"]', f'{{"name": ["{WRONG}"], "password": 7}}'):
            asked = browser.post(f"{TOWER}/session", content=body, headers={"content-type": "application/json"})
            assert asked.status_code in (400, 422)
        for secret in (day.secrets["API token"], day.secrets["key"]):
            assert browser.get(f"{TOWER}/me?token={quote(secret)}").status_code == 401
            assert browser.get(f"{TOWER}/live", headers={"Authorization": f"Bearer {secret}"}).status_code == 404
            assert browser.get(f"{TOWER}/drones", headers={"Authorization": f"Bearer x{secret}"}).status_code == 401
    with sqlite3.connect(world.folder / "tower.sqlite3") as database:
        database.execute("ALTER TABLE recovery_codes RENAME TO put_away")
    spent = {"password": PASSWORD, "code": day.secrets["recovery code 1"]}
    assert alice.post(f"{TOWER}/session/proof", json=spent).status_code == 503
    with sqlite3.connect(world.folder / "tower.sqlite3") as database:
        database.execute("ALTER TABLE put_away RENAME TO recovery_codes")


def everything_written(world: World, root: httpx.Client) -> dict[str, str]:
    written = {file.name: file.read_text(errors="replace") for file in world.folder.glob("*.log")}
    for path in (
        "audit?limit=500",
        "audit.csv",
        "system",
        "online",
        "sessions?everybody=true",
        "tokens?everybody=true",
    ):
        answer = root.get(f"{TOWER}/{path}")
        assert answer.status_code == 200, (path, answer.text)
        written[path] = answer.text
    with client(world, Authorization=f"Bearer {METRICS_SECRET}") as prometheus:
        written["metrics"] = prometheus.get("/metrics").text
    return written


@pytest.mark.parametrize("world", ["human", "json"], indirect=True)
def test_no_secret_of_a_day_is_written_anywhere(world: LoudWorld) -> None:
    day = Day({"password": PASSWORD, "wrong password": WRONG, "new password": NEW_PASSWORD, "metrics": METRICS_SECRET})
    day.secrets["key of the vault"] = (world.folder / "secret.key").read_text().strip()
    with client(world) as root, client(world) as alice:
        assert sign_in(day, root, "root", WRONG).status_code == 401
        assert sign_in(day, root, "root").status_code == 200
        assert sign_in(day, alice, "alice").status_code == 200
        enrol_and_fly(day, world, root)
        second_factor(day, world, alice)
        connect(day, world, alice)
        force_traces(day, world, alice)
        changed = alice.post(f"{TOWER}/me/password", json={"old_password": PASSWORD, "new_password": NEW_PASSWORD})
        assert changed.status_code == 200, changed.text
        day.secrets["cookie after the new password"] = alice.cookies["tower_session"]
        written = everything_written(world, root)
        leaks = {name: found for name, text in written.items() if (found := day.found_in(text))}
        assert leaks == {}
        # The day has left tracebacks, so there was something to search ...
        traces = [written["tower-1.log"].count(what) for what in ("unexpected_error", "database_unavailable")]
        assert traces == [1, 1]
        assert {"agent.log", "connect.log", "simulator.log"} <= set(written)
        assert "link up" in written["agent.log"]
        assert "session.refused" in written["audit.csv"]
        # ... and the search finds a written secret: here one mistakenly used as a drone's name.
        named = root.patch(f"{TOWER}/drones/1", json={"name": day.secrets["API token"]})
        assert named.status_code == 200
        assert day.found_in(everything_written(world, root)["audit.csv"]) == {"API token"}


@pytest.mark.parametrize("wrap", ["{}", "x{}", "xy{}", "xyz{}:"])
def test_every_spelling_of_a_secret_is_found(wrap: str) -> None:
    day = Day({"secret": "Ab+/9 &horse_battery"}, {"code": "123456"})
    text = wrap.format(day.secrets["secret"])
    assert day.found_in(text) == {"secret"}
    assert day.found_in(quote(text)) == {"secret"}
    assert day.found_in(base64.b64encode(text.encode()).decode()) == {"secret"}
    assert day.found_in(base64.urlsafe_b64encode(text.encode()).decode()) == {"secret"}
    assert day.found_in('{"code": "123456"}') == {"code"}
    assert day.found_in("2026-11-21T12:00:00.123456Z") == set()
