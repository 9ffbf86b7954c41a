"""Video viewers on all kinds of links: emulates the rate, delay and queue of a link, with a simulated clock."""

import heapq
import itertools
from collections.abc import Callable
from dataclasses import dataclass, field

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from worlds.tiers import examples

from bench.video.got_cadence import Got, GotCadence
from server.video.core.pacing import TRUST_S, ViewerPace
from server.video.core.streams import Relayed, Stream
from wire.video import Codec, Quality, UnitHead

RATE_HZ = 24.0


def picture(sequence: int, size: int, at: float, *, key: bool, bits_per_s: int) -> Relayed:
    head = UnitHead(
        Quality.MEDIUM, Codec.MPEG1, sequence, key, False, round(at * 1e6), 320, 240, RATE_HZ, bits_per_s, 0
    )
    return Relayed(b"", bytes(size), head, at)


@dataclass
class Way:
    """A link that passes `rate(now)` bytes a second with a delay of `one_way_s`. Its queue is unbounded."""

    rate: Callable[[float], float]
    one_way_s: float = 0.01
    free_at: float = 0.0

    def arrival(self, size: int, now: float) -> float:
        at, left = max(self.free_at, now), float(size)
        while left > 0:  # in steps, because the rate may change meanwhile
            step = min(left, 200.0)
            at += step / self.rate(at)
            left -= step
        self.free_at = at
        return at + self.one_way_s


@dataclass
class Seen:
    """What one viewer received: (sequence, key, time of arrival, age on arrival). `cadence`: the interval of its `got`
    reports, as in the console's player; None: one for each unit."""

    cadence: GotCadence | None = None
    frozen: bool = False
    """The viewer draws and reports nothing any more."""
    said: int = 0
    check_at: float = float("inf")

    units: list[tuple[int, bool, float, float]] = field(default_factory=list)

    def delays(self, since: float = 0.0, until: float = float("inf")) -> list[float]:
        return [delay for _, _, at, delay in self.units if since <= at < until]


class Film:
    """A stream with any number of viewers, each on its own link, with a simulated clock."""

    def __init__(self, *, every: int = 12, key_size: int = 7_000, size: int = 2_000) -> None:
        self.every, self.key_size, self.size = every, key_size, size
        self.stream = Stream()
        self.bytes_per_s = ((every - 1) * size + key_size) / every * RATE_HZ
        self.seen: list[Seen] = []
        self._events: list[tuple[float, int, Callable[[float], None]]] = []
        self._count = itertools.count()
        self._paces: list[tuple[ViewerPace, Way, Seen]] = []

    def at(self, when: float, what: Callable[[float], None]) -> None:
        heapq.heappush(self._events, (when, next(self._count), what))

    def join(self, way: Way, when: float = 0.0, *, thins: bool = False) -> tuple[ViewerPace, Seen]:
        pace, seen = ViewerPace(), Seen(GotCadence() if thins else None)

        def enter(now: float) -> None:
            pace.watch(self.stream, now)
            self._paces.append((pace, way, seen))
            self._pump(pace, way, seen, now)

        self.at(when, enter)
        return pace, seen

    def run(self, for_s: float) -> None:
        for number in range(round(for_s * RATE_HZ)):
            self.at(number / RATE_HZ, lambda now, number=number: self._shoot(number, now))  # type: ignore[misc]
        while self._events and self._events[0][0] <= for_s:
            when, _, what = heapq.heappop(self._events)
            what(when)

    def _shoot(self, number: int, now: float) -> None:
        key = number % self.every == 0
        unit = picture(
            number, self.key_size if key else self.size, now, key=key, bits_per_s=round(self.bytes_per_s * 8)
        )
        assert self.stream.follows(unit.head)
        self.stream.put(unit)
        for pace, way, seen in self._paces:
            self._pump(pace, way, seen, now)

    def _pump(self, pace: ViewerPace, way: Way, seen: Seen, now: float) -> None:
        while (unit := pace.next_unit(now)) is not None:
            arrives = way.arrival(len(unit.framed), now)

            def drawn(at: float, unit: Relayed = unit) -> None:
                seen.units.append((unit.head.sequence, unit.head.key, at, at - unit.at))
                if seen.cadence is None:
                    self._say(pace, way, seen, Got(unit.head.sequence), at)
                    return
                seen.cadence.came(unit.head.sequence, at)
                self._say(pace, way, seen, seen.cadence.drawn(unit.head.sequence, unit.at, RATE_HZ, at), at)

            self.at(arrives, drawn)

    def _say(self, pace: ViewerPace, way: Way, seen: Seen, said: Got | None, now: float) -> None:
        if said is not None and not seen.frozen:
            seen.said += 1
            self.at(now + way.one_way_s, lambda back: self._got(pace, way, seen, said, back))
        if seen.cadence is not None and seen.cadence.look_at < seen.check_at:
            seen.check_at = seen.cadence.look_at
            self.at(seen.check_at, lambda then: self._look(pace, way, seen, then))

    def _look(self, pace: ViewerPace, way: Way, seen: Seen, now: float) -> None:
        assert seen.cadence is not None
        if now == seen.check_at:
            seen.check_at = float("inf")
            self._say(pace, way, seen, seen.cadence.look(now), now)

    def _got(self, pace: ViewerPace, way: Way, seen: Seen, said: Got, now: float) -> None:
        pace.got(said.sequence, now, calm=said.calm, overdue=said.overdue, held_s=said.held_s)
        self._pump(pace, way, seen, now)


