"""Which pictures are encoded for which viewers: shares, shapes, cadence, keys, breaks, and skipped pictures."""

from itertools import pairwise

import pytest

from onboard_agent.video.core.allotment import MIN_BPS, THIN_AFTER_S, Thinness, allot, max_bps, min_bps
from onboard_agent.video.core.cadence import Cadence
from onboard_agent.video.core.overshoot import Overshoot
from onboard_agent.video.core.shape_for_bits import UP_AFTER_S, ShapeForBits
from onboard_agent.video.core.streaming import Encoded, Order, Streaming
from wire.video import MAX_UNIT_BYTES, Codec, Quality, StreamRequest, decode_unit

LOW, MEDIUM, HIGH = (StreamRequest(quality, Codec.MPEG1) for quality in Quality)
HIGH_H264 = StreamRequest(Quality.HIGH, Codec.H264)


def test_with_enough_everybody_has_the_most() -> None:
    requests = [HIGH, LOW, MEDIUM]
    assert allot(10e6, requests) == {request: max_bps(request) for request in requests}


def test_the_higher_quality_gives_way_first() -> None:
    before = allot(10e6, [LOW, MEDIUM, HIGH])
    gave_way: list[StreamRequest] = []
    for budget in range(3_000_000, 0, -10_000):
        shares = allot(budget, [LOW, MEDIUM, HIGH])
        assert sum(shares.values()) <= max(budget, MIN_BPS)
        for request, share in shares.items():
            if share <= min_bps(request) and before[request] > min_bps(request):
                gave_way.append(request)
        before = shares
    assert gave_way == [HIGH, MEDIUM, LOW]


def test_below_everyones_least_the_higher_rests_and_the_last_one_never() -> None:
    assert allot(min_bps(LOW), [LOW, HIGH]) == {LOW: min_bps(LOW), HIGH: 0}
    assert allot(1_000, [HIGH]) == {HIGH: MIN_BPS}
    assert allot(50_000, [HIGH]) == {HIGH: 50_000}
    assert allot(1e6, []) == {}


def test_h264_needs_less_and_comes_first_of_the_same_quality() -> None:
    assert max_bps(HIGH_H264) < max_bps(HIGH)
    shares = allot(min_bps(HIGH_H264) + 20_000, [HIGH, HIGH_H264])
    assert shares == {HIGH_H264: min_bps(HIGH_H264), HIGH: 20_000}


def test_thin_after_a_while_and_not_for_a_moment() -> None:
    thinness = Thinness()
    assert not thinness.judge(min_bps(LOW) - 1, [LOW], 0.0)
    assert not thinness.judge(min_bps(LOW) - 1, [LOW], THIN_AFTER_S - 0.1)
    assert thinness.judge(min_bps(LOW) - 1, [LOW], THIN_AFTER_S)
    assert thinness.judge(min_bps(LOW) + 1, [LOW], 10.0), "no flicker"
    assert not thinness.judge(2 * min_bps(LOW), [LOW], 11.0)
    assert not thinness.judge(min_bps(LOW) - 1, [LOW], 12.0)
    assert not thinness.judge(0.0, [], 20.0), "nobody watches"


def test_first_bits_then_pictures_then_size() -> None:
    seen = []
    for bits in range(max_bps(MEDIUM), 10_000, -5_000):
        shape = ShapeForBits(MEDIUM).choose(bits, 0.0)
        assert shape.bits_per_s == bits
        if (shape.rate_hz, shape.scale) not in seen:
            seen.append((shape.rate_hz, shape.scale))
    assert seen[0] == (24.0, 1.0)
    rates, scales = zip(*seen, strict=True)
    assert list(rates) == sorted(rates, reverse=True)
    assert list(scales) == sorted(scales, reverse=True)
    assert seen.index((12.0, 1.0)) < next(place for place, scale in enumerate(scales) if scale < 1)


