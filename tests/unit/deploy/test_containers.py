"""docker-compose.yml and the Dockerfiles, read: every container is locked in, pinned and keeps state in volumes, and
every step names files and packages that exist. Docker itself does not run in the tests."""

import ipaddress
import re
import shlex
import subprocess
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
import yaml

from server.runtime.settings import read_settings

CHECKOUT = Path(__file__).parents[3]
COMPOSE: dict[str, Any] = yaml.safe_load((CHECKOUT / "docker-compose.yml").read_text())
DOCKERFILES = sorted((CHECKOUT / "deploy").glob("Dockerfile.*"))
NATS = CHECKOUT / "deploy" / "nats.conf"
BUILT = {"web/dist"}


def steps(dockerfile: Path) -> list[tuple[str, str]]:
    text = re.sub(r"^#.*\n", "", dockerfile.read_text(), flags=re.MULTILINE).replace("\\\n", " ")
    return [(line.split(" ", 1)[0], line.split(" ", 1)[1].strip()) for line in text.splitlines() if line.strip()]


@pytest.mark.parametrize("name", COMPOSE["services"])
def test_a_container_is_locked_in(name: str) -> None:
    service = COMPOSE["services"][name]
    assert service["read_only"] is True
    assert service["cap_drop"] == ["ALL"]
    assert service["security_opt"] == ["no-new-privileges:true"]
    assert "privileged" not in service
    if "build" in service:
        users = [text for step, text in steps(CHECKOUT / service["build"]["dockerfile"]) if step == "USER"]
        assert users, "it would run as root"
        assert users[-1] not in {"root", "0"}
    else:
        assert service["user"] not in {"root", "0"}


def test_what_must_outlast_a_container_is_in_a_volume() -> None:
    for name, place in (
        ("tower", "/var/lib/control-tower"),
        ("second-tower", "/var/lib/control-tower"),
        ("agent", "/var/lib/tower-agent"),
        ("proxy", "/state"),
        ("database", "/var/lib/postgresql/data"),
    ):
        volumes = dict(reversed(one.split(":", 1)) for one in COMPOSE["services"][name]["volumes"])
        assert volumes[place] in COMPOSE["volumes"]
        if "build" in COMPOSE["services"][name]:  # or the volume would belong to root
            dockerfile = CHECKOUT / COMPOSE["services"][name]["build"]["dockerfile"]
            assert ("VOLUME", place) in steps(dockerfile)


def test_every_image_is_pinned_to_a_version() -> None:
    images = [one["image"] for one in COMPOSE["services"].values() if "image" in one]
    for dockerfile in DOCKERFILES:
        images += [text.split()[0] for step, text in steps(dockerfile) if step == "FROM"]
    for image in images:
        assert re.fullmatch(r"[a-z]+:\d+\.\d+(\.\d+)?-[a-z-]+", image), image


def test_secrets_must_be_given() -> None:
    text = (CHECKOUT / "docker-compose.yml").read_text()
    assert not re.findall(r"POSTGRES_PASSWORD(?!:\?)[:-]-?[a-z]", text)
    assert text.count("${POSTGRES_PASSWORD:?") == 2
    assert text.count("${BUS_PASSWORD:?") == 2
    assert "BUS_PASSWORD:-" not in text
    assert "password: $BUS_PASSWORD\n" in NATS.read_text()
    assert COMPOSE["services"]["bus"]["environment"]["BUS_PASSWORD"].startswith('"$'), "a number otherwise"


def test_the_settings_of_the_towers_are_accepted() -> None:
    for name in ("tower", "second-tower"):
        service = COMPOSE["services"][name]
        given = {
            key: re.sub(r"\$\{\w+:[?-][^}]*\}", "1e9", str(value)) for key, value in service["environment"].items()
        }
        settings = read_settings(given)
        bus = urlsplit(settings.bus_url)
        assert bus.hostname in COMPOSE["services"]
        assert bus.username == "tower"
        assert settings.bus_authority is not None
        mounted = {one.split(":")[1] for one in service["volumes"]}
        assert str(settings.bus_authority.parent) in mounted
        assert str(settings.secret_key_file.parent) in mounted | {str(settings.var)}
        assert service["ports"] == [f"{settings.udp_port}:{settings.udp_port}/udp"]


