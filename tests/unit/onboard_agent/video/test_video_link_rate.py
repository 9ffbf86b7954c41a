"""The rate control over modelled links: bounded delays, rates that settle, and recovery after a drop."""

from statistics import quantiles

import pytest
from model_video_uplink import Conditions, ModelUplink, Second

from onboard_agent.video.core.link_rate import (
    FIRST_BUDGET_BPS,
    FIRST_PACING_BPS,
    HOPED_SHARE,
    HOPELESS_S,
    MIN_BUDGET_BPS,
    STIR_FOR_S,
    WAITING_S,
    Known,
    LinkRate,
)
from wire.video import LIMITS, Codec, Got, Quality

SEEDS = range(1, 6)
HIGH_BPS, MEDIUM_BPS = 1.5e6, 450e3


def p95(seconds: list[Second]) -> float:
    return quantiles([age for second in seconds for age in second.ages_s], n=20)[-1]


def mean_bps(seconds: list[Second]) -> float:
    return sum(second.got_bps for second in seconds) / len(seconds)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(
    ("conditions", "ceiling_bps", "rate_hz", "min_bps", "age_p95_s", "queue_s"),
    [
        pytest.param(Conditions(2e6), HIGH_BPS, 30, 1.1e6, 0.15, 0.08, id="2M"),
        pytest.param(Conditions(2e6, rtt_s=0.05), MEDIUM_BPS, 24, 0.4e6, 0.08, 0.05, id="2M-medium"),
        pytest.param(Conditions(1e6, rtt_s=0.15), MEDIUM_BPS, 24, 0.4e6, 0.17, 0.08, id="3G"),
        pytest.param(Conditions(1e6, rtt_s=0.15), HIGH_BPS, 30, 0.5e6, 0.25, 0.12, id="3G-high"),
        pytest.param(Conditions(300e3, rtt_s=0.15), MEDIUM_BPS, 24, 0.17e6, 0.32, 0.2, id="300k"),
        pytest.param(Conditions(10e6, loss=0.01), MEDIUM_BPS, 24, 0.4e6, 0.15, 0.05, id="4G"),
        pytest.param(Conditions(2e6, loss=0.01, jitter_s=0.01), HIGH_BPS, 30, 1.0e6, 0.25, 0.12, id="lossy"),
        pytest.param(Conditions(10e6, stalls_s=0.3), MEDIUM_BPS, 24, 0.25e6, 0.15, 0.05, id="busy"),
        pytest.param(Conditions(2e6, other_bps=1e6), HIGH_BPS, 30, 0.5e6, 0.2, 0.12, id="shared"),
    ],
)
def test_it_settles(
    conditions: Conditions,
    ceiling_bps: float,
    rate_hz: float,
    min_bps: float,
    age_p95_s: float,
    queue_s: float,
    seed: int,
) -> None:
    model = ModelUplink(ceiling_bps=ceiling_bps, rate_hz=rate_hz, seed=seed)
    model.run(conditions, 10)
    settled = model.run(conditions, 30)
    assert mean_bps(settled) >= min_bps
    assert p95(settled) <= age_p95_s
    assert max(second.worst_queue_s for second in settled) <= queue_s
    budgets = [min(ceiling_bps, second.budget_bps) for second in settled]
    assert max(budgets) <= 2.2 * min(budgets), "it swings"


@pytest.mark.parametrize("seed", range(1, 13))
@pytest.mark.parametrize(("rate_bps", "ceiling_bps", "rate_hz"), [(10e6, MEDIUM_BPS, 24), (2e6, HIGH_BPS, 30)])
def test_packets_that_are_lost_twice_are_no_slow_link(
    rate_bps: float, ceiling_bps: float, rate_hz: float, seed: int
) -> None:
    model = ModelUplink(ceiling_bps=ceiling_bps, rate_hz=rate_hz, seed=seed)
    seconds = model.run(Conditions(rate_bps, loss=0.01, time_outs=0.5), 40)
    assert mean_bps(seconds[8:]) > 0.7 * ceiling_bps
    assert sum(second.budget_bps < 0.4 * ceiling_bps for second in seconds) <= 3


