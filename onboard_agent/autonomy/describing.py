"""Reads what controllers of files and packages say of their settings: each is loaded once, in a process of its own."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import sys
from collections.abc import AsyncIterator, Mapping
from typing import Final

import msgspec

from onboard_agent.autonomy.loading import loaded_class
from wire.controller_settings import ControllerDescribed

_log = logging.getLogger(__name__)

WORD: Final = "describe"
"""The first argument of such a process; name and FILE:CLASS follow."""
LOADS_WITHIN_S: Final = 30.0
MAX_BYTES: Final = 60_000


async def descriptions(sources: Mapping[str, str]) -> AsyncIterator[ControllerDescribed]:
    """Yields those of the controllers that have one. `sources`: FILE:CLASS by name; empty: of a package."""
    for name, source in sources.items():
        described = await _description(name, source)
        if described is not None:
            yield described


async def _description(name: str, source: str) -> ControllerDescribed | None:
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "onboard_agent.autonomy", WORD, name, source),
        stdin=asyncio.subprocess.DEVNULL,
        stdout=asyncio.subprocess.PIPE,
    )
    try:
        async with asyncio.timeout(LOADS_WITHIN_S):
            said, _ = await process.communicate()
        if process.returncode == 0 and len(said) <= MAX_BYTES:
            return msgspec.json.decode(said, type=ControllerDescribed | None)
        _log.warning("controller %s: its settings cannot be read (code %s)", name, process.returncode)
    except (TimeoutError, msgspec.DecodeError) as error:
        _log.warning("controller %s: its settings cannot be read: %s", name, error or "it does not load in time")
    finally:
        with contextlib.suppress(ProcessLookupError):
            process.kill()
    return None


def main() -> None:
    """Writes a ControllerDescribed, or null, to standard output. Raises whatever the controller's code raises."""
    out = os.dup(1)
    os.dup2(2, 1)  # what the controller prints is no description
    name, source = sys.argv[2:]
    settings = getattr(loaded_class(name, source), "described_settings", None)
    described = None if settings is None else ControllerDescribed(controller=name, settings=tuple(settings))
    line = msgspec.json.encode(described)
    msgspec.json.decode(line, type=ControllerDescribed | None)  # raises what the tower would refuse
    os.write(out, line)
