"""Creates the MP4 file of a recording: a separate program, because it uses a processor for long and reads data from a
drone. Started by `server.video.store.finisher`; ends when its parent is gone.

python -m server.video.store.make_mp4 UNITS MP4

On standard output: a line of JSON about once a second, `{"done": pictures}`, and at the end the members of `Made` or
`{"problem": words}` with exit code 1, or 2 if a retry would not help.
"""

import os
import resource
import sys
from pathlib import Path
from typing import Final

import av

from server.storage.child_program import end_with_parent, progress_writer, say, say_problem
from server.video.core.recordings.units import NoRecording
from server.video.store.conversion import Made, Survey, make, survey

NICENESS: Final = 15
MAX_MEMORY_BYTES: Final = 2 * 1024**3
"""Limit of address space. A picture of the largest accepted size needs some hundred MB with all its references."""


def main(arguments: list[str]) -> int:
    units, target = Path(arguments[0]), Path(arguments[1])
    os.nice(NICENESS)
    resource.setrlimit(resource.RLIMIT_AS, (MAX_MEMORY_BYTES, MAX_MEMORY_BYTES))
    end_with_parent()
    av.logging.set_level(None)
    report = progress_writer()
    try:
        with units.open("rb") as file:
            found: Survey = survey(file, report)
        with units.open("rb") as file:
            made: Made = make(file, found, target, report)
    except NoRecording as error:
        say({"problem": str(error)})
        return 2
    except (OSError, MemoryError, av.error.FFmpegError) as error:
        say_problem(error)
        return 1
    say(made._asdict())
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
