"""deploy/Caddyfile with a real Caddy before a real tower: TLS, HSTS, limits, the live channel, and an agent's link."""

import os
import re
import shutil
import ssl
import subprocess
import sys
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from websockets.sync.client import connect
from websockets.typing import Subprotocol
from worlds.free_ports import free_tcp_port, free_udp_ports
from worlds.processes import PASSWORD, World, wait_for

CADDYFILE = Path(__file__).parents[2] / "deploy" / "Caddyfile"


@dataclass
class Proxied:
    """A tower behind Caddy. `address`: by the proxy. `authority`: the certificate of Caddy's own authority."""

    world: World
    address: str
    plain_port: int
    authority: Path

    def open(self, path: str, **headers: str) -> tuple[int, list[tuple[str, str]], bytes]:
        request = urllib.request.Request(self.address + path, headers=headers)
        try:
            with urllib.request.urlopen(request, timeout=10, context=self.trust) as answer:
                return answer.status, answer.getheaders(), answer.read()
        except urllib.error.HTTPError as error:
            with error:
                return error.code, list(error.headers.items()), error.read()

    @property
    def trust(self) -> ssl.SSLContext:
        return ssl.create_default_context(cafile=str(self.authority))


@pytest.fixture
def proxied(tmp_path: Path, missing: Callable[[str], None], monkeypatch: pytest.MonkeyPatch) -> Iterator[Proxied]:
    program = shutil.which("caddy") or shutil.which("caddy", path=f"{sys.prefix}/programs/usr/bin")
    if program is None:
        missing("Caddy (Debian: apt-get install caddy)")
    assert program is not None
    port, plain_port, tower_port = free_tcp_port(), free_tcp_port(), free_tcp_port()
    text = CADDYFILE.read_text()
    for before, after in (
        ("{\n\tservers {", f"{{\n\tadmin off\n\tskip_install_trust\n\thttp_port {plain_port}\n\tservers {{"),
    ):
        assert text.count(before) == 1
        text = text.replace(before, after)
    changed = tmp_path / "Caddyfile"
    changed.write_text(text)
    monkeypatch.setenv("TOWER_PUBLIC_URL", f"https://localhost:{port}")
    monkeypatch.setenv("TOWER_TRUSTED_PROXIES", "127.0.0.1")
    state = tmp_path / "state"
    environment = {
        "PATH": os.defpath,
        "HOME": str(tmp_path),
        "XDG_DATA_HOME": str(state),
        "XDG_CONFIG_HOME": str(state),
        "TOWER_DOMAIN": f"localhost:{port}",
        "TOWER_ADDRESSES": f"127.0.0.1:{tower_port}",
    }
    world = World(tmp_path / "world", port=tower_port, udp_port=free_udp_ports(1)[0])
    with world, (tmp_path / "caddy.log").open("wb") as log:
        caddy = subprocess.Popen(
            [program, "run", "--config", str(changed), "--adapter", "caddyfile"],
            env=environment,
            cwd=tmp_path,
            stdout=log,
            stderr=subprocess.STDOUT,
        )
        try:
            one = Proxied(
                world, f"https://localhost:{port}", plain_port, state / "caddy/pki/authorities/local/root.crt"
            )

            def answers() -> bool:
                assert caddy.poll() is None, (tmp_path / "caddy.log").read_text()
                try:
                    return one.authority.exists() and bool(one.open("/")[0])
                except OSError:
                    return False

            wait_for("Caddy to answer", answers)
            yield one
        finally:
            caddy.terminate()
            caddy.wait(20)


def test_people_and_agents_come_through_the_proxy(proxied: Proxied, monkeypatch: pytest.MonkeyPatch) -> None:
    # Before there is a tower, the proxy answers by itself.
    status, headers, _ = proxied.open("/")
    assert status == 502
    assert _all(headers, "strict-transport-security") == ["max-age=31536000"]

    world = proxied.world
    world.start("tower", "tower", "serve")
    wait_for("the tower", lambda: proxied.open("/api/v1/health")[0] == 200)
    world.add_user("alice")
    status, headers, page = proxied.open("/")
    assert status == 200
    assert b"<script" in page
    assert _all(headers, "strict-transport-security") == ["max-age=31536000"]
    assert _all(headers, "server") == []
    assert proxied.open("/", **{"X-Long": "x" * 40_000})[0] == 431

    class NoRedirect(urllib.request.HTTPRedirectHandler):
        def redirect_request(self, *_: object) -> None:
            return None

    with pytest.raises(urllib.error.HTTPError) as plain:
        urllib.request.build_opener(NoRedirect).open(f"http://localhost:{proxied.plain_port}/", timeout=10)
    with plain.value as answer:
        assert answer.code == 308
        assert answer.headers["Location"].startswith("https://localhost")

    # The tower takes the proxy's word: it marks its cookie as one for TLS, and opens the live channel.
    body = f'{{"name": "alice", "password": "{PASSWORD}"}}'.encode()
    request = urllib.request.Request(
        f"{proxied.address}/api/v1/session", data=body, headers={"Content-Type": "application/json"}, method="POST"
    )
    with urllib.request.urlopen(request, timeout=10, context=proxied.trust) as signed_in:
        cookie = signed_in.headers["Set-Cookie"]
    assert "Secure" in cookie
    with connect(
        proxied.address.replace("https", "wss") + "/api/v1/live",
        ssl=proxied.trust,
        subprotocols=[Subprotocol("tower.v1")],
        origin=proxied.address,  # type: ignore[arg-type]
        additional_headers={"Cookie": cookie.split(";")[0]},
    ) as live:
        assert re.match(r'\{"type":"welcome"', str(live.recv(10)).replace(" ", ""))

    drone_id = world.add_drone("Kestrel", "alice")
    token = str(world.token_file("Kestrel"))
    monkeypatch.setenv("SSL_CERT_FILE", str(proxied.authority))
    world.start(
        *("agent", "tower-agent", "run", "--tower", proxied.address, "--token", token),
        *("--autopilot", "udpin:127.0.0.1:0"),
    )
    wait_for("the agent's link", lambda: "link up" in world.log_of("agent") or None)
    visitor = world.visitor("alice")
    wait_for("datagrams past the proxy", lambda: visitor.drone(drone_id)["online"] or None)


def _all(headers: list[tuple[str, str]], name: str) -> list[str]:
    return [value for key, value in headers if key.lower() == name]