def test_a_shape_gets_worse_at_once_and_better_after_a_while() -> None:
    shapes = ShapeForBits(MEDIUM)
    full, little = max_bps(MEDIUM), max_bps(MEDIUM) // 8
    assert shapes.choose(full, 0.0).rate_hz == 24.0
    assert shapes.choose(little, 0.1).scale == 0.75
    assert shapes.choose(full, 0.2).scale == 0.75
    assert shapes.choose(little, 1.0).scale == 0.75
    assert shapes.choose(full, 1.1).scale == 0.75
    assert shapes.choose(full, 1.0 + UP_AFTER_S).scale == 0.75
    assert shapes.choose(full, 1.2 + UP_AFTER_S).scale == 1.0
    later = [shapes.choose(full, 1.3 + UP_AFTER_S * (2 + step)).rate_hz for step in range(4)]
    assert later[-1] == 24.0


def test_a_shape_gets_better_at_once_while_nothing_speaks_against_it() -> None:
    shapes = ShapeForBits(MEDIUM)
    assert shapes.choose(max_bps(MEDIUM) // 8, 0.0, is_free=True).scale == 0.75
    assert shapes.choose(max_bps(MEDIUM), 0.1, is_free=True).rate_hz == 24.0
    assert shapes.choose(max_bps(MEDIUM) // 5, 0.2, is_free=True).rate_hz == 12.0


@pytest.mark.parametrize(("camera_hz", "wanted_hz"), [(30, 24), (30, 12), (30, 30), (25, 24), (60, 24), (15, 24)])
def test_as_many_pictures_as_wanted_and_evenly(camera_hz: float, wanted_hz: float) -> None:
    cadence = Cadence()
    taken = [
        us for number in range(round(camera_hz * 10)) if cadence.takes(us := round(number * 1e6 / camera_hz), wanted_hz)
    ]
    assert len(taken) == pytest.approx(10 * min(camera_hz, wanted_hz), abs=3)
    gaps = [later - earlier for earlier, later in pairwise(taken)]
    assert max(gaps) <= 1e6 / min(camera_hz, wanted_hz) + 1e6 / camera_hz


def test_after_a_pause_nothing_is_made_up_for() -> None:
    cadence = Cadence()
    assert cadence.takes(0, 10)
    assert cadence.takes(5_000_000, 10)
    assert not cadence.takes(5_033_000, 10)
    assert cadence.takes(5_100_000, 10)


def test_an_encoder_that_makes_too_much_is_asked_for_less() -> None:
    overshoot = Overshoot()
    for number in range(24 * 20):
        overshoot.made(15_000, 240_000, number / 24)
    assert overshoot.factor == pytest.approx(1.5, abs=0.05)


def encoded(*, key: bool, size: int = 500, is_break: bool = False, at_us: int = 0) -> Encoded:
    return Encoded(b"x" * size, key, 320, 240, at_us, is_break)


def flow(streaming: Streaming, capture_us: int, *, is_break: bool = False) -> list[bytes]:
    """Acts as an encoder that makes a key when it must."""
    now = capture_us / 1e6 + 0.01
    units = []
    for order in streaming.orders(capture_us, now, is_break=is_break):
        one = encoded(key=order.force_key, is_break=order.is_break, at_us=capture_us)
        departure = streaming.unit(order, one, now)
        if departure is not None:
            units.append(departure.message)
            streaming.rate.got(departure.sent.got, now)
    return units


def test_a_stream_begins_with_a_key_and_counts_its_units() -> None:
    streaming = Streaming(0.0)
    assert streaming.orders(0, 0.0) == []
    streaming.watch([MEDIUM], 0.0)
    units = [decode_unit(unit) for number in range(24) for unit in flow(streaming, number * 41_667)]
    assert [unit.key for unit in units] == [True] + [False] * 23
    assert [unit.sequence for unit in units] == list(range(24))
    assert {(unit.quality, unit.codec, unit.held_ms, unit.rate_hz) for unit in units} == {
        (Quality.MEDIUM, Codec.MPEG1, 10, 24.0)
    }


def test_a_new_connection_begins_with_a_key_and_the_sequence_goes_on() -> None:
    streaming = Streaming(0.0)
    streaming.watch([MEDIUM], 0.0)
    flow(streaming, 0)
    order = streaming.orders(42_000, 0.05)[0]
    streaming.restart()
    assert streaming.unit(order, encoded(key=False), 0.06) is None, "its chain is broken"
    (unit,) = flow(streaming, 84_000)
    assert decode_unit(unit).key
    assert decode_unit(unit).is_break, "it does not matter whether the camera's first picture was taken before"
    assert decode_unit(unit).sequence == 1
    (unit,) = flow(streaming, 126_000)
    assert not decode_unit(unit).is_break
    streaming.watch([], 1.0)
    assert streaming.unit(order, encoded(key=True), 1.0) is None, "nobody watches any more"
    streaming.watch([MEDIUM], 2.0)
    (unit,) = flow(streaming, 2_000_000)
    assert decode_unit(unit).key
    assert decode_unit(unit).sequence == 3


def test_the_tower_asks_for_a_key_but_not_too_often() -> None:
    streaming = Streaming(0.0)
    streaming.watch([MEDIUM], 0.0)
    flow(streaming, 0)
    keys = 0
    for number in range(1, 25):
        streaming.key_wanted(MEDIUM, number / 24)
        keys += sum(decode_unit(unit).key for unit in flow(streaming, number * 41_667))
    assert 2 <= keys <= 4
    streaming.key_wanted(HIGH, 5.0)


def test_a_break_is_kept_for_the_streams_that_do_not_take_its_picture() -> None:
    streaming = Streaming(0.0)
    streaming.watch([LOW, HIGH], 0.0)
    flow(streaming, 0)
    reported: dict[Quality, list[bool]] = {Quality.LOW: [], Quality.HIGH: []}
    for number in range(1, 30):
        for unit in flow(streaming, number * 33_333, is_break=number == 4):
            reported[decode_unit(unit).quality].append(decode_unit(unit).is_break)
    assert reported[Quality.HIGH].count(True) == 1
    assert reported[Quality.LOW].count(True) == 1


def test_no_picture_is_encoded_that_would_come_late() -> None:
    streaming = Streaming(0.0)
    streaming.watch([MEDIUM], 0.0)
    for number in range(72):
        now = number / 24
        for order in streaming.orders(round(now * 1e6), now):
            streaming.unit(order, encoded(key=order.force_key, size=2_000), now)  # and no acknowledgement arrives
    assert streaming.left_out > 50
    assert streaming.rate.way.bits < 20 * 8 * 2_200


def test_an_encoder_that_failed_rests_and_begins_with_a_key() -> None:
    streaming = Streaming(0.0)
    streaming.watch([MEDIUM], 0.0)
    flow(streaming, 0)
    streaming.rest(MEDIUM, 1.0)
    assert streaming.orders(500_000, 0.5) == []
    (unit,) = flow(streaming, 1_100_000)
    assert decode_unit(unit).key


def test_a_unit_that_is_too_large_for_the_wire_is_not_sent_and_a_key_follows() -> None:
    streaming = Streaming(0.0)
    streaming.watch([HIGH], 0.0)
    (order,) = streaming.orders(0, 0.0)
    assert streaming.unit(order, encoded(key=True, size=MAX_UNIT_BYTES), 0.0) is None
    (order,) = streaming.orders(70_000, 0.07)
    assert order == Order(HIGH, order.shape, force_key=True, is_break=False)


def test_a_stream_that_rests_for_the_others_comes_back_with_a_key() -> None:
    streaming = Streaming(0.0)
    streaming.watch([LOW, HIGH], 0.0)
    flow(streaming, 0)
    streaming.rate._budget_bps = 50_000.0
    streaming.tick(0.1)
    qualities = {decode_unit(unit).quality for number in range(3, 30) for unit in flow(streaming, number * 33_333)}
    assert qualities == {Quality.LOW}
    streaming.rate._budget_bps = 3_000_000.0
    streaming.tick(2.0)
    high = [one for unit in flow(streaming, 2_000_000) if (one := decode_unit(unit)).quality is Quality.HIGH]
    assert [unit.key for unit in high] == [True]
