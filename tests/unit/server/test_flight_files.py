"""The two files of a flight: what other programs read, what a crash leaves, and what exports say."""

import io
import os
import random
import xml.etree.ElementTree as ElementTree
from datetime import UTC, datetime
from pathlib import Path

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from server.flights.core import exports
from server.flights.core.index import NoIndex, Pilot, head_line, read_index, whole_lines
from server.flights.core.recorder import FlightHead
from server.flights.core.tlog import STAMP, read_entries
from server.flights.core.track import MAX_TRACK_POINTS, FlightSummary, fixes_in
from server.flights.store.files import INDEX, MAX_TORN_BYTES, TLOG, FlightFiles
from server.kernel.people import UserRef
from wire.dialect import build, mavlink
from wire.ids import DroneId, UserId

BEGAN = datetime(2026, 5, 1, 12, tzinfo=UTC)
BEGAN_US = round(BEGAN.timestamp() * 1e6)
HEAD = FlightHead(DroneId(7), "kestrel", BEGAN, UserRef(UserId(1), "alice"), 60.0)


def position(seconds: float, lat_deg: float, lon_deg: float = 8.0, rel_m: float = 20.0) -> tuple[float, bytes]:
    numbers = round(lat_deg * 1e7), round(lon_deg * 1e7), 520_000, round(rel_m * 1000)
    message = mavlink.MAVLink_global_position_int_message(0, *numbers, 100, -200, 50, 9000)
    return seconds, build(message, system_id=1, component_id=1, sequence=0)


def heartbeat(seconds: float, *, armed: bool = True) -> tuple[float, bytes]:
    message = mavlink.MAVLink_heartbeat_message(2, 3, 128 if armed else 0, 5, 4, 3)
    return seconds, build(message, system_id=1, component_id=1, sequence=0)


def attitude(seconds: float) -> tuple[float, bytes]:
    message = mavlink.MAVLink_attitude_message(0, 0.1, -0.2, 1.5, 0, 0, 0)
    return seconds, build(message, system_id=1, component_id=1, sequence=0)


def tlog_of(*timed: tuple[float, bytes]) -> bytes:
    return b"".join(STAMP.pack(BEGAN_US + round(at * 1e6)) + frame for at, frame in timed)


FLIGHT = tlog_of(
    heartbeat(0.0),
    attitude(0.0),
    *[position(second, 47.0 + second * 0.0001, rel_m=second) for second in range(1, 101)],
)


def line(kind: str, seconds: float, **about: object) -> bytes:
    return msgspec.json.encode({"at_us": BEGAN_US + round(seconds * 1e6), "kind": kind, **about}) + b"\n"


INDEX_LINES = (
    head_line(HEAD)
    + b"\n"
    + line("armed", 0, holder={"id": 1, "name": "alice"})
    + line("sticks", 3, by={"id": 2, "name": "bob"})
    + line("control", 5, event="taken", holder={"id": 9, "name": "admin"})
    + line("sticks", 6, by={"id": 9, "name": "admin"})
    + line("disarmed", 100)
    + line("end", 110, words="")
)


@pytest.fixture
def files(tmp_path: Path) -> FlightFiles:
    found = FlightFiles(tmp_path)
    found.open()
    found.path(7, "a" * 16, TLOG).parent.mkdir()
    return found


def put(files: FlightFiles, tlog: bytes, index: bytes = INDEX_LINES) -> None:
    files.path(7, "a" * 16, TLOG).write_bytes(tlog)
    files.path(7, "a" * 16, INDEX).write_bytes(index)


def test_a_flight_is_summed_up(files: FlightFiles) -> None:
    put(files, FLIGHT)
    facts = files.close_unfinished(7, "a" * 16)
    assert (facts.summary.frames, facts.torn_bytes) == (102, 0)
    assert facts.summary.distance_m == pytest.approx(99 * 11.13, rel=0.001)
    assert facts.summary.max_height_m == 100
    assert facts.index.pilots == [Pilot(1, "alice"), Pilot(2, "bob"), Pilot(9, "admin")]
    assert (facts.index.ended_us, facts.index.is_over) == (BEGAN_US + 100_000_000, True)
    assert facts.size_bytes == len(FLIGHT) + len(INDEX_LINES)


def test_what_happened_before_arming_is_no_distance(files: FlightFiles) -> None:
    put(files, tlog_of(position(-20, 47.0), position(-10, 47.1)) + FLIGHT)
    facts = files.close_unfinished(7, "a" * 16)
    assert facts.summary.frames == 104
    assert facts.summary.distance_m == pytest.approx(99 * 11.13, rel=0.001)


