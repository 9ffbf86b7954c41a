"""Makes the telemetry log of an uploaded flight file: a separate program with limits, because it reads what somebody
made elsewhere and uses a processor for long. Started by `server.flights.store.imports.converting`.

python -m server.flights.store.imports.converter SOURCE TARGET UPLOADED_US

On standard output: one line of JSON, the members of `Converted`, or `{"problem": words}` with exit code 1.
"""

import mmap
import os
import sys
from pathlib import Path
from typing import Final

import msgspec

from server.flights.core.imports.conversion import NOT_A_FLIGHT, convert
from server.flights.core.imports.converted import Converted
from server.flights.core.imports.refusals import BadFlightFile
from server.storage.bounded_program import limit_this_process

MAX_MEMORY_BYTES: Final = 2 * 1024**3
"""Limit of address space. The uploaded file is mapped, not read: its largest size counts here."""
MAX_PROCESSOR_S: Final = 240
MAX_TLOG_BYTES: Final = 160 * 1024 * 1024
"""What the console replays."""


def main(arguments: list[str]) -> int:
    source, target, uploaded_us = Path(arguments[0]), Path(arguments[1]), int(arguments[2])
    memory_bytes = MAX_MEMORY_BYTES + source.stat().st_size
    limit_this_process(memory_bytes=memory_bytes, processor_s=MAX_PROCESSOR_S, file_bytes=MAX_TLOG_BYTES + 1)
    try:
        found = _converted(source, target, uploaded_us)
    except (BadFlightFile, OSError, MemoryError) as error:
        words = getattr(error, "strerror", None) or str(error) or type(error).__name__
        return _say({"problem": words}, 1)
    return _say(found, 0)


def _converted(source: Path, target: Path, uploaded_us: int) -> Converted:
    with source.open("rb") as file, target.open("xb") as out:
        if os.fstat(file.fileno()).st_size == 0:
            raise BadFlightFile(NOT_A_FLIGHT)
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as log:
            return convert(log, out, uploaded_us=uploaded_us, max_bytes=MAX_TLOG_BYTES)


def _say(found: object, code: int) -> int:
    sys.stdout.buffer.write(msgspec.json.encode(found) + b"\n")
    return code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
