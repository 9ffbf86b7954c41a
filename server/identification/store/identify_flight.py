"""Fits the step responses of a recorded flight: a separate program with limits, because it takes a processor seconds.
Started by `server.identification.store.running`.

python -m server.identification.store.identify_flight TLOG

On standard output: JSON, a list of the axes with their fits and traces, or `{"problem": words}` with exit code 1.
"""

import sys
from pathlib import Path
from typing import Any, Final

import msgspec

from server.flights.core.tlog import of_one_vehicle, read_entries
from server.storage.bounded_program import limit_this_process

MAX_MEMORY_BYTES: Final = 2 * 1024**3
"""Limit of address space."""
MAX_PROCESSOR_S: Final = 90


def main(arguments: list[str]) -> int:
    limit_this_process(memory_bytes=MAX_MEMORY_BYTES, processor_s=MAX_PROCESSOR_S)
    try:
        return _say(_identified(Path(arguments[0])), 0)
    except (OSError, MemoryError) as error:
        words = getattr(error, "strerror", None) or str(error) or type(error).__name__
        return _say({"problem": words}, 1)


def _identified(path: Path) -> list[dict[str, Any]]:
    from server.identification.core.axes import AXES, manoeuvres_of, table_of_tlog  # NumPy, within the limits
    from server.identification.core.first_order import fit
    from server.identification.core.traces import traces

    with path.open("rb") as file:
        table = table_of_tlog(of_one_vehicle(read_entries(file)))
    found = []
    for axis in AXES:
        manoeuvres = manoeuvres_of(table, axis)
        one = fit(manoeuvres)
        about = (
            None if one is None else msgspec.to_builtins(one) | {"rise_s": one.rise_s, "is_patterned": one.is_patterned}
        )
        shown = [] if one is None else [trace._asdict() for trace in traces(manoeuvres, one)]
        found.append({"axis": axis.name, "unit": axis.unit, "fit": about, "traces": shown})
    return found


def _say(found: object, code: int) -> int:
    sys.stdout.buffer.write(msgspec.json.encode(found) + b"\n")
    return code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
