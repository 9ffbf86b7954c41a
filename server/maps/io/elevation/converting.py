"""Starts the converter of GeoTIFFs, and puts its result into the folder of maps. Blocks: call it from a thread."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Final

import msgspec

from server.maps.io.elevation.converted import Converted
from server.maps.io.elevation.refusals import BadElevationFile
from server.maps.io.map_files import ENDING

_PROGRAM: Final = "server.maps.io.elevation.converter"
_ONE_THREAD: Final = {"OPENBLAS_NUM_THREADS": "1"}
"""Each thread of the algebra library would reserve address space."""


def add_elevation(
    source: Path,
    folder: Path,
    name: str,
    *,
    title: str,
    attribution: str,
    max_bytes: int,
    report: Callable[[float], None],
    started: Callable[[subprocess.Popen[bytes]], None] = lambda _program: None,
) -> Converted:
    """Makes the map file `name` of a GeoTIFF, in place of one of the same name. `started` gets the program,
    for somebody who may kill it.

    Raises BadElevationFile and OSError; then nothing has changed."""
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    mark = os.urandom(6).hex()
    target, scratch = folder / f".{name}.{mark}.part", folder / f".{name}.{mark}.heights"
    try:
        said = _run([str(source), str(target), str(scratch), str(max_bytes), title, attribution], report, started)
        target.replace(folder / f"{name}{ENDING}")
    finally:
        for file_made in (target, scratch):
            with suppress(OSError):
                file_made.unlink()
    return said


def _command(arguments: list[str]) -> list[str]:
    return [sys.executable, "-m", _PROGRAM, *arguments]


def _run(
    arguments: list[str], report: Callable[[float], None], started: Callable[[subprocess.Popen[bytes]], None]
) -> Converted:
    last: dict[str, object] = {}
    with subprocess.Popen(_command(arguments), stdout=subprocess.PIPE, env=os.environ | _ONE_THREAD) as program:  # noqa: S603
        assert program.stdout is not None
        try:
            started(program)
            for line in program.stdout:
                last = msgspec.json.decode(line, type=dict[str, object])
                share = last.get("done")
                if isinstance(share, float):
                    report(share)
        except BaseException:
            program.kill()
            raise
    if program.returncode == 0:
        return msgspec.convert(last, Converted)
    raise BadElevationFile(str(last.get("problem") or "takes too much time or memory"))
