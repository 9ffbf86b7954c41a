"""What a converted flight file was found to be. Pure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import msgspec

from server.flights.core.imports.refusals import BadFlightFile
from server.flights.core.imports.telemetry_writer import TelemetryWriter
from server.flights.core.imports.tlog_clock import ClockJump
from server.flights.core.imports.views import Format
from server.flights.core.track import FlightSummary

MIN_FRAMES: Final = 2


class Converted(msgspec.Struct, frozen=True):
    """Times in microseconds since 1970; `clock_known`: by a clock, not counted from the upload."""

    format: Format
    began_us: int
    ended_us: int
    clock_known: bool
    frames: int
    skipped_bytes: int
    size_bytes: int
    distance_m: float
    max_height_m: float | None
    track: list[tuple[float, float]]
    clock_jumps: list[ClockJump] = []


def converted(writer: TelemetryWriter, kind: Format, *, clock_known: bool, skipped_bytes: int) -> Converted:
    """Raises BadFlightFile if the log has nothing to replay."""
    if writer.summary is None:
        raise BadFlightFile("there is nothing in this log that can be replayed")
    return summed(writer.summary, kind, clock_known=clock_known, skipped_bytes=skipped_bytes)


def summed(
    summary: FlightSummary,
    kind: Format,
    *,
    clock_known: bool,
    skipped_bytes: int,
    clock_jumps: Sequence[ClockJump] = (),
) -> Converted:
    """Raises BadFlightFile if the log has nothing to replay."""
    if summary.frames < MIN_FRAMES:
        raise BadFlightFile("there is nothing in this log that can be replayed")
    return Converted(
        format=kind,
        began_us=summary.began_us,
        ended_us=max(summary.last_us, summary.began_us),
        clock_known=clock_known,
        frames=summary.frames,
        skipped_bytes=skipped_bytes,
        size_bytes=summary.whole_bytes,
        distance_m=round(summary.distance_m, 1),
        max_height_m=summary.max_height_m,
        track=[(round(lat, 6), round(lon, 6)) for lat, lon in summary.track],
        clock_jumps=list(clock_jumps),
    )
