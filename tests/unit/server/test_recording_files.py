"""A recording on disk, the times of its pictures, and the values parsed from units of both codecs."""

import itertools
from io import BytesIO

import pytest
from hypothesis import given
from hypothesis import strategies as st
from worlds.camera_units import units

from server.video.core.recordings.units import (
    ENTRY_BYTES,
    MAGIC,
    TICKS_PER_S,
    NoRecording,
    Taken,
    entry_of,
    first_lag_us,
    parameter_sets,
    read_entries,
    shown_times,
    taken_us,
)
from wire.transport_stream import MalformedPackets, pictures_in, video_in
from wire.video import Codec, decode_unit

US = 1_000_000
MESSAGES = units(Codec.H264, [US + number * 40_000 for number in range(5)])
FILE = MAGIC + b"".join(entry_of(message, 7 + number) for number, message in enumerate(MESSAGES))


def read(content: bytes) -> list[tuple[int, int]]:
    return [(entry.came_us, entry.unit.sequence) for entry in read_entries(BytesIO(content))]


def test_what_was_appended_is_read_back() -> None:
    assert read(FILE) == [(7, 0), (8, 1), (9, 2), (10, 3), (11, 4)]
    assert [entry.unit for entry in read_entries(BytesIO(FILE))] == [decode_unit(message) for message in MESSAGES]


def test_a_file_that_breaks_off_anywhere_gives_what_is_whole() -> None:
    ends = [len(MAGIC)]
    for message in MESSAGES:
        ends.append(ends[-1] + ENTRY_BYTES + len(message))
    for length in range(len(MAGIC), len(FILE) + 1):
        assert len(read(FILE[:length])) == sum(end <= length for end in ends[1:])


@pytest.mark.parametrize("tail", [bytes(4000), b"\xff" * 50, FILE[:100]], ids=["zeros", "ones", "another"])
def test_rubbish_behind_what_is_whole_is_not_read(tail: bytes) -> None:
    assert len(read(FILE + tail)) == 5


def test_a_unit_that_has_changed_on_the_disk_ends_the_reading() -> None:
    at = len(MAGIC) + ENTRY_BYTES + len(MESSAGES[0]) + ENTRY_BYTES + 60
    assert len(read(FILE[:at] + bytes([FILE[at] ^ 1]) + FILE[at + 1 :])) == 1


def test_another_file_is_no_recording() -> None:
    for content in (b"", MAGIC[:-1], b"GIF89a" + FILE):
        with pytest.raises(NoRecording):
            read(content)


def taken(*times_us: int, rate_hz: float = 25.0, late_us: int = 50_000) -> list[Taken]:
    return [Taken(at, at + late_us, rate_hz) for at in times_us]


