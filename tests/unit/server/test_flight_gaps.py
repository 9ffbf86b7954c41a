"""Gaps of flights: found by the recorder, fetched piece by piece, merged into the telemetry log."""

from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from server.flights.core.black_box import (
    MAX_TRIES,
    NO_PIECE,
    NOT_THERE,
    REST_AFTER_TRIES_S,
    BlackBoxFetcher,
    Gap,
)
from server.flights.core.gap_watch import MARGIN_US, GapFound, GapWatch
from server.flights.core.tlog import STAMP, read_entries
from server.flights.store.merging import merge, resume_point
from server.link.core.agent_routes import OVER_CHANNEL
from wire.black_box import (
    BLACK_BOX,
    MAX_PIECE_BYTES,
    BlackBoxFlight,
    BlackBoxPiece,
    BlackBoxState,
    BlackBoxWanted,
    deflated,
    inflated,
)
from wire.dialect import build, mavlink
from wire.ids import DroneId

AT_US = 1_800_000_000_000_000
SHIFT_US = 7_000_000
"""The tower's clock is this much ahead of the drone's."""


def frame(number: int) -> bytes:
    message = mavlink.MAVLink_attitude_message(number, 0.1, 0.2, 0.3, 0.0, 0.0, 0.0)
    return build(message, system_id=1, component_id=1, sequence=number)


def entries(*numbers: int, shift_us: int = 0) -> bytes:
    return b"".join(STAMP.pack(AT_US + number * 20_000 + shift_us) + frame(number) for number in numbers)


@dataclass
class Link:
    """The parts of an AgentLink that a fetch looks at."""

    takes: frozenset[str] = frozenset({BLACK_BOX})
    has_channel: bool = True
    heard_at: float = 0.0
    routes: Any = field(default_factory=lambda: SimpleNamespace(newest=("127.0.0.1", 1)))
    posted: list[BlackBoxWanted] = field(default_factory=list)

    @property
    def sealed(self) -> Any:
        return SimpleNamespace(keepalive=SimpleNamespace(silent_for=lambda now: now - self.heard_at))

    def is_heard(self, now: float) -> bool:
        return True

    def post(self, message: BlackBoxWanted) -> None:
        self.posted.append(message)


class Fetching:
    """A fetcher, one drone, and a clock. The drone's flight lasts from 0 to 100 s."""

    def __init__(self) -> None:
        self.now = 1000.0
        self.link = Link()
        self.drone: Any = SimpleNamespace(drone_id=DroneId(1), link=self.link, armed=True, black_box_problem="")
        self.state: Any = SimpleNamespace(
            drones={DroneId(1): self.drone},
            clock=lambda: datetime.fromtimestamp((AT_US + SHIFT_US) / 1e6 + self.now - 900.0, UTC),
        )
        self.fetcher = BlackBoxFetcher(self.state)
        self.pieces: list[bytes] = []
        self.done: list[str] = []
        self.fetcher.on_piece = lambda gap, piece, shift_us: self.pieces.append(piece)
        self.fetcher.on_done = lambda gap, words: self.done.append(words)
        self.report()

    def report(self, problem: str = "") -> None:
        flight = BlackBoxFlight(name="f1", began_us=AT_US, ended_us=None)
        self.receive(BlackBoxState(now_us=AT_US + int((self.now - 900.0) * 1e6), flights=(flight,), problem=problem))

    def receive(self, message: Any) -> None:
        self.fetcher.receive(self.drone, cast(Any, self.link), message)

    def gap(self) -> Gap:
        gap = Gap(1, DroneId(1), "file", AT_US + SHIFT_US + 10_000_000, AT_US + SHIFT_US + 20_000_000)
        assert self.fetcher.add(gap)
        return gap

    def tick(self, after_s: float = 0.1) -> None:
        self.now += after_s
        self.fetcher.tick(self.now)

    def until_asked(self, count: int) -> BlackBoxWanted:
        for _ in range(10_000):
            if len(self.link.posted) >= count:
                return self.link.posted[-1]
            self.tick()
        raise AssertionError("not asked")


def test_a_gap_is_fetched_piece_by_piece_in_the_times_of_the_drone() -> None:
    fetching = Fetching()
    fetching.gap()
    first = fetching.until_asked(1)
    assert (first.flight, first.from_us, first.to_us, first.at) == ("f1", AT_US + 10_000_000, AT_US + 20_000_000, 0)
    fetching.tick(0.4)
    fetching.receive(BlackBoxPiece(request=first.request, next=500, last=False, data=deflated(entries(1, 2))))
    asked_at = fetching.now
    second = fetching.until_asked(2)
    assert second.at == 500
    assert fetching.now - asked_at >= 3 * 0.4, "it rests three times as long as the piece took"
    fetching.receive(BlackBoxPiece(request=second.request, next=700, last=True, data=deflated(entries(3))))
    assert (b"".join(fetching.pieces), fetching.done) == (entries(1, 2, 3), [""])
    assert fetching.fetcher.waiting == 0