def assert_decodable(seen: Seen) -> None:
    """Asserts that it begins with a key picture, and that a key picture follows each gap."""
    before = None
    for sequence, key, _, _ in seen.units:
        assert key or (before is not None and sequence == before + 1)
        assert before is None or sequence > before
        before = sequence


@pytest.mark.parametrize("thins", [False, True])
@pytest.mark.parametrize(
    ("one_way_ms", "room"), [(0, 1.25), (25, 1.25), (75, 1.25), (75, 1.6), (150, 1.6), (150, 4.0), (300, 4.0)]
)
def test_who_keeps_up_loses_nothing(one_way_ms: int, room: float, thins: bool) -> None:
    film = Film()
    pace, seen = film.join(Way(lambda _: film.bytes_per_s * room, one_way_ms / 1000), thins=thins)
    film.run(20)
    # With a delay like that of a satellite link, the pacer may drop the first groups before it learns that a picture
    # has arrived.
    assert pace.skipped <= (0 if one_way_ms < 150 else 2 * film.every)
    assert len(seen.units) > 20 * RATE_HZ - 2 - 2 * one_way_ms / 1000 * RATE_HZ - pace.skipped
    assert_decodable(seen)


@pytest.mark.parametrize("thins", [False, True])
@pytest.mark.parametrize("one_way_ms", [0, 25, 75])
@pytest.mark.parametrize(("every", "key_size", "size"), [(12, 7_000, 2_000), (24, 8_000, 2_000), (12, 3_000, 2_300)])
def test_at_a_third_of_the_bit_rate_the_delay_stays_below_a_second_and_recovers(
    one_way_ms: int, every: int, key_size: int, size: int, thins: bool
) -> None:
    film = Film(every=every, key_size=key_size, size=size)
    full = film.bytes_per_s * 2
    slow = film.bytes_per_s / 3
    pace, seen = film.join(Way(lambda now: slow if 5 <= now < 25 else full, one_way_ms / 1000), thins=thins)
    _, other = film.join(Way(lambda _: full, one_way_ms / 1000), thins=thins)
    film.run(40)
    assert max(seen.delays(5, 25)) < 1.0
    assert len(seen.delays(5, 25)) > 20, "hardly anything came"
    assert max(seen.delays(27, 40)) < 0.15 + one_way_ms / 1000
    assert len(seen.delays(27, 39)) > 12 * RATE_HZ - 3
    assert pace.skipped > 100
    assert_decodable(seen)
    assert max(other.delays(1)) < 0.15 + one_way_ms / 1000
    assert [sequence for sequence, *_ in other.units] == list(range(len(other.units)))


