"""Runs the identification of a flight in a process of its own."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import msgspec

from server.flights.core.refusals import NotIdentified
from server.storage.bounded_program import TooMuchSaid, run_program

MAX_DURATION_S: Final = 120.0
"""By the clock: at low priority beside a busy tower, 90 s of processor time take longer."""
_PROGRAM: Final = "server.identification.store.identify_flight"
_MAX_ANSWER_BYTES: Final = 1024 * 1024
_MAX_WORDS: Final = 200
_TOO_MUCH: Final = "the flight takes too much time or memory"


async def run_identification(telemetry: Path) -> list[dict[str, Any]]:
    """Returns the axes, each with `axis`, `unit`, `fit` and `traces`. Raises NotIdentified, OSError."""
    try:
        answered = await run_program(_PROGRAM, str(telemetry), within_s=MAX_DURATION_S, max_bytes=_MAX_ANSWER_BYTES)
        if answered.code == 0:
            return msgspec.json.decode(answered.answer, type=list[dict[str, Any]])
        said = msgspec.json.decode(answered.answer, type=dict[str, Any]) if answered.code == 1 else {}
        raise NotIdentified(str(said.get("problem") or _TOO_MUCH)[:_MAX_WORDS])
    except (TimeoutError, TooMuchSaid):
        raise NotIdentified(_TOO_MUCH) from None
    except (msgspec.DecodeError, msgspec.ValidationError):
        raise NotIdentified("the flight could not be read") from None
