"""Makes elevation tiles from a GeoTIFF: a separate program with limits, because it reads what somebody made elsewhere
and uses a processor for long. Started by `server.maps.io.elevation.converting`.

python -m server.maps.io.elevation.converter SOURCE TARGET SCRATCH MAX_BYTES TITLE ATTRIBUTION

On standard output: lines of `{"done": share}`, then the members of `Converted`, or `{"problem": words}` with exit code
1.
"""

import os
import resource
import shutil
import sys
from pathlib import Path
from typing import Final

import msgspec

from server.maps.io.elevation.conversion import convert
from server.maps.io.elevation.converted import Converted
from server.maps.io.elevation.refusals import BadElevationFile
from server.maps.io.elevation.tiff_file import MAX_PIXELS, TiffFile
from server.maps.io.map_upload import MIN_FREE_BYTES

NICENESS: Final = 15
MAX_MEMORY_BYTES: Final = 3 * 1024**3 + 4 * MAX_PIXELS
"""Limit of address space; the unpacked heights are mapped."""
MAX_PROCESSOR_S: Final = 1_800
REPORT_STEP: Final = 0.01


def main(arguments: list[str]) -> int:
    source, target, scratch = (Path(one) for one in arguments[:3])
    max_bytes, title, attribution = int(arguments[3]), arguments[4], arguments[5]
    os.nice(NICENESS)
    resource.setrlimit(resource.RLIMIT_AS, (MAX_MEMORY_BYTES, MAX_MEMORY_BYTES))
    resource.setrlimit(resource.RLIMIT_CPU, (MAX_PROCESSOR_S, MAX_PROCESSOR_S))
    try:
        _check_room(source, target.parent)
        found = convert(
            source, target, scratch, title=title, attribution=attribution, max_bytes=max_bytes, report=_Reporter()
        )
    except (BadElevationFile, OSError, MemoryError) as error:
        words = getattr(error, "strerror", None) or str(error) or type(error).__name__
        return _say({"problem": words}, 1)
    return _say(found, 0)


def _check_room(source: Path, folder: Path) -> None:
    with TiffFile(source) as file:
        needed = file.width * file.height * 4
    if shutil.disk_usage(folder).free < 2 * needed + MIN_FREE_BYTES:
        raise BadElevationFile("needs more room than the disk of the tower has")


class _Reporter:
    def __init__(self) -> None:
        self._said = 0.0

    def __call__(self, share: float) -> None:
        if share >= self._said + REPORT_STEP:
            self._said = share
            _say({"done": round(share, 2)}, 0)


def _say(found: dict[str, object] | Converted, code: int) -> int:
    sys.stdout.buffer.write(msgspec.json.encode(found) + b"\n")
    sys.stdout.buffer.flush()
    return code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
