"""The compose file of a checkout on podman: its own images, volumes and network namespace, nothing of this machine's.

Debian's packages stand in for the pinned images: on Debian 12 Python 3.11.2, PostgreSQL 15, NATS 2.9, Caddy 2.6, and
this machine's Node. Health is asked from outside, because podman without systemd runs no health checks.
"""

from __future__ import annotations

import json
import os
import re
import resource
import shutil
import subprocess
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from worlds.processes import CHECKOUT

IMAGES: Final = Path(__file__).parent / "compose_images"
NEEDS: Final = (
    "podman",
    "podman-compose",
    "netavark",
    "iptables",
    "mmdebstrap",
    "nsenter",
    "ip",
    "curl",
    "node",
    "npm",
)
HOW: Final = "apt-get install podman netavark aardvark-dns runc iptables mmdebstrap; pip install podman-compose"
ROOT: Final = "COMPOSE_ROOT"
"""An archive with the Debian root, made before."""
PACKAGES: Final = "ca-certificates,python3,python3-pip,wget,openssl,postgresql,nats-server,caddy"
BUILD_S: Final = 1800.0
STEP_S: Final = 180.0
_AUTHORITIES: Final = Path("/etc/ssl/certs/ca-certificates.crt")
_AUTHORITY: Final = "/state/data/caddy/pki/authorities/local/root.crt"


def lacking() -> str:
    """What this machine lacks, and how to get it; empty if nothing."""
    if os.geteuid() != 0:
        return "root"
    for program in NEEDS:
        if shutil.which(program) is None and not Path("/usr/lib/podman", program).exists():
            return f"{program} ({HOW})"
    return ""