@pytest.mark.parametrize("thins", [False, True])
@pytest.mark.parametrize(("one_way_ms", "most_s"), [(0, 1.0), (25, 1.1), (75, 1.3)])
def test_the_largest_keys_once_a_second_whenever_the_way_grows_slow(
    one_way_ms: int, most_s: float, thins: bool
) -> None:
    """A key picture is at most a quarter of a second of the bit rate, and takes three quarters on such a link. On a
    link with a long delay one may start before the slowdown can be detected. That one is later."""
    for tenth in range(10):
        film = Film(every=24, key_size=12_250, size=1_641)
        slow_from = 5 + tenth / 10
        full, slow = film.bytes_per_s * 3, film.bytes_per_s / 3

        def rate(now: float, slow_from: float = slow_from, full: float = full, slow: float = slow) -> float:
            return slow if now >= slow_from else full

        _, seen = film.join(Way(rate, one_way_ms / 1000), thins=thins)
        film.run(25)
        assert max(seen.delays(slow_from)) < most_s
        assert max(seen.delays(slow_from + 3)) < 1.0
        assert len(seen.delays(slow_from + 3)) >= 12
        assert_decodable(seen)


def test_where_even_keys_are_too_slow_the_newest_of_them_come() -> None:
    film = Film()
    _, seen = film.join(Way(lambda _: film.key_size / 1.3))
    film.run(30)
    late = seen.delays(5)
    assert len(late) >= 12
    assert max(late) < 1.3 + 0.4 + 0.2
    assert_decodable(seen)


def test_a_late_joiner_sees_the_newest_key_at_once_and_is_soon_where_the_others_are() -> None:
    film = Film(every=24)
    pace, seen = film.join(Way(lambda _: film.bytes_per_s * 4, 0.02), when=2.9)
    film.run(6)
    first = seen.units[0]
    assert first[1]
    assert first[2] < 2.9 + 0.1
    assert max(seen.delays(3.4)) < 0.15
    assert_decodable(seen)
    assert pace.skipped <= 24


def test_who_says_nothing_of_what_it_got_gets_little() -> None:
    film = Film()
    film.stream.put(picture(0, 7_000, 0.0, key=True, bits_per_s=450_000))
    pace = ViewerPace()
    pace.watch(film.stream, 0.0)
    sent = 0
    for number in range(1, 500):
        now = number / RATE_HZ
        film.stream.put(picture(number, 2_000, now, key=number % 12 == 0, bits_per_s=450_000))
        while pace.next_unit(now) is not None:
            sent += 1
    assert sent < 2 * RATE_HZ
    assert pace.in_flight < 100_000
    assert pace.silent_for(20.0) > 15


@settings(deadline=None, max_examples=examples(60, long=200))
@given(
    rates=st.lists(st.floats(0.1, 5.0), min_size=1, max_size=8),
    one_way_s=st.floats(0.0, 0.2),
    every=st.integers(1, 30),
    key_times=st.floats(1.0, 6.0),
    joins_at=st.floats(0.0, 3.0),
)
def test_on_any_way_what_comes_can_be_decoded_and_no_queue_grows(
    rates: list[float], one_way_s: float, every: int, key_times: float, joins_at: float
) -> None:
    film = Film(every=every, key_size=round(1_500 * key_times), size=1_500)

    def rate(now: float) -> float:
        return film.bytes_per_s * rates[int(now / 4) % len(rates)]

    pace, seen = film.join(Way(rate, one_way_s), when=joins_at)
    film.run(4.0 * len(rates) + 4)
    assert_decodable(seen)
    # The pacer detects a slow link after at most one group and what precedes it.
    group = film.key_size + (every - 1) * film.size
    assert pace.in_flight <= group + film.key_size + film.bytes_per_s * (2 * one_way_s + 1.0)
    assert len(film.stream.group) <= every
    assert seen.units or min(rates) < 0.5


