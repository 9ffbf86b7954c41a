"""Keep-alive: when pings are due, what the round trip and the loss are."""

import pytest

from wire.content import Ping, Pong
from wire.keepalive import ANSWER_WITHIN_S, PING_INTERVAL_S, REMEMBERED, Keepalive


def ping_at(keepalive: Keepalive, now: float) -> Ping:
    ping = keepalive.ping_due(now)
    assert ping is not None
    return ping


def pong_to(ping: Ping) -> Pong:
    return Pong(ping.sequence)


def test_pings_are_due_at_the_interval() -> None:
    keepalive = Keepalive(10.0)
    assert ping_at(keepalive, 10.0).sequence == 1
    assert keepalive.ping_due(10.0 + PING_INTERVAL_S - 0.01) is None
    assert keepalive.next_ping_at == 10.0 + PING_INTERVAL_S
    assert ping_at(keepalive, 10.0 + PING_INTERVAL_S).sequence == 2


def test_a_late_tick_does_not_make_a_burst() -> None:
    keepalive = Keepalive(0.0)
    ping_at(keepalive, 0.0)
    ping_at(keepalive, 60.0)
    assert keepalive.ping_due(60.1) is None


def test_the_round_trip_is_smoothed() -> None:
    keepalive = Keepalive(0.0)
    assert keepalive.rtt_s is None
    keepalive.pong(pong_to(ping_at(keepalive, 0.0)), 0.1)
    assert keepalive.rtt_s == pytest.approx(0.1)
    keepalive.pong(pong_to(ping_at(keepalive, 1.0)), 1.5)
    assert keepalive.rtt_s == pytest.approx(0.2)


def test_a_pong_that_nobody_waits_for_says_nothing() -> None:
    keepalive = Keepalive(0.0)
    pong = pong_to(ping_at(keepalive, 0.0))
    keepalive.pong(Pong(99), 0.1)
    assert keepalive.rtt_s is None
    keepalive.pong(pong, 0.1)
    keepalive.pong(pong, 9.0)
    assert keepalive.rtt_s == pytest.approx(0.1)


def test_the_loss_is_the_share_of_unanswered_pings() -> None:
    keepalive = Keepalive(0.0)
    assert keepalive.loss == 0.0
    for n in range(8):
        ping = ping_at(keepalive, float(n))
        if n % 2:
            keepalive.pong(pong_to(ping), n + 0.01)
    ping_at(keepalive, 7.0 + ANSWER_WITHIN_S)
    assert keepalive.loss == pytest.approx(0.5)


def test_the_loss_forgets() -> None:
    keepalive = Keepalive(0.0)
    ping_at(keepalive, 0.0)
    for n in range(1, REMEMBERED + 5):
        keepalive.pong(pong_to(ping_at(keepalive, n * 3.0)), n * 3.0 + 0.01)
    assert keepalive.loss == 0.0


def test_silence_is_counted_from_what_was_heard_last() -> None:
    keepalive = Keepalive(5.0)
    assert keepalive.silent_for(7.0) == 2.0
    keepalive.heard_at = 6.5
    assert keepalive.silent_for(7.0) == 0.5


def test_a_lost_ping_is_not_a_slow_one() -> None:
    keepalive = Keepalive(0.0)
    assert keepalive.ping_due(0.0) is not None
    second = keepalive.ping_due(0.5)
    assert second is not None
    assert keepalive.rtt_now_s(0.8) == 0.8
    keepalive.pong(pong_to(second), 0.8)
    assert abs(keepalive.rtt_now_s(1.4) - 0.3) < 1e-9