class Compose:
    """`folder` holds everything. Call `build`, then `run`; `close` ends what was started and removes it."""

    def __init__(self, folder: Path, settings: Mapping[str, str]) -> None:
        self.folder = folder
        self.checkout = folder / "checkout"
        self._space = f"compose-{os.getpid()}"
        self._jar = folder / "cookies"
        self._authority = folder / "authority.pem"
        (folder / "storage").mkdir(parents=True)
        subprocess.run(["git", "clone", "-q", str(CHECKOUT), str(self.checkout)], check=True)
        (self.checkout / ".env").write_text("".join(f"{name}={value}\n" for name, value in settings.items()))
        self._environment = os.environ | self._own_podman()
        subprocess.run(["ip", "netns", "add", self._space], check=True)
        self._inside("ip", "link", "set", "lo", "up")

    def _own_podman(self) -> dict[str, str]:
        # A container may not raise a limit that this machine has set.
        limits = {"nofile": resource.RLIMIT_NOFILE, "nproc": resource.RLIMIT_NPROC}
        ulimits = [f"{name}={n}:{n}" for name, what in limits.items() if (n := min(4096, *resource.getrlimit(what)))]
        runtime = "runc" if shutil.which("runc") else "crun"
        config, storage = self.folder / "containers.conf", self.folder / "storage.conf"
        config.write_text(
            f"[containers]\ndefault_ulimits={json.dumps(ulimits)}\n[engine]\nruntime={json.dumps(runtime)}\n"
            f"[network]\nnetwork_config_dir={json.dumps(str(self.folder / 'networks'))}\n"
        )
        storage.write_text(
            '[storage]\ndriver="overlay"\n'
            f"graphroot={json.dumps(str(self.folder / 'storage'))}\nrunroot={json.dumps(str(self.folder / 'run'))}\n"
        )
        return {"CONTAINERS_CONF": str(config), "CONTAINERS_STORAGE_CONF": str(storage)}

    def _call(self, *command: str, within_s: float = STEP_S, cwd: Path | None = None) -> str:
        done = subprocess.run(
            command, env=self._environment, cwd=cwd, capture_output=True, text=True, timeout=within_s, check=False
        )
        assert done.returncode == 0, f"{' '.join(command)}\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
        return done.stdout

    def _inside(self, *command: str, within_s: float = STEP_S) -> str:
        space = f"--net=/run/netns/{self._space}"
        return self._call("nsenter", space, *command, within_s=within_s, cwd=self.checkout)

    def build(self, mirror: str) -> None:
        """Makes the stand-ins, then builds what the compose file builds, one image after the other."""
        context = self.folder / "images"
        shutil.copytree(IMAGES, context)
        archive = os.environ.get(ROOT)
        if archive is None:
            archive = str(self.folder / "root.tar")
            make = ["mmdebstrap", "--quiet", "--variant=minbase", f"--include={PACKAGES}", "bookworm", archive, mirror]
            self._call(*make, within_s=BUILD_S)
        self._call("podman", "import", "-q", archive, "localhost/debian-root", within_s=BUILD_S)
        shutil.copy(_AUTHORITIES, context / "authorities.pem")
        for name, source in (("pip.conf", Path("/etc/pip.conf")), ("npmrc", Path.home() / ".npmrc")):
            (context / name).write_text(source.read_text() if source.exists() else "")
        node = Path(shutil.which("node") or "")
        shutil.copy(node.resolve(), context / "node")
        shutil.copytree(node.resolve().parents[1] / "lib" / "node_modules" / "npm", context / "npm")
        for image in self._pinned():
            stage = image.split(":", maxsplit=1)[0]
            tag = f"docker.io/library/{image}"
            self._call(
                *("podman", "build", "-q", "--network=host", "--target", stage, "-t", tag, str(context)),
                within_s=BUILD_S,
            )
        for service in ("tower", "bus-certificate", "proxy", "second-tower", "simulator", "agent"):
            options = ("--podman-build-args=--network=host", "--profile=sim", "--profile=several", "build", service)
            self._call("podman-compose", *options, within_s=BUILD_S, cwd=self.checkout)

    def _pinned(self) -> set[str]:
        files = [self.checkout / "docker-compose.yml", *(self.checkout / "deploy").glob("Dockerfile.*")]
        found = (re.findall(r"^(?: +image: |FROM )(\S+)", file.read_text(), re.MULTILINE) for file in files)
        return {image for images in found for image in images}

    def run(self, *words: str, within_s: float = STEP_S) -> str:
        """podman-compose, as `docker compose` in the documents."""
        return self._inside("podman-compose", *words, within_s=within_s)

    def up(self, *services: str, profile: str = "") -> None:
        self.run(*([f"--profile={profile}"] if profile else []), "up", "-d", "--no-build", *services)

    def podman(self, *words: str) -> str:
        return self._inside("podman", *words)

    def kill(self, service: str) -> None:
        """kill -9 of its first process, and a new start: what `restart: always` does."""
        container = f"control-tower_{service}_1"
        self._call("kill", "-9", self.podman("inspect", "-f", "{{.State.Pid}}", container).strip())
        self.podman("wait", container)
        if self.podman("inspect", "-f", "{{.State.Running}}", container).strip() != "true":
            self.podman("start", container)

    def ask(self, method: str, path: str, body: Any = None) -> Any:
        """Asks the public address, and believes only the authority of its proxy. None: no answer, or a refusal."""
        if not self._authority.exists():
            self.podman("cp", f"control-tower_proxy_1:{_AUTHORITY}", str(self._authority))
        data = [] if body is None else ["-H", "Content-Type: application/json", "-d", json.dumps(body)]
        command = ["curl", "-sS", "-f", "-m", "5", "--cacert", str(self._authority), "-b", str(self._jar)]
        try:
            answer = self._inside(
                *command, "-c", str(self._jar), "-H", "Origin: https://localhost", "-X", method, *data,
                f"https://localhost/api/v1{path}",
            )  # fmt: skip
        except AssertionError:
            return None
        return json.loads(answer) if answer else {}

    def forget_authority(self) -> None:
        """A proxy with a new volume makes a new one."""
        self._authority.unlink(missing_ok=True)

    def close(self) -> None:
        try:
            self.run("--profile=sim", "--profile=several", "down", "-v")
        finally:
            self._call("ip", "netns", "delete", self._space)
            self._call("podman", "system", "reset", "--force", within_s=600)