def test_nothing_is_asked_before_the_drone_has_written_it() -> None:
    fetching = Fetching()
    gap = fetching.gap()
    gap.to_us = AT_US + SHIFT_US + 150_000_000
    for _ in range(490):
        fetching.tick()
    assert not fetching.link.posted
    fetching.until_asked(1)


def test_another_link_goes_on_where_the_last_one_broke_off() -> None:
    fetching = Fetching()
    fetching.gap()
    first = fetching.until_asked(1)
    fetching.receive(BlackBoxPiece(request=first.request, next=500, last=False, data=deflated(entries(1))))
    fetching.until_asked(2)
    fetching.link = fetching.drone.link = Link()
    fetching.tick()
    assert not fetching.link.posted, "the drone has not said what it has"
    fetching.report()
    assert fetching.until_asked(1).at == 500


@pytest.mark.parametrize("armed", [True, None])
def test_an_armed_drone_without_udp_is_left_alone(armed: bool | None) -> None:
    fetching = Fetching()
    fetching.gap()
    fetching.link.routes.newest = OVER_CHANNEL
    fetching.drone.armed = armed
    for _ in range(100):
        fetching.tick()
    assert not fetching.link.posted
    fetching.drone.armed = False
    fetching.until_asked(1)


def test_an_agent_that_does_not_answer_is_asked_now_and_then() -> None:
    fetching = Fetching()
    fetching.gap()
    fetching.until_asked(MAX_TRIES)
    before = fetching.now
    fetching.until_asked(MAX_TRIES + 1)
    assert fetching.now - before >= REST_AFTER_TRIES_S


def test_a_drone_without_the_flight_ends_the_fetch() -> None:
    fetching = Fetching()
    gap = fetching.gap()
    gap.from_us, gap.to_us = gap.from_us - 10**9, gap.to_us - 10**9
    fetching.tick()
    assert fetching.done == [NOT_THERE]


@pytest.mark.parametrize(
    "piece",
    [
        {"data": b"nonsense", "next": 5, "last": True},
        {"data": deflated(bytes(MAX_PIECE_BYTES + 1)), "next": 5, "last": True},
        {"data": b"", "next": 0, "last": False},
    ],
)
def test_what_is_no_piece_ends_the_fetch(piece: dict[str, Any]) -> None:
    fetching = Fetching()
    fetching.gap()
    asked = fetching.until_asked(1)
    fetching.receive(BlackBoxPiece(request=asked.request, **piece))
    assert fetching.done == [NO_PIECE]


def test_answers_that_nobody_waits_for_change_nothing() -> None:
    fetching = Fetching()
    fetching.gap()
    asked = fetching.until_asked(1)
    fetching.receive(BlackBoxPiece(request=asked.request + 1, next=9, last=True))
    fetching.receive(BlackBoxPiece(request=asked.request, next=500, last=False, data=deflated(entries(1))))
    fetching.receive(BlackBoxPiece(request=asked.request, next=900, last=True, data=deflated(entries(2))))
    assert (fetching.pieces, fetching.done) == ([entries(1)], [])


def test_a_problem_of_the_drones_disk_is_known() -> None:
    fetching = Fetching()
    fetching.report("the disk is full")
    assert fetching.drone.black_box_problem == "the disk is full"


def test_a_piece_comes_back_as_it_was() -> None:
    assert inflated(deflated(entries(*range(50)))) == entries(*range(50))
    with pytest.raises(ValueError, match="cut off"):
        inflated(deflated(entries(1))[:-3])


# -- finding gaps ------------------------------------------------------------------------------------------------


class Watched:
    """A flight that is looked at twice a second."""

    def __init__(self) -> None:
        self.now = 500.0
        self.link: Link | None = Link()
        self.drone: Any = SimpleNamespace(drone_id=DroneId(1), link=self.link, online=True)
        self.watch = GapWatch()
        self.found: list[GapFound] = []
        self.watch.on_gap = self.found.append
        self.sink = object()

    def run(self, seconds: float, *, heard: bool) -> None:
        for _ in range(round(seconds * 2)):
            self.now += 0.5
            if heard and self.drone.link is not None:
                self.drone.link.heard_at = self.now - 0.1
            self.watch.look(self.drone, self.sink, AT_US, self.now)


