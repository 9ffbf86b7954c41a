"""A link with keep-alives alone, both ends, in steps of a tenth of a second: its cost and its measurements."""

import pytest

from wire.drops import Dropped
from wire.ids import DroneId, LinkId
from wire.keepalive import LEISURE_S
from wire.sealed_link import SealedLink
from wire.transport_choice import Transport, TransportChoice

OFFLINE_AFTER_S = 3.0
"""server.link.core.agent_link.SILENT_AFTER_S, which chance losses must not reach."""
WAY_S = 0.02


class IdleLink:
    """`closely`: the tower pings too. The agent's datagrams with the numbers in `lost` (from 0) do not arrive."""

    def __init__(self, *, closely: bool = False) -> None:
        keys = b"a" * 32, b"b" * 32
        ends = {"link_id": LinkId(7), "drone_id": DroneId(1), "now": 0.0}
        self.agent = SealedLink(send_key=keys[0], receive_key=keys[1], **ends)  # type: ignore[arg-type]
        self.tower = SealedLink(send_key=keys[1], receive_key=keys[0], leads=False, **ends)  # type: ignore[arg-type]
        self.agent.keepalive.at_leisure(True)
        self.tower.keepalive.watch_closely(closely, 0.0)
        self.choice = TransportChoice(0.0)
        self.lost: set[int] = set()
        self.cut = False
        self.up = self.down = 0
        self.longest_silence_s = 0.0
        self.tenth = 0

    @property
    def now(self) -> float:
        return self.tenth / 10

    def live(self, for_s: float) -> None:
        for _ in range(round(for_s * 10)):
            self.tenth += 1
            self.choice.tick(self.now)
            self._send_up(self.now)
            self._send_down(self.now)
            self.longest_silence_s = max(self.longest_silence_s, self.tower.keepalive.silent_for(self.now))

    def _send_up(self, now: float) -> None:
        for datagram in self.agent.datagrams_to_send(now):
            self.up += 1
            if not self.cut and self.up - 1 not in self.lost:
                self.tower.receive(datagram, now + WAY_S)

    def _send_down(self, now: float) -> None:
        for datagram in self.tower.datagrams_to_send(now + WAY_S):
            self.down += 1
            if self.cut:
                continue
            try:
                received = self.agent.receive(datagram, now + 2 * WAY_S)
            except Dropped:  # pragma: no cover
                pytest.fail("an authentic datagram was refused")
            if received.proof:
                rests_s = self.agent.keepalive.rests_s
                self.choice.proven(Transport.UDP, now + 2 * WAY_S, rests_s=rests_s)
            self._send_up(now + 2 * WAY_S)


def test_nobody_there_is_one_datagram_a_second_each_way() -> None:
    link = IdleLink()
    link.live(60.0)
    assert link.up == link.down == pytest.approx(60 / LEISURE_S, abs=2)
    assert link.agent.keepalive.rtt_s == pytest.approx(2 * WAY_S)
    assert link.tower.keepalive.rtt_s == pytest.approx(2 * WAY_S)


def test_somebody_there_is_two_pings_a_second_from_both_sides() -> None:
    link = IdleLink(closely=True)
    link.live(60.0)
    assert link.up == pytest.approx(240, abs=10)
    assert link.down == pytest.approx(240, abs=10)


def test_somebody_who_comes_is_noticed_at_once() -> None:
    link = IdleLink()
    link.live(10.0)
    before = link.up
    link.tower.keepalive.watch_closely(True, link.now)
    link.live(2.0)
    assert link.up - before >= 7, "answers and pings of its own"


@pytest.mark.parametrize("after_s", [n / 10 for n in range(10)])
def test_udp_that_is_cut_is_left_within_3_s_whenever_it_happens(after_s: float) -> None:
    link = IdleLink()
    link.live(10.0 + after_s)
    link.cut = True
    cut_at = link.now
    while link.choice.transport is Transport.UDP:
        link.live(0.1)
        assert link.now - cut_at < 2.5


def test_lost_pings_are_made_good_before_the_drone_counts_as_offline_or_udp_as_blocked() -> None:
    link = IdleLink()
    link.live(20.0)
    assert link.longest_silence_s < 1.2
    link.lost = {link.up, link.up + 1}
    link.live(30.0)
    assert link.longest_silence_s < OFFLINE_AFTER_S - 0.8
    assert link.choice.transport is Transport.UDP


def test_the_quality_is_known_all_the_time_and_tells_a_loss() -> None:
    link = IdleLink()
    link.live(5.0)
    for _ in range(200):
        link.live(0.1)
        for end in (link.agent, link.tower):
            quality = end.quality.over(end.short_window_s(), link.now + 2 * WAY_S)
            assert quality.rtt_s == pytest.approx(2 * WAY_S)
            assert (quality.loss_sent, quality.loss_received) == (0.0, 0.0)
    link.lost = {link.up}
    link.live(1.7)
    quality = link.tower.quality.over(link.tower.short_window_s(), link.now)
    assert quality.loss_received == pytest.approx(0.5, abs=0.17)
    link.cut = True
    link.live(5.0)
    assert link.tower.quality.over(link.tower.short_window_s(), link.now).loss_received in (None, 1.0)
