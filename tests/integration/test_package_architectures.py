"""The agent's packages for every system and architecture hold binaries of that architecture and that Python alone."""

from __future__ import annotations

import struct
from pathlib import Path

import pytest
from packages.debian import AGENT, AGENT_VIDEO, Package
from packages.repository import SYSTEMS, System
from release import filler

pytestmark = pytest.mark.long("fetches the wheels of other machines")

MACHINES = {"amd64": 62, "arm64": 183}
"""e_machine of ELF: x86-64 and AArch64."""


@pytest.mark.parametrize("package", [AGENT, AGENT_VIDEO], ids=["agent", "video"])
@pytest.mark.parametrize("architecture", MACHINES)
@pytest.mark.parametrize("system", SYSTEMS, ids=lambda one: one.codename)
def test_binaries_are_of_the_architecture(system: System, architecture: str, package: Package, tmp_path: Path) -> None:
    site = tmp_path / "site"
    site.mkdir()
    filler(package, None, architecture, system, tmp_path)(site)
    binaries = [path for path in site.rglob("*.so*") if path.is_file()]
    assert len(binaries) > 3
    for binary in binaries:
        head = binary.read_bytes()[:20]
        assert head[:4] == b"\x7fELF", binary
        assert struct.unpack_from("<H", head, 18)[0] == MACHINES[architecture], binary
        # One for the stable interface (abi3) fits every Python.
        if ".cpython-" in binary.name:
            assert f".cpython-{system.python.replace('.', '')}-" in binary.name, binary
