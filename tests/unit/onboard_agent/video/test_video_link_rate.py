"""The rate control over modelled links: delays bounded, rates that settle, and a way back after a drop."""

from statistics import quantiles

import pytest
from model_video_uplink import Conditions, ModelUplink, Second

from onboard_agent.video.link_rate import (
    FIRST_PACING_BPS,
    HOPELESS_S,
    LEAST_BUDGET_BPS,
    WAITING_S,
    LinkRate,
)
from wire.video import Codec, Got, Quality

SEEDS = range(1, 6)
HIGH_BPS, MEDIUM_BPS = 1.5e6, 450e3


def p95(seconds: list[Second]) -> float:
    return quantiles([age for second in seconds for age in second.ages_s], n=20)[-1]


def mean_bps(seconds: list[Second]) -> float:
    return sum(second.got_bps for second in seconds) / len(seconds)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(
    ("conditions", "ceiling_bps", "rate_hz", "least_bps", "age_p95_s", "queue_s"),
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
    least_bps: float,
    age_p95_s: float,
    queue_s: float,
    seed: int,
) -> None:
    model = ModelUplink(ceiling_bps=ceiling_bps, rate_hz=rate_hz, seed=seed)
    model.run(conditions, 10)
    settled = model.run(conditions, 30)
    assert mean_bps(settled) >= least_bps
    assert p95(settled) <= age_p95_s
    assert max(second.worst_queue_s for second in settled) <= queue_s
    budgets = [min(ceiling_bps, second.budget_bps) for second in settled]
    assert max(budgets) <= 2.2 * min(budgets), "it swings"


@pytest.mark.parametrize("seed", SEEDS)
def test_a_sudden_drop_to_a_tenth_and_the_way_back(seed: int) -> None:
    model = ModelUplink(ceiling_bps=HIGH_BPS, rate_hz=30, seed=seed)
    model.run(Conditions(2e6), 20)
    dropped = model.run(Conditions(200e3), 20)
    # What is in the network by then cannot be taken back: it is away after two seconds.
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
    assert rate.budget_bps >= LEAST_BUDGET_BPS


def got(number: int) -> Got:
    return Got(Quality.MEDIUM, Codec.MPEG1, number)