def test_a_receiver_that_wanders_flies_nowhere() -> None:
    wander = random.Random(1)
    summary = FlightSummary(BEGAN_US)
    for entry in read_entries(io.BytesIO(tlog_of(*[position(n, 47 + wander.gauss(0, 3e-6)) for n in range(600)]))):
        summary.take(entry)
    assert summary.distance_m < 10


def test_the_track_stays_short() -> None:
    summary = FlightSummary(BEGAN_US)
    for entry in read_entries(io.BytesIO(tlog_of(*[position(n, 47 + n * 1e-4) for n in range(5000)]))):
        summary.take(entry)
    assert 50 < len(summary.track) <= MAX_TRACK_POINTS
    assert summary.track[0] == (47.0, 8.0)


@given(cut=st.integers(0, len(FLIGHT)), index_cut=st.integers(len(head_line(HEAD)) + 1, len(INDEX_LINES)))
def test_a_crash_at_any_byte_leaves_whole_files(
    tmp_path_factory: pytest.TempPathFactory, cut: int, index_cut: int
) -> None:
    files = FlightFiles(tmp_path_factory.mktemp("cut"))
    files.open()
    files.path(7, "a" * 16, TLOG).parent.mkdir()
    put(files, FLIGHT[:cut], INDEX_LINES[:index_cut])
    facts = files.close_unfinished(7, "a" * 16)
    left = files.path(7, "a" * 16, TLOG).read_bytes()
    assert FLIGHT.startswith(left)
    assert cut - len(left) < 60  # one entry
    assert facts.summary.frames == len(list(read_entries(io.BytesIO(left))))
    index = files.path(7, "a" * 16, INDEX).read_bytes()
    assert INDEX_LINES.startswith(index)
    assert index.endswith(b"\n")
    again = files.close_unfinished(7, "a" * 16)
    assert (again.summary.frames, again.torn_bytes) == (facts.summary.frames, 0)


def test_a_large_unreadable_rest_is_left_alone(files: FlightFiles) -> None:
    put(files, FLIGHT + os.urandom(16) + bytes(MAX_TORN_BYTES))
    facts = files.close_unfinished(7, "a" * 16)
    assert facts.summary.frames == 102
    assert files.path(7, "a" * 16, TLOG).stat().st_size == len(FLIGHT) + 16 + MAX_TORN_BYTES


def test_a_flight_without_a_frame_is_a_flight(files: FlightFiles) -> None:
    files.path(7, "a" * 16, INDEX).write_bytes(INDEX_LINES)
    assert files.close_unfinished(7, "a" * 16).summary.frames == 0


@pytest.mark.parametrize("index", [b"", b"\n", b"{}\n", b'{"kind":"flight"}\n', b"\xff\xff\n", b"[1]\n", b"no end"])
def test_an_index_without_a_head_is_none(files: FlightFiles, index: bytes) -> None:
    put(files, FLIGHT, index)
    with pytest.raises(NoIndex):
        files.close_unfinished(7, "a" * 16)


@given(st.binary(max_size=400))
def test_no_bytes_break_the_readers(content: bytes) -> None:
    for entry in read_entries(io.BytesIO(content)):
        assert len(entry.frame) >= 8
    list(fixes_in(read_entries(io.BytesIO(content))))
    lines = whole_lines(content)
    try:
        read_index([head_line(HEAD), *lines])
    except NoIndex:
        pytest.fail("the head is there")


def test_files_that_nobody_knows_are_found(files: FlightFiles) -> None:
    put(files, FLIGHT)
    assert [one.file for one in files.unknown({})] == ["a" * 16]
    assert files.unknown({"a" * 16: 1}) == []
    files.remove(7, "a" * 16)
    assert files.unknown({}) == []


def test_csv_has_a_line_for_each_position() -> None:
    rows = "".join(exports.csv("t", fixes_in(read_entries(io.BytesIO(FLIGHT))))).split("\r\n")
    assert rows[0].split(",") == list(exports.COLUMNS)
    assert len(rows) == 102
    first = dict(zip(exports.COLUMNS, rows[1].split(","), strict=True))
    assert first["time_utc"] == "2026-05-01T12:00:01.000Z"
    assert (first["lat_deg"], first["alt_rel_m"], first["north_m_s"]) == ("47.0001000", "1.000", "1.00")
    assert (first["roll_deg"], first["course_deg"], first["armed"], first["battery_v"]) == ("5.73", "90.00", "1", "")


@pytest.mark.parametrize("export", [exports.kml, exports.gpx])
def test_xml_is_well_formed_whatever_the_name(export: exports.Export) -> None:
    text = "".join(export('a <b> & \x00 \u202e "c"', fixes_in(read_entries(io.BytesIO(FLIGHT)))))
    root = ElementTree.fromstring(text)
    tags = [one.tag.rpartition("}")[2] for one in root.iter()]
    assert max(tags.count("trkpt"), tags.count("coord")) == 100
