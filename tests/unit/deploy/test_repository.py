"""apt takes packages from the repository of a release, and refuses what its key did not sign."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from packages.debian import AGENT, build_deb
from packages.repository import PUBLIC_KEY, SYSTEMS, System, make_repository
from release import entries_for

MADE_AT_S = 1_790_000_000
BOOKWORM = SYSTEMS[0]


@pytest.fixture
def architecture(missing: Callable[[str], None]) -> str:
    for program in ("dpkg-deb", "apt-get", "gpg"):
        if shutil.which(program) is None:
            missing(program)
    return answer("dpkg", "--print-architecture").strip()


@pytest.fixture
def repository(tmp_path: Path, architecture: str) -> Path:
    folder = tmp_path / "repository"
    folder.mkdir()
    for system in SYSTEMS:
        build_deb(
            AGENT,
            version="1.2.3",
            architecture=architecture,
            python=system.python,
            mark=system.mark,
            fill=lambda site: None,
            work=tmp_path / "work",
            out=folder,
            compression="none",
        )
    make_repository(folder, made_at_s=MADE_AT_S, secret_key=new_key(tmp_path))
    return folder


def new_key(folder: Path) -> Path:
    home = folder / "gpg"
    home.mkdir(mode=0o700)
    gpg = ("gpg", "--homedir", str(home), "--batch", "--quiet", "--passphrase", "", "--pinentry-mode", "loopback")
    try:
        answer(*gpg, "--quick-generate-key", "release@example.org", "ed25519", "sign", "never")
        key = folder / "release.key"
        key.write_text(answer(*gpg, "--armor", "--export-secret-keys"))
    finally:
        subprocess.run(("gpgconf", "--homedir", str(home), "--kill", "all"), check=False)
    return key


def answer(*command: str) -> str:
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


class Apt:
    """apt-get with lists and settings of its own."""

    def __init__(self, folder: Path, repository: Path, codename: str) -> None:
        self.folder = folder
        for part in ("state/lists/partial", "cache/archives/partial", "etc"):
            (folder / part).mkdir(parents=True)
        key = folder / "key.asc"
        shutil.copy(repository / PUBLIC_KEY, key)
        (folder / "sources.list").write_text(f"deb [signed-by={key}] file:{repository} {codename} main\n")
        (folder / "state" / "status").touch()

    def __call__(self, *words: str) -> subprocess.CompletedProcess[str]:
        options = {
            "Dir::State": self.folder / "state",
            "Dir::State::status": self.folder / "state" / "status",
            "Dir::Cache": self.folder / "cache",
            "Dir::Etc": self.folder / "etc",
            "Dir::Etc::sourcelist": self.folder / "sources.list",
            "APT::Sandbox::User": "",
        }
        given = [word for name, value in options.items() for word in ("-o", f"{name}={value}")]
        environment = {"PATH": os.environ["PATH"], "LANG": "C.UTF-8"}
        command = ["apt-get", *given, *words]
        return subprocess.run(command, capture_output=True, text=True, cwd=self.folder, env=environment, check=False)


@pytest.mark.parametrize("system", SYSTEMS, ids=lambda one: one.codename)
def test_each_system_gets_its_own_package(tmp_path: Path, repository: Path, system: System) -> None:
    apt = Apt(tmp_path / "apt", repository, system.codename)
    updated = apt("update")
    assert updated.returncode == 0, updated.stdout + updated.stderr
    assert "W:" not in updated.stderr
    got = apt("download", AGENT.name)
    assert got.returncode == 0, got.stdout + got.stderr
    [deb] = apt.folder.glob("*.deb")
    assert f"%2b{system.mark}_" in deb.name.lower() or f"+{system.mark}_" in deb.name
    minor = int(system.python.split(".")[1])
    needs = answer("dpkg-deb", "--field", str(deb), "Depends")
    assert needs.startswith(f"python3 (>= 3.{minor}), python3 (<< 3.{minor + 1})")


def test_a_changed_list_and_a_changed_package_are_refused(tmp_path: Path, repository: Path) -> None:
    apt = Apt(tmp_path / "apt", repository, BOOKWORM.codename)
    assert apt("update").returncode == 0
    [deb] = repository.glob(f"*+{BOOKWORM.mark}_*.deb")
    whole = deb.read_bytes()
    deb.write_bytes(whole[:-1] + bytes([whole[-1] ^ 1]))
    assert apt("download", AGENT.name).returncode != 0

    release = repository / "dists" / BOOKWORM.codename / "InRelease"
    release.write_text(release.read_text().replace("Label: Control Tower", "Label: Control Towre"))
    other = Apt(tmp_path / "other", repository, BOOKWORM.codename)
    refused = other("update")
    assert "is not signed" in refused.stderr or "signatures were invalid" in refused.stderr


def test_a_release_is_the_same_whenever_it_is_made(tmp_path: Path, repository: Path) -> None:
    lists = repository / "dists" / BOOKWORM.codename / "Release"
    before = lists.read_text()
    make_repository(repository, made_at_s=MADE_AT_S, secret_key=None)
    assert lists.read_text() == before


def test_a_lock_files_conditions_are_those_of_the_target(tmp_path: Path) -> None:
    lock = tmp_path / "lock.txt"
    lock.write_text(
        "always==1 \\\n    --hash=sha256:aa\n"
        "old==1 ; python_full_version < '3.12' \\\n    --hash=sha256:bb\n"
        "new==2 ; python_full_version >= '3.12' \\\n    --hash=sha256:cc\n"
        "big==3 ; platform_machine != 'armv7l' and sys_platform != 'win32' \\\n    --hash=sha256:dd\n"
    )

    def names(python: str, machine: str) -> list[str]:
        return [entry.split("==")[0] for entry in entries_for(lock, python, machine)]

    assert names("3.11", "x86_64") == ["always", "old", "big"]
    assert names("3.13", "aarch64") == ["always", "new", "big"]
    assert names("3.13", "armv7l") == ["always", "new"]
    assert entries_for(lock, "3.13", "armv7l")[1] == "new==2 \\\n    --hash=sha256:cc"