@pytest.mark.parametrize("one_way_ms", [0, 25, 75])
def test_who_is_calm_says_little_and_misses_nothing(one_way_ms: int) -> None:
    film = Film()
    pace, seen = film.join(Way(lambda _: film.bytes_per_s * 4, one_way_ms / 1000), thins=True)
    film.run(31)
    assert pace.skipped == 0
    assert seen.said < 31 + 12
    assert max(seen.delays(1)) < 0.07 + one_way_ms / 1000


@pytest.mark.parametrize("one_way_ms", [0, 25])
@pytest.mark.parametrize(("every", "key_size", "size"), [(12, 7_000, 2_000), (24, 8_000, 2_000), (12, 3_000, 2_300)])
def test_whenever_the_way_of_one_who_was_calm_grows_slow_the_delay_stays_below_a_second(
    one_way_ms: int, every: int, key_size: int, size: int
) -> None:
    for part in range(20):
        film = Film(every=every, key_size=key_size, size=size)
        slow_from = 5 + part / 20

        def rate(now: float, film: Film = film, slow_from: float = slow_from) -> float:
            return film.bytes_per_s * (1 / 3 if slow_from <= now < 12 else 3)

        _, seen = film.join(Way(rate, one_way_ms / 1000), thins=True)
        film.run(16)
        assert max(seen.delays(slow_from)) < 0.85
        assert max(seen.delays(14)) < 0.15
        assert_decodable(seen)


def test_a_standstill_is_told_and_what_waits_for_it_is_little() -> None:
    film = Film()
    pace, seen = film.join(Way(lambda now: 400.0 if 5 <= now < 8 else film.bytes_per_s * 2, 0.02), thins=True)
    most: list[int] = []
    for tenth in range(51, 80):
        film.at(tenth / 10, lambda now: most.append(pace.in_flight))
    film.run(12)
    assert max(most) < 0.35 * film.bytes_per_s + film.key_size
    assert max(seen.delays(8.7)) < 0.2
    assert_decodable(seen)


def test_who_was_calm_and_says_nothing_more_is_sent_a_little_more_and_no_end() -> None:
    film = Film()
    pace, seen = film.join(Way(lambda _: film.bytes_per_s * 4, 0.01), thins=True)
    film.at(5.0, lambda now: setattr(seen, "frozen", True))
    film.run(30)
    assert len(seen.units) < (5 + TRUST_S + 0.7) * RATE_HZ
    assert pace.in_flight < (TRUST_S + 0.7) * film.bytes_per_s + film.key_size
    assert pace.silent_for(30.0) > 20


def test_who_says_that_it_is_calm_and_draws_ever_older_ones_is_not_trusted() -> None:
    film = Film()
    pace = ViewerPace()
    film.stream.put(picture(0, 7_000, 0.0, key=True, bits_per_s=450_000))
    pace.watch(film.stream, 0.0)
    sent = []
    for number in range(1, 20_000):
        now = number / RATE_HZ
        film.stream.put(picture(number, 2_000, now, key=number % 12 == 0, bits_per_s=450_000))
        while (unit := pace.next_unit(now)) is not None:
            sent.append(unit.head.sequence)
        if number % 10 == 0:
            pace.got(sent.pop(0), now, calm=True)  # one in ten
    assert pace.in_flight < 4 * film.bytes_per_s


def test_what_says_that_it_is_calm_before_it_got_anything_is_not_trusted_with_everything() -> None:
    film = Film()
    film.stream.put(picture(0, 7_000, 0.0, key=True, bits_per_s=450_000))
    pace = ViewerPace()
    pace.watch(film.stream, 0.0)
    sent = 0
    for number in range(1, 20_000):
        now = number / RATE_HZ
        film.stream.put(picture(number, 2_000, now, key=number % 12 == 0, bits_per_s=450_000))
        pace.got(0xFFFFFFFF, now, calm=True)  # which it was never sent
        while pace.next_unit(now) is not None:
            sent += 1
    assert sent < 2 * RATE_HZ
