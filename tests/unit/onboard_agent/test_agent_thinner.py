"""The thinner: passes everything transactional, and the newest state at no more than its rate."""

from collections import defaultdict
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from onboard_agent.telemetry.thinner import FORGET_EVERY_BEATS, MAX_KINDS, Thinner
from wire.dialect import build, mavlink
from wire.frames import message_id, payload
from wire.state_messages import state_key
from wire.stream_profiles import BEAT_S, StreamProfile, beats_between

TICK_S = 0.025
FULL, THIN, MINIMAL = StreamProfile.FULL, StreamProfile.THIN, StreamProfile.MINIMAL
UNKNOWN = bytes((0xFD, 2, 0, 0, 9, 1, 1, 0x39, 0x30, 0, 1, 2, 0, 0))
"""Message 12345, which is in none of our dialects."""


def frame(message: Any, *, sequence: int = 0, component_id: int = 1) -> bytes:
    return build(message, system_id=1, component_id=component_id, sequence=sequence & 0xFF)


def attitude(number: int, component_id: int = 1) -> bytes:
    return frame(mavlink.MAVLink_attitude_message(number, 0, 0, 0, 0, 0, 0), component_id=component_id)


def battery(instance: int, mah: int) -> bytes:
    return frame(mavlink.MAVLink_battery_status_message(instance, 0, 0, 0, [1] * 10, 0, mah, 0, 0))


def text(number: int) -> bytes:
    return frame(mavlink.MAVLink_statustext_message(6, f"text {number}".encode()))


def ack(number: int) -> bytes:
    return frame(mavlink.MAVLink_command_ack_message(400, number & 7), sequence=number)


def beat(custom_mode: int) -> bytes:
    return frame(mavlink.MAVLink_heartbeat_message(2, 3, 81, custom_mode, 4, 3))


class Bench:
    """A thinner, a clock that ticks, and all that has gone up, with times."""

    def __init__(self, profile: StreamProfile, *, by_hand: bool = False) -> None:
        self.thinner = Thinner()
        self.thinner.profile = profile
        self.thinner.by_hand = by_hand
        self.tick = 400_000
        self.sent: list[tuple[float, bytes]] = []

    @property
    def now(self) -> float:
        return self.tick * TICK_S

    def give(self, *frames: bytes) -> list[bytes]:
        return self._note(self.thinner.admit(list(frames)))

    def pass_ticks(self, ticks: int = 1) -> list[bytes]:
        first = len(self.sent)
        for _ in range(ticks):
            self.tick += 1
            self._note(self.thinner.due(self.now))
        return [one for _, one in self.sent[first:]]

    def _note(self, frames: list[bytes]) -> list[bytes]:
        self.sent += [(self.now, one) for one in frames]
        return frames


def test_in_full_everything_goes_at_once_and_untouched() -> None:
    bench = Bench(FULL)
    frames = [attitude(1), text(1), attitude(2), UNKNOWN]
    assert bench.give(*frames) == frames
    assert bench.pass_ticks(100) == []


@pytest.mark.parametrize("profile", [THIN, MINIMAL])
def test_what_must_arrive_goes_at_once_and_in_order(profile: StreamProfile) -> None:
    bench = Bench(profile)
    must = [beat(5), text(1), ack(1), UNKNOWN, beat(5), text(1), beat(2)]
    assert bench.give(attitude(1), *must, attitude(2)) == must
    assert bench.thinner.unknown_passed == 1


def test_of_state_the_newest_goes_at_the_beat() -> None:
    bench = Bench(THIN)
    assert bench.give(attitude(1), attitude(2)) == []
    assert bench.give(attitude(3)) == []
    assert bench.pass_ticks(8) == [attitude(3)]
    assert bench.pass_ticks(80) == [], "it went once"
    assert bench.thinner.counts["thinned"] == 2


def test_senders_and_instances_are_told_apart() -> None:
    bench = Bench(MINIMAL)
    frames = [attitude(1), attitude(1, component_id=2), battery(0, 7), battery(1, 7)]
    bench.give(*frames)
    assert sorted(bench.pass_ticks(8)) == sorted(frames)


def test_slow_kinds_share_their_beat() -> None:
    bench = Bench(MINIMAL)
    for number in range(2000):
        bench.give(attitude(number), battery(0, number), frame(mavlink.MAVLink_gps_raw_int_message(0, 3, *[0] * 8)))
        bench.pass_ticks()
    moments = {round(at, 3) for at, _ in bench.sent}
    assert len(moments) <= 50 / 1.0 + 2, "one datagram a second, not one for each kind"


def test_the_way_back_to_full_brings_nothing_old_after_what_is_newer() -> None:
    bench = Bench(MINIMAL)
    bench.give(attitude(1))
    bench.thinner.profile = FULL
    assert bench.give(attitude(2)) == [attitude(1), attitude(2)]
    bench.thinner.profile = MINIMAL
    bench.give(attitude(3))
    bench.thinner.profile = FULL
    assert bench.pass_ticks() == [attitude(3)]
    assert bench.pass_ticks(100) == []


