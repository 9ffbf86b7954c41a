"""Creates the MP4 file of a recording: a separate program, because it uses a processor for long and reads data from a
drone. Started by `server.store.recordings.finisher`; ends when its parent is gone.

python -m server.store.recordings.make_mp4 UNITS MP4

On standard output: a line of JSON about once a second, `{"done": pictures}`, and at the end the members of `Made` or
`{"problem": words}` with exit code 1, or 2 if a retry would not help.
"""

import json
import os
import resource
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

import av

from server.live.recordings.units import NoRecording
from server.store.recordings.conversion import Made, Survey, make, survey

NICENESS: Final = 15
MAX_MEMORY_BYTES: Final = 2 * 1024**3
"""Limit of address space. A picture of the largest accepted size needs some hundred MB with all its references."""
SAY_EVERY_S: Final = 1.0


def main(arguments: list[str]) -> int:
    units, target = Path(arguments[0]), Path(arguments[1])
    os.nice(NICENESS)
    resource.setrlimit(resource.RLIMIT_AS, (MAX_MEMORY_BYTES, MAX_MEMORY_BYTES))
    threading.Thread(target=_end_with_parent, daemon=True).start()
    av.logging.set_level(None)
    report = _progress_writer()
    try:
        with units.open("rb") as file:
            found: Survey = survey(file, report)
        with units.open("rb") as file:
            made: Made = make(file, found, target, report)
    except NoRecording as error:
        _say({"problem": str(error)})
        return 2
    except (OSError, MemoryError, av.error.FFmpegError) as error:
        words = getattr(error, "strerror", None) or str(error) or type(error).__name__
        _say({"problem": words[:150]})
        return 1
    _say(made._asdict())
    return 0


def _progress_writer() -> Callable[[int], None]:
    said = time.monotonic()

    def report(done: int) -> None:
        nonlocal said
        if time.monotonic() - said >= SAY_EVERY_S:
            said = time.monotonic()
            _say({"done": done})

    return report


def _say(what: dict[str, Any]) -> None:
    sys.stdout.write(json.dumps(what) + "\n")
    sys.stdout.flush()


def _end_with_parent() -> None:
    """Standard input is a pipe from the parent. A tower that was killed creates the file again at its start."""
    with suppress(OSError):
        while os.read(0, 1024):
            pass
    os._exit(3)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