def in_ms(times: list[Taken]) -> list[tuple[int, int]]:
    return [(one.at * 1000 // TICKS_PER_S, one.lasts * 1000 // TICKS_PER_S) for one in shown_times(times)]


def test_pictures_are_shown_as_they_were_taken_also_through_pauses_and_other_rates() -> None:
    times = taken(5 * US, 5 * US + 40_000, 5 * US + 80_000, 65 * US, 65 * US + 100_000, 65 * US + 200_000, rate_hz=10)
    assert in_ms(times) == [(0, 40), (40, 40), (80, 59_920), (60_000, 100), (60_100, 100), (60_200, 100)]


def test_one_picture_lasts_as_long_as_its_rate_says() -> None:
    assert in_ms(taken(9 * US)) == [(0, 40)]
    assert shown_times([]) == []


def test_where_the_capture_is_not_known_it_is_guessed_from_the_arrival() -> None:
    first = [Taken(0, 10 * US, 25.0), Taken(0, 10 * US + 40_000, 25.0)]
    later = [Taken(10 * US + 50_000, 10 * US + 80_000, 25.0), Taken(10 * US + 90_000, 10 * US + 220_000, 25.0)]
    # The minimum delay, 30 ms, is subtracted from pictures without a known capture time.
    assert [at for at, _ in in_ms(first + later)] == [0, 40, 80, 120]
    assert [at for at, _ in in_ms(first)] == [0, 40]


def test_times_that_cannot_be_are_not_believed_and_time_never_goes_back() -> None:
    wild = [
        *taken(100 * US, 100 * US + 40_000),
        Taken(9_000 * US, 100 * US + 140_000, 25.0),
        Taken(1, 100 * US + 180_000, 25.0),
    ]
    assert [at for at, _ in in_ms(wild)] == [0, 40, 90, 130]
    back = taken(10 * US, 10 * US + 40_000, 10 * US + 20_000)
    assert [at for at, _ in in_ms(back)] == [0, 40, 41]


@given(st.lists(st.tuples(st.integers(0, 1 << 64 - 1), st.integers(0, 1 << 50)), min_size=1, max_size=40))
def test_whatever_the_clocks_say_time_goes_on(times: list[tuple[int, int]]) -> None:
    shown = shown_times([Taken(capture, came, 24.0) for capture, came in times])
    assert len(shown) == len(times)
    assert shown[0].at == 0
    assert all(one.lasts > 0 for one in shown)
    assert all(one.at + one.lasts == after.at for one, after in itertools.pairwise(shown))


def test_the_pictures_of_mpeg_units_come_out_whole() -> None:
    found = [
        video_in(decode_unit(message).payload) for message in units(Codec.MPEG1, [US + 40_000 * n for n in range(6)])
    ]
    assert [len(pictures_in(stream)) for stream in found] == [1] * 6
    assert pictures_in(found[0])[0][:4] == b"\x00\x00\x01\xb3"
    assert pictures_in(found[1])[0][:4] == b"\x00\x00\x01\x00"
    both = pictures_in(found[1] + found[0] + found[2])
    assert both == [found[1], found[0], found[2]]
    assert pictures_in(found[1] + b"\x00\x00\x01\xb3rest") == [found[1]]
    assert pictures_in(b"") == []


@given(st.binary(max_size=189 * 3))
def test_packets_that_are_none_are_refused(packets: bytes) -> None:
    whole = packets[: len(packets) // 188 * 188]
    if whole and any(whole[at] != 0x47 for at in range(0, len(whole), 188)):
        with pytest.raises(MalformedPackets):
            video_in(whole)
    if len(packets) % 188:
        with pytest.raises(MalformedPackets):
            video_in(packets)
    marked = b"".join(b"\x47" + whole[at + 1 : at + 188] for at in range(0, len(whole), 188))
    assert len(video_in(marked)) <= len(marked)


def test_parameter_sets_are_found_at_key_pictures_and_differ_with_the_size() -> None:
    payloads = [decode_unit(message).payload for message in MESSAGES]
    sets = parameter_sets(payloads[0])
    assert [one[0] & 0x1F for one in sets] == [7, 8]
    assert parameter_sets(payloads[1]) == ()
    larger = parameter_sets(decode_unit(units(Codec.H264, [US], width=640, height=480)[0]).payload)
    assert len(larger) == 2
    assert larger != sets
    assert parameter_sets(b"") == parameter_sets(b"\x00\x00\x01") == ()


def test_a_file_begins_when_its_first_picture_was_taken() -> None:
    known = [Taken(5 * US + number * 40_000, 5 * US + number * 40_000 + 90_000, 25.0) for number in range(3)]
    assert (taken_us(known[0]), first_lag_us(known)) == (5 * US, 0)
    # The clocks were not compared yet when the first one came: the least delay of the others places it.
    guessed = [known[0]._replace(capture_us=0), *known[1:]]
    assert (taken_us(guessed[0]), first_lag_us(guessed)) == (5 * US + 90_000, 90_000)
    absurd = [known[0]._replace(capture_us=US), *known[1:]]
    absurd[0] = absurd[0]._replace(came_us=absurd[0].capture_us + 31 * US)
    assert (taken_us(absurd[0]), first_lag_us(absurd)) == (32 * US, 90_000)
    nothing_known = [one._replace(capture_us=0) for one in known]
    assert (taken_us(nothing_known[0]), first_lag_us(nothing_known)) == (5 * US + 90_000, 0)
