"""Keep-alive: when pings are due, and the measured round trip and loss."""

import pytest

from wire.content import Ping, Pong
from wire.keepalive import ANSWER_WITHIN_S, CLOSE_S, LEISURE_S, PING_INTERVAL_S, REMEMBERED, Keepalive


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


def leisurely() -> Keepalive:
    """Its first ping has been answered."""
    keepalive = Keepalive(0.0)
    keepalive.at_leisure(True)
    keepalive.pong(pong_to(ping_at(keepalive, 0.0)), 0.1)
    return keepalive


def test_at_leisure_what_was_answered_is_asked_again_later() -> None:
    keepalive = leisurely()
    assert keepalive.next_ping_at == LEISURE_S
    assert keepalive.rests_s == LEISURE_S - PING_INTERVAL_S
    keepalive.at_leisure(False)
    assert keepalive.next_ping_at == PING_INTERVAL_S, "somebody has the controls now"
    assert keepalive.rests_s > 0.0, "nothing was due until now"
    keepalive.pong(pong_to(ping_at(keepalive, 0.5)), 0.6)
    assert (keepalive.next_ping_at, keepalive.rests_s) == (1.0, 0.0)


def test_at_leisure_what_was_not_answered_is_asked_again_as_soon_as_ever() -> None:
    keepalive = leisurely()
    lost = ping_at(keepalive, 1.0)
    assert keepalive.next_ping_at == 1.5
    late = ping_at(keepalive, 1.5)
    keepalive.pong(pong_to(lost), 1.6)
    assert keepalive.next_ping_at == 2.0, "the newest one is still open"
    keepalive.pong(pong_to(late), 1.7)
    assert keepalive.next_ping_at == 2.5


def test_there_is_no_leisure_while_the_other_side_pings_and_a_little_longer() -> None:
    keepalive = leisurely()
    keepalive.receive_ping(Ping(1), 0.3)
    assert keepalive.next_ping_at == PING_INTERVAL_S
    now = 0.5
    while keepalive.next_ping_at - now <= PING_INTERVAL_S:
        now = keepalive.next_ping_at
        keepalive.pong(pong_to(ping_at(keepalive, now)), now)
        assert now < 0.3 + CLOSE_S + 1.0
    assert keepalive.next_ping_at == now + LEISURE_S
    assert now >= 0.3 + CLOSE_S


def test_a_way_that_has_changed_is_told_at_once_at_leisure_too() -> None:
    keepalive = leisurely()
    ping = ping_at(keepalive, 1.0)
    keepalive.hurry(1.1)
    keepalive.pong(pong_to(ping), 1.2)
    assert keepalive.next_ping_at == 1.1


def test_the_side_that_does_not_lead_allows_for_a_rest_unless_it_pings_itself() -> None:
    keepalive = Keepalive(0.0, leads=False)
    keepalive.at_leisure(True)
    assert keepalive.next_ping_at == float("inf")
    assert keepalive.rests_s == LEISURE_S - PING_INTERVAL_S
    keepalive.watch_closely(True, 1.0)
    assert keepalive.rests_s == 0.0