def test_a_cut_is_a_gap_from_the_last_frame_to_the_next() -> None:
    watched = Watched()
    watched.run(10.0, heard=True)
    watched.run(20.0, heard=False)
    assert not watched.found
    watched.run(10.0, heard=True)
    (gap,) = watched.found
    assert gap.from_us == AT_US + 509_900_000 - MARGIN_US
    assert gap.to_us == AT_US + 530_500_000 + MARGIN_US


def test_a_new_link_ends_a_gap() -> None:
    watched = Watched()
    watched.run(5.0, heard=True)
    watched.drone.link = None
    watched.run(20.0, heard=False)
    watched.drone.link = Link(routes=SimpleNamespace(newest=None))
    watched.run(2.0, heard=True)
    assert not watched.found, "nothing has come over it yet"
    watched.drone.link.routes.newest = ("127.0.0.1", 2)
    watched.run(2.0, heard=True)
    assert len(watched.found) == 1


def test_a_flight_that_ends_in_silence_ends_its_gap() -> None:
    watched = Watched()
    watched.run(5.0, heard=True)
    watched.run(60.0, heard=False)
    watched.watch.over(watched.drone, watched.sink, watched.now)
    (gap,) = watched.found
    assert gap.to_us == AT_US + int(watched.now * 1e6) + MARGIN_US


def test_a_link_that_works_has_no_gaps() -> None:
    watched = Watched()
    watched.run(60.0, heard=True)
    watched.run(1.0, heard=False)
    watched.run(5.0, heard=True)
    watched.watch.over(watched.drone, watched.sink, watched.now)
    assert not watched.found


# -- merging -----------------------------------------------------------------------------------------------------


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    return tmp_path / "f.tlog", tmp_path / "f.1.part"


def frames_of(path: Path) -> list[tuple[int, bytes]]:
    with path.open("rb") as file:
        return [(one.at_us, one.frame) for one in read_entries(file)]


def test_fetched_frames_take_their_places_and_the_towers_times(files: tuple[Path, Path]) -> None:
    tlog, part = files
    tlog.write_bytes(entries(*range(100), *range(200, 300), shift_us=SHIFT_US + 40_000))
    part.write_bytes(entries(*range(80, 220)))
    assert merge(tlog, part, shift_us=SHIFT_US, since_us=0, until_us=2**63) == 100
    merged = frames_of(tlog)
    assert [one for _, one in merged] == [frame(number) for number in range(300)]
    assert [at for at, _ in merged] == [AT_US + number * 20_000 + SHIFT_US + 40_000 for number in range(300)]
    whole = tlog.read_bytes()
    assert merge(tlog, part, shift_us=SHIFT_US, since_us=0, until_us=2**63) == 0
    assert tlog.read_bytes() == whole, "doing it again changes nothing"


def test_nothing_after_the_end_of_the_flight_comes_in(files: tuple[Path, Path]) -> None:
    tlog, part = files
    tlog.write_bytes(entries(*range(50)))
    part.write_bytes(entries(*range(40, 200)))
    assert merge(tlog, part, shift_us=0, since_us=0, until_us=AT_US + 99 * 20_000) == 50
    assert [one for _, one in frames_of(tlog)] == [frame(number) for number in range(100)]


def test_nothing_comes_in_that_was_not_asked_for(files: tuple[Path, Path]) -> None:
    tlog, part = files
    tlog.write_bytes(entries(*range(50)))
    key = mavlink.MAVLink_setup_signing_message(1, 1, b"k" * 32, 1)
    signing = build(key, system_id=255, component_id=190, sequence=0)
    part.write_bytes(entries(*range(60, 70)) + STAMP.pack(AT_US + 70 * 20_000) + signing + entries(71, 72))
    assert merge(tlog, part, shift_us=0, since_us=AT_US + 65 * 20_000, until_us=AT_US + 71 * 20_000) == 6
    assert [one for _, one in frames_of(tlog)][50:] == [frame(number) for number in (65, 66, 67, 68, 69, 71)]


def test_the_same_frame_sent_twice_is_there_twice(files: tuple[Path, Path]) -> None:
    tlog, part = files
    tlog.write_bytes(entries(1, 2, 2, 3))
    part.write_bytes(entries(1, 2, 2, 2, 3))
    assert merge(tlog, part, shift_us=0, since_us=0, until_us=2**63) == 1


def test_a_fetch_resumes_with_the_newest_time(files: tuple[Path, Path]) -> None:
    _, part = files
    assert resume_point(part) == 0
    part.write_bytes(entries(1, 2, 3) + STAMP.pack(AT_US + 60_000) + frame(4)[:10])
    assert resume_point(part) == AT_US + 60_000
    assert part.read_bytes() == entries(1, 2)
