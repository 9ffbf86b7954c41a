"""Makes a telemetry log (`.tlog`) of a flight file, whose kind its first bytes tell. Pure but for the files given."""

from __future__ import annotations

from array import array
from mmap import mmap
from typing import IO, Final

from server.flights.core.imports import dataflash, ulog
from server.flights.core.imports.converted import Converted, summed
from server.flights.core.imports.dataflash_flight import convert_dataflash
from server.flights.core.imports.refusals import BadFlightFile
from server.flights.core.imports.telemetry_writer import TOO_LONG
from server.flights.core.imports.tlog_clock import ClockJump, TlogClock
from server.flights.core.imports.ulog_flight import convert_ulog
from server.flights.core.tlog import STAMP, STAMP_BYTES, Entry, is_of_one_vehicle
from server.flights.core.track import FlightSummary
from wire.dialect import mavlink
from wire.frames import MalformedFrame, checksum_holds, frame_length, is_known, message_id
from wire.own_system import OwnSystem

Buffer = bytes | mmap
_MIN_US, _MAX_US = 978_307_200_000_000, 4_102_444_800_000_000
"""2001 to 2100: the times of a telemetry log whose clock was set."""
_SECRET: Final = mavlink.MAVLINK_MSG_ID_SETUP_SIGNING
NOT_A_FLIGHT: Final = "this is no flight file that the tower knows: it takes .tlog, ArduPilot's .bin and PX4's .ulg"


def convert(log: Buffer, out: IO[bytes], *, uploaded_us: int, max_bytes: int) -> Converted:
    """Raises BadFlightFile, OSError. `max_bytes`: of the telemetry log."""
    if log[: len(dataflash.HEAD)] == dataflash.HEAD:
        return convert_dataflash(log, out, uploaded_us=uploaded_us, max_bytes=max_bytes)
    if log[: len(ulog.MAGIC)] == ulog.MAGIC:
        return convert_ulog(log, out, uploaded_us=uploaded_us, max_bytes=max_bytes)
    return _convert_tlog(log, out, uploaded_us=uploaded_us, max_bytes=max_bytes)


def _convert_tlog(log: Buffer, out: IO[bytes], *, uploaded_us: int, max_bytes: int) -> Converted:
    """Copies the whole entries of the first vehicle, by the autopilot's clock. A file of which less than half is
    entries is no telemetry log."""
    end, at, skipped, known, last_us = len(log), 0, 0, 0, 0
    size = 0
    own, clock = OwnSystem(judged=True), TlogClock()
    begins, ends = array("Q"), array("Q")
    while at < end:
        length = _entry_length(log, at, end)
        if length == 0:
            at += 1
            skipped += 1
            continue
        frame = log[at + STAMP_BYTES : at + length]
        stamp_us = STAMP.unpack_from(log, at)[0]
        last_us = max(last_us, stamp_us)
        at += length
        known += is_known(frame)
        if message_id(frame) == _SECRET or not is_of_one_vehicle(own, frame, last_us):
            continue
        size += length
        if size > max_bytes:
            raise BadFlightFile(TOO_LONG)
        clock.take(stamp_us, frame)
        begins.append(at - length)
        ends.append(at)
    if not begins or known == 0 or skipped * 2 > end:
        raise BadFlightFile(NOT_A_FLIGHT)
    times = clock.times(STAMP.unpack_from(log, begin)[0] for begin in begins)
    has_clock = STAMP.unpack_from(log, begins[-1])[0] > _MIN_US
    summary: FlightSummary | None = None
    size = base_us = 0
    for begin, after, by_clock_us in zip(begins, ends, times, strict=True):
        if summary is None:
            base_us = 0 if has_clock else uploaded_us - by_clock_us
            summary = FlightSummary(by_clock_us + base_us)
        size += after - begin
        frame = log[begin + STAMP_BYTES : after]
        summary.take(Entry(by_clock_us + base_us, frame, size))
        out.write(STAMP.pack(by_clock_us + base_us) + frame)
    assert summary is not None
    jumps = [ClockJump(one.at_us + base_us, one.by_s) for one in clock.jumps()]
    return summed(summary, "tlog", clock_known=has_clock, skipped_bytes=skipped, clock_jumps=jumps)


def _entry_length(log: Buffer, at: int, end: int) -> int:
    """Of the time and the frame behind it; 0: no entry begins here."""
    begin = at + STAMP_BYTES
    if begin + 1 > end or (stamp_us := STAMP.unpack_from(log, at)[0]) >= _MAX_US:
        return 0
    try:
        length = frame_length(log[begin : begin + 3])
    except MalformedFrame:
        return 0
    if length == 0 or begin + length > end:
        return 0
    frame = log[begin : begin + length]
    # A computer whose clock is not set counts from 1970. So small a number proves nothing: the frame must.
    is_entry = checksum_holds(frame) if is_known(frame) else stamp_us > _MIN_US
    return STAMP_BYTES + length if is_entry else 0
