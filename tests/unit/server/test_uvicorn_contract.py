"""The internals of uvicorn and websockets that the tower relies on. A new version fails here first.

If it does: read server/link/api/websocket/ against the new sources, run tests/attacks and the hostile clients, then
put the new versions into pyproject.toml and the new digests here.
"""

import hashlib
import inspect
import tomllib
from importlib.metadata import version
from pathlib import Path
from types import ModuleType

import pytest
from uvicorn.protocols.http import httptools_impl
from uvicorn.protocols.websockets import websockets_sansio_impl
from websockets import protocol, server

PYPROJECT = Path(__file__).parents[3] / "pyproject.toml"
VERSIONS = {"uvicorn": "0.54.0", "websockets": "17.4"}
DIGESTS = {
    httptools_impl: "1d4e1c579df4168433a61a01f10c628b31c1790e72dd9769d2b8633b22214033",
    websockets_sansio_impl: "8b32a97a1608788bba525c8b1e0d3eb0a93cd09d0f4f41b9b83cebd527336c49",
    protocol: "356dcca7cf7a459bccc7c6bfda3a67135eff3c609506b6cd137cf32f4f8cbc5e",
    server: "ee41092f540414ef294c1f74c0fe1f51b9336060dc6e44daee34ef762499b509",
}


@pytest.mark.parametrize("name", VERSIONS)
def test_the_version_is_pinned_exactly_and_is_the_one_that_was_read(name: str) -> None:
    wanted = tomllib.loads(PYPROJECT.read_text())["project"]
    pins = [one for one in wanted["dependencies"] if one.replace("[", "=").split("=")[0].strip() == name]
    assert pins == [f"{name}=={VERSIONS[name]}"]
    assert version(name) == VERSIONS[name]


@pytest.mark.parametrize(("module", "digest"), DIGESTS.items(), ids=lambda one: getattr(one, "__name__", ""))
def test_the_source_is_the_one_that_was_read(module: ModuleType, digest: str) -> None:
    assert hashlib.sha256(inspect.getsource(module).encode()).hexdigest() == digest