def test_sticks_in_a_hand_make_attitude_and_place_fast_at_once() -> None:
    bench = Bench(MINIMAL)

    def attitudes(ticks: int) -> int:
        before = len(bench.sent)
        for number in range(ticks):
            bench.give(attitude(number))
            bench.pass_ticks()
        return len(bench.sent) - before

    assert 9 <= attitudes(400) <= 11
    bench.thinner.by_hand = True
    assert 49 <= attitudes(400) <= 51
    bench.thinner.by_hand = False
    assert 9 <= attitudes(400) <= 11


def test_memory_has_a_bound_and_old_kinds_make_room() -> None:
    bench = Bench(MINIMAL)

    def aircraft(address: int) -> bytes:
        return frame(mavlink.MAVLink_adsb_vehicle_message(address, 0, 0, 0, 0, 0, 0, 0, b"x", 0, 0, 0, 0))

    bench.give(*(aircraft(address) for address in range(MAX_KINDS + 5)))
    assert bench.thinner.counts["too many kinds of state"] == 5
    assert len(bench.pass_ticks(8)) == MAX_KINDS
    bench.pass_ticks(round(2 * FORGET_EVERY_BEATS * BEAT_S / TICK_S) + 8)
    bench.give(aircraft(MAX_KINDS + 9))
    assert bench.pass_ticks(8) == [aircraft(MAX_KINDS + 9)]
    assert bench.thinner.counts["too many kinds of state"] == 5


KINDS = st.sampled_from(
    [
        attitude,
        text,
        ack,
        beat,
        lambda number: battery(number & 1, number),
        lambda number: attitude(number, component_id=3),
        lambda number: UNKNOWN,
        lambda number: frame(mavlink.MAVLink_mission_item_reached_message(number & 0xFFFF)),
        lambda number: frame(mavlink.MAVLink_global_position_int_message(number, *[0] * 8)),
        lambda number: frame(mavlink.MAVLink_system_time_message(1, number)),
    ]
)
STEP = st.one_of(
    KINDS,
    KINDS,
    KINDS,
    st.integers(1, 120),
    st.sampled_from(list(StreamProfile)),
    st.booleans(),
)


@given(st.lists(STEP, max_size=200))
def test_whatever_happens(steps: list[Any]) -> None:
    """Transactional frames and heartbeats: all of them, at once, in order. State: never an older one after a newer one,
    and the newest of each kind is sent within the slowest interval."""
    bench = Bench(FULL)
    given_frames: list[bytes] = []
    for number, step in enumerate(steps):
        if isinstance(step, StreamProfile):
            bench.thinner.profile = step
        elif isinstance(step, bool):
            bench.thinner.by_hand = step
        elif isinstance(step, int):
            bench.pass_ticks(step)
        else:
            one = step(number)
            given_frames.append(one)
            bench.give(one)
    bench.pass_ticks(440)

    def transactional(frames: list[bytes]) -> list[bytes]:
        return [one for one in frames if state_key(one) is None or message_id(one) == 0]

    sent = [one for _, one in bench.sent]
    assert transactional(sent) == transactional(given_frames)
    newest: dict[Any, list[bytes]] = defaultdict(list)
    for one in given_frames:
        newest[state_key(one)].append(one)
    gone: dict[Any, list[bytes]] = defaultdict(list)
    for one in sent:
        gone[state_key(one)].append(one)
    for key, frames in newest.items():
        if key is None or key[2] == 0:
            continue
        assert gone[key][-1] == frames[-1], "the newest is out"
        rest = iter(frames)
        assert all(one in rest for one in gone[key]), "in order, none twice"


@given(
    profile=st.sampled_from([THIN, MINIMAL]),
    by_hand=st.booleans(),
    gaps=st.lists(st.integers(0, 30), min_size=20, max_size=200),
    kind=st.sampled_from(
        [
            attitude,
            lambda number: battery(0, number),
            lambda number: frame(mavlink.MAVLink_system_time_message(1, number)),
        ]
    ),
)
def test_no_rate_is_exceeded(profile: StreamProfile, by_hand: bool, gaps: list[int], kind: Any) -> None:
    bench = Bench(profile, by_hand=by_hand)
    for number, gap in enumerate(gaps):
        bench.give(kind(number))
        bench.pass_ticks(gap)
    bench.pass_ticks(400)
    every_s = beats_between(profile, message_id(kind(0)), by_hand=by_hand) * BEAT_S
    slots = [int(round(at, 6) / every_s + 1e-6) for at, _ in bench.sent]
    assert len(slots) == len(set(slots)), "one in each interval at most"
    assert all(payload(one) for _, one in bench.sent)
