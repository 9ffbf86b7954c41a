"""Round trip, jitter and loss of both directions, as two ends of a simulated link measure them."""

import random

import pytest

from wire.content import Report
from wire.ids import DroneId, LinkId
from wire.link_quality import LinkQuality, Quality
from wire.sealed_link import SealedLink


def test_nothing_is_known_before_anything_came() -> None:
    assert LinkQuality(0.0).over(30.0, 5.0) == Quality()


def test_round_trip_and_jitter_are_those_of_the_window() -> None:
    quality = LinkQuality(0.0)
    for at, rtt in ((1.0, 0.9), (29.5, 0.1), (30.0, 0.2), (30.4, 0.1)):
        quality.round_trip(rtt, at)
    second = quality.over(1.0, 30.4)
    assert (second.rtt_s, second.jitter_s) == (pytest.approx(0.4 / 3), pytest.approx(0.1))
    long = quality.over(30.0, 30.4)
    assert (long.rtt_s, long.jitter_s) == (pytest.approx(1.3 / 4), pytest.approx(1.0 / 3))


def test_one_round_trip_has_no_jitter() -> None:
    quality = LinkQuality(0.0)
    quality.round_trip(0.1, 1.0)
    assert quality.over(1.0, 1.0).jitter_s is None


def test_the_loss_of_a_window_is_what_was_added_in_it() -> None:
    quality = LinkQuality(0.0)
    quality.receive_report(Report(100, 50), 10.0)
    quality.receive_report(Report(200, 140), 10.6)
    quality.receive_report(Report(300, 240), 11.1)
    assert quality.over(1.0, 11.2).loss_sent == pytest.approx(1 - 190 / 200)
    assert quality.over(30.0, 11.2).loss_sent == pytest.approx(0.2)
    assert quality.over(1.0, 11.2).loss_received is None


def test_a_report_that_was_overtaken_says_nothing() -> None:
    quality = LinkQuality(0.0)
    quality.receive_report(Report(100, 100), 10.0)
    quality.receive_report(Report(90, 20), 10.1)
    assert quality.over(1.0, 10.2).loss_sent == 0.0


def test_silence_is_a_loss_of_everything_and_old_reports_are_no_news() -> None:
    quality = LinkQuality(0.0)
    for tenths in range(0, 40, 5):
        now = 10.0 + tenths / 10
        quality.counted(Report(100, 100), now)
        if tenths == 0:
            quality.receive_report(Report(50, 50), now)
    second = quality.over(1.0, 13.6)
    assert second.loss_received == 1.0
    assert second.loss_sent is None


def test_both_ends_know_both_directions() -> None:
    """30 s of keep-alives and frames over a link that loses 20 % upwards and 5 % downwards, with 40 ms each way."""
    chance = random.Random(7)
    agent, tower = (
        SealedLink(link_id=LinkId(3), drone_id=DroneId(1), send_key=send, receive_key=receive, now=0.0)
        for send, receive in ((b"a" * 32, b"b" * 32), (b"b" * 32, b"a" * 32))
    )
    on_the_way: list[tuple[float, SealedLink, bytes]] = []
    for step in range(3300):
        now = step / 100
        arrived = [one for one in on_the_way if one[0] <= now]
        on_the_way = [one for one in on_the_way if one[0] > now]
        for _, receiver, datagram in arrived:
            receiver.receive(datagram, now)
        for sender, receiver, loss in ((agent, tower, 0.2), (tower, agent, 0.05)):
            datagrams = [*sender.datagrams_to_send(now), sender.seal_urgent(b"anything")]
            on_the_way += [(now + 0.04, receiver, datagram) for datagram in datagrams if chance.random() >= loss]
    at_agent, at_tower = agent.quality.over(30.0, 33.0), tower.quality.over(30.0, 33.0)
    assert at_agent.loss_sent == pytest.approx(0.2, abs=0.03)
    assert at_tower.loss_received == pytest.approx(0.2, abs=0.03)
    assert at_agent.loss_received == pytest.approx(0.05, abs=0.02)
    assert at_tower.loss_sent == pytest.approx(0.05, abs=0.02)
    assert at_agent.rtt_s == pytest.approx(0.08, abs=0.02)
    assert at_agent.jitter_s == pytest.approx(0.0, abs=0.01)


def test_what_is_older_than_the_long_window_is_forgotten_but_for_where_the_window_begins() -> None:
    """Otherwise a thousand links would keep a hundred megabytes of unused points."""
    quality = LinkQuality(0.0)
    for step in range(2000):
        now = step / 5
        quality.counted(Report(expected=step, received=step - step // 2), now)
        quality.receive_report(Report(expected=step, received=step), now)
        quality.round_trip(0.1, now)
    assert len(quality._received._points) <= 30 * 5 + 2
    assert len(quality._trips) <= 30 * 5 + 1
    assert quality.over(30.0, 1999 / 5).loss_received == pytest.approx(0.5, abs=0.01)
    assert quality.over(30.0, 1999 / 5).loss_sent == 0.0
