"""Makes a video with a burnt-in flight display: a separate program with limits, because it uses a processor for long.
Started by `server.flights.store.videos.service`; ends when its parent is gone.

python -m server.flights.store.videos.make_display_video MP4 TLOG INDEX BEGAN_US TARGET MAX_BYTES

On standard output: a line of JSON about once a second, `{"done": pictures}`, and at the end the members of `Burnt` or
`{"problem": words}` with exit code 1.
"""

import sys
from pathlib import Path
from typing import Final

import av

from server.flights.core.index import entry_of, whole_lines
from server.flights.core.tlog import of_one_vehicle, read_entries
from server.flights.core.videos.display_values import DisplayTimeline, in_order
from server.flights.store.videos.burning import Burnt, NoVideo, burn
from server.storage.bounded_program import limit_this_process
from server.storage.child_program import end_with_parent, progress_writer, say, say_problem

MAX_MEMORY_BYTES: Final = 2 * 1024**3
"""Limit of address space."""
MAX_PROCESSOR_S: Final = 4 * 3600


def main(arguments: list[str]) -> int:
    film, telemetry, index, target = (Path(arguments[number]) for number in (0, 1, 2, 4))
    began_us, max_bytes = int(arguments[3]), int(arguments[5])
    limit_this_process(memory_bytes=MAX_MEMORY_BYTES, processor_s=MAX_PROCESSOR_S, file_bytes=max_bytes)
    end_with_parent()
    av.logging.set_level(None)
    report = progress_writer()
    try:
        lines = [entry_of(line) for line in whole_lines(index.read_bytes())] if index.is_file() else []
        with telemetry.open("rb") as file:
            timeline = DisplayTimeline(of_one_vehicle(read_entries(file)), in_order(lines))
            made: Burnt = burn(film, target, began_us, timeline, report)
    except (NoVideo, OSError, MemoryError, av.error.FFmpegError) as error:
        say_problem(error)
        return 1
    say(made._asdict())
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