def test_the_bus_is_for_the_towers_alone_and_its_certificate_has_its_name() -> None:
    bus, maker = COMPOSE["services"]["bus"], COMPOSE["services"]["bus-certificate"]
    assert bus["networks"] == ["inside"]
    assert "ports" not in bus
    assert {"mem_limit", "pids_limit", "healthcheck"} <= set(bus)
    assert all(one.endswith(":ro") for one in bus["volumes"]), "it keeps no state"
    _, command, folder, *names = maker["command"]
    assert (command, names) == ("bus-certificate", ["bus"])
    assert bus["working_dir"] == folder
    assert maker["network_mode"] == "none"
    assert "./deploy/nats.conf:/etc/nats/control-tower.conf:ro" in bus["volumes"]
    assert bus["command"] == ["--config", "/etc/nats/control-tower.conf"]
    assert f"install --directory --owner=tower --group=tower {folder}" in [
        text for step, text in steps(CHECKOUT / "deploy" / "Dockerfile.tower") if step == "RUN"
    ]
    uid = next(text for step, text in steps(CHECKOUT / "deploy" / "Dockerfile.tower") if "useradd" in text)
    assert f"--uid {bus['user'].split(':')[0]} " in uid, "or it could not read the key"


def test_no_container_without_a_wish_takes_a_pinned_address() -> None:
    [pool] = COMPOSE["networks"]["inside"]["ipam"]["config"]
    free = ipaddress.ip_network(pool["ip_range"])
    assert free.subnet_of(ipaddress.ip_network(pool["subnet"]))
    pinned = [
        ipaddress.ip_address(one["networks"]["inside"]["ipv4_address"])
        for one in COMPOSE["services"].values()
        if isinstance(one.get("networks"), dict)
    ]
    assert len(pinned) == len(set(pinned)) == 2
    for address in pinned:
        assert address in ipaddress.ip_network(pool["subnet"])
        assert address not in free


def test_whoever_is_waited_for_has_a_health_check() -> None:
    for service in COMPOSE["services"].values():
        for name, wanted in service.get("depends_on", {}).items():
            check = COMPOSE["services"][name].get("healthcheck", {})
            assert wanted["condition"] != "service_healthy" or check.get("test"), name


def test_the_simulated_drone_starts_only_when_asked_for() -> None:
    profiles = {name: one.get("profiles") for name, one in COMPOSE["services"].items()}
    assert {name for name, one in profiles.items() if one == ["sim"]} == {"simulator", "agent"}
    assert all(profiles[name] is None for name in ("tower", "database", "bus", "bus-certificate", "proxy"))
    assert profiles["second-tower"] == ["several"]


def test_the_agent_may_open_serial_ports_and_cameras() -> None:
    run = " ".join(text for step, text in steps(CHECKOUT / "deploy" / "Dockerfile.agent") if step == "RUN")
    assert "--groups dialout,video" in run


@pytest.mark.parametrize("dockerfile", DOCKERFILES, ids=lambda one: one.suffix)
def test_every_file_that_a_step_copies_exists(dockerfile: Path) -> None:
    stages = {words[3] for step, text in steps(dockerfile) if step == "FROM" and len(words := ["", *text.split()]) > 3}
    for step, text in steps(dockerfile):
        if step != "COPY":
            continue
        words = shlex.split(text)
        if words[0].startswith("--from="):
            assert words[0].removeprefix("--from=") in stages
            continue
        for source in words[:-1]:
            assert (CHECKOUT / source).exists(), source
            tracked = subprocess.run(
                ["git", "ls-files", "--", source], cwd=CHECKOUT, capture_output=True, text=True, check=True
            )
            assert tracked.stdout, f"{source} is not in a fresh clone"


def test_what_an_image_installs_is_what_its_project_needs() -> None:
    """Each image takes a lock file of its own project, by hashes, and then the wheel without dependencies."""
    for name, lock in (("tower", "tower.txt"), ("agent", "agent-video.txt")):
        runs = [text for step, text in steps(CHECKOUT / "deploy" / f"Dockerfile.{name}") if step == "RUN"]
        assert f"pip install --require-hashes -r /tmp/{lock}" in runs
        assert "pip install --no-deps /tmp/dist/*.whl" in runs