@pytest.mark.parametrize("seed", SEEDS)
def test_a_sudden_drop_to_a_tenth_and_the_way_back(seed: int) -> None:
    model = ModelUplink(ceiling_bps=HIGH_BPS, rate_hz=30, seed=seed)
    model.run(Conditions(2e6), 20)
    dropped = model.run(Conditions(200e3), 20)
    # What is in the network by then cannot be recalled: it has drained after two seconds.
    assert max(second.worst_age_s for second in dropped) < 2.5
    assert p95(dropped[4:]) < 0.45
    assert mean_bps(dropped[4:]) > 100e3
    assert all(second.budget_bps < 200e3 for second in dropped[2:])
    back = model.run(Conditions(2e6), 40)
    assert p95(back) < 0.3
    assert mean_bps(back[20:]) > 1.1e6


@pytest.mark.parametrize("seed", SEEDS)
def test_a_link_without_bounds_is_used_at_once(seed: int) -> None:
    model = ModelUplink(ceiling_bps=HIGH_BPS, rate_hz=30, seed=seed)
    seconds = model.run(Conditions(100e6, rtt_s=0.002, jitter_s=0.002), 15)
    assert min(second.budget_bps for second in seconds[4:]) > HIGH_BPS
    assert seconds[-1].pacing_bps > 20e6
    assert p95(seconds[8:]) < 0.01
    assert model.rate.queues == 0


STARTS = [  # the worst age, the worst queue, and when all pictures must arrive
    pytest.param(Conditions(300e3, rtt_s=0.15), Quality.LOW, 0.35, 0.2, 0.1, id="300k-low"),
    pytest.param(Conditions(300e3, rtt_s=0.15), Quality.HIGH, 0.75, 0.65, None, id="300k-high"),
    pytest.param(Conditions(1e6, rtt_s=0.15), Quality.MEDIUM, 0.18, 0.07, 0.1, id="3G-medium"),
    pytest.param(Conditions(1e6, rtt_s=0.15), Quality.HIGH, 0.38, 0.26, None, id="3G-high"),
    pytest.param(Conditions(2e6, rtt_s=0.01), Quality.HIGH, 0.15, 0.1, 1.1, id="2M-high"),
    pytest.param(Conditions(100e6, rtt_s=0.002, jitter_s=0.002), Quality.HIGH, 0.15, 0.05, 1.1, id="free-high"),
]


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(("conditions", "quality", "age_s", "queue_s", "whole_rate_s"), STARTS)
def test_it_begins_without_a_queue_and_has_all_pictures_within_a_second(
    conditions: Conditions, quality: Quality, age_s: float, queue_s: float, whole_rate_s: float | None, seed: int
) -> None:
    limits = LIMITS[quality]
    model = ModelUplink(ceiling_bps=limits.bits_per_s, rate_hz=limits.rate_hz, seed=seed, shaped=quality)
    begun = model.run(conditions, 8)
    assert max(second.worst_age_s for second in begun) <= age_s
    assert max(second.worst_queue_s for second in begun) <= queue_s
    if whole_rate_s is not None:
        assert model.whole_rate_at is not None
        assert model.whole_rate_at <= whole_rate_s


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(("rate_bps", "rtt_s"), [(2e6, 0.01), (100e6, 0.002), (10e6, 0.05)])
def test_another_stream_over_the_same_link_begins_where_the_last_one_was(
    rate_bps: float, rtt_s: float, seed: int
) -> None:
    model = ModelUplink(ceiling_bps=HIGH_BPS, rate_hz=30, seed=seed, shaped=Quality.HIGH)
    conditions = Conditions(rate_bps, rtt_s=rtt_s)
    model.run(conditions, 15)
    model.another_stream(model.rate.known)
    again_at = model.now
    first = model.run(conditions, 1)
    assert model.whole_rate_at is not None
    assert model.whole_rate_at - again_at <= 0.25
    assert first[0].pictures >= 25
    assert max(second.worst_age_s for second in first + model.run(conditions, 9)) < 0.25


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(("rate_bps", "age_s"), [(300e3, 0.85), (1e6, 0.45)])
def test_a_link_that_has_become_thin_meanwhile_is_not_believed_to_be_what_it_was(
    rate_bps: float, age_s: float, seed: int
) -> None:
    model = ModelUplink(ceiling_bps=HIGH_BPS, rate_hz=30, seed=seed, shaped=Quality.HIGH)
    model.run(Conditions(10e6, rtt_s=0.15), 15)
    model.another_stream(model.rate.known)
    begun = model.run(Conditions(rate_bps, rtt_s=0.15), 8)
    assert max(second.worst_age_s for second in begun) <= age_s


def test_what_is_known_of_a_link() -> None:
    rate = LinkRate(0.0)
    assert rate.known is None
    assert rate.is_free(0.0)
    rate.begin(0.0, Known(2e6, 1.5e6, 2.1e6, 0.05))
    assert rate.known is None, "not shown to be so still"
    assert rate.budget_bps == FIRST_BUDGET_BPS
    sent = rate.sent(got(1), 9_000, 0.0)
    rate.got(got(1), sent.leaves_at + 0.06)
    assert rate.known is not None
    assert rate.budget_bps == pytest.approx(HOPED_SHARE * 1.5e6, rel=0.05)
    assert rate.is_free(0.3)
    assert not rate.is_free(1.0), "a bound was met"
    rate.begin(10.0)
    assert (rate.pacing_bps, rate.budget_bps, rate.is_free(10.0)) == (FIRST_PACING_BPS, FIRST_BUDGET_BPS, True)
    rate.begin(20.0, Known(100e6, 75e6, None, 0.05))
    sent = rate.sent(got(2), 9_000, 20.0)
    rate.got(got(2), sent.leaves_at + 0.12)
    assert rate.pacing_bps == FIRST_PACING_BPS
    assert rate.budget_bps < 1.1 * FIRST_BUDGET_BPS


def test_nothing_at_all_gets_through() -> None:
    model = ModelUplink(ceiling_bps=MEDIUM_BPS)
    model.run(Conditions(1e6), 5)
    now = model.now
    assert not model.rate.is_hopeless(now)
    pictures = 0
    while not model.rate.is_hopeless(now):
        if model.rate.has_room(now):
            model.rate.sent(got(100_000 + pictures), 1500, now)
            pictures += 1
        now += 1 / 24
    assert now - model.now < HOPELESS_S + 1
    assert pictures < 10, "they would all be late"
    model.rate.reconnected(now)
    assert model.rate.has_room(now)
    assert model.rate.pacing_bps <= FIRST_PACING_BPS
    assert not model.rate.is_hopeless(now + 60)


def test_what_is_overdue_is_stirred_for_a_while() -> None:
    rate = LinkRate(0.0)
    for number in range(5):
        sent = rate.sent(got(number), 1500, float(number))
        assert not rate.is_overdue(sent.leaves_at + 0.05), "as long as the way takes"
        rate.got(got(number), sent.leaves_at + 0.05)
    assert not rate.is_overdue(9.0), "nothing is on its way"
    sent = rate.sent(got(9), 1500, 9.0)
    overdue = [rate.is_overdue(sent.leaves_at + after) for after in (0.05, 0.2, 1.0, STIR_FOR_S + 0.1)]
    assert overdue == [False, True, True, False]


def test_a_longer_way_is_not_a_queue_for_ever() -> None:
    model = ModelUplink(ceiling_bps=MEDIUM_BPS)
    model.run(Conditions(5e6, rtt_s=0.05), 15)
    further = model.run(Conditions(5e6, rtt_s=0.4), 30)
    assert mean_bps(further[20:]) > 300e3


def test_a_large_picture_keeps_the_next_ones_back_until_it_has_left() -> None:
    rate = LinkRate(0.0)
    rate.sent(got(1), 20_000, 0.0)
    assert not rate.has_room(0.05)
    assert rate.has_room(20_000 * 8 * 1.06 / FIRST_PACING_BPS - WAITING_S + 0.01)


def test_answers_to_nothing_change_nothing() -> None:
    rate = LinkRate(0.0)
    before = rate.pacing_bps, rate.budget_bps
    for number in range(100):
        rate.got(got(number), number / 10)
    assert (rate.pacing_bps, rate.budget_bps) == before
    assert rate.budget_bps >= MIN_BUDGET_BPS


def got(number: int) -> Got:
    return Got(Quality.MEDIUM, Codec.MPEG1, number)
