"""The armed state that a hold relies on: recent starts, proofs of being on the ground, and arming by sticks."""

from itertools import pairwise
from typing import Any

import pytest

from onboard_agent.autopilot.disarm_proof import ASK_BEAT_S, PROOF_WITHIN_S, WATCH_S, DisarmProof
from onboard_agent.autopilot.own_frames import FrameMaker
from onboard_agent.autopilot.recent_start import COUNTS_FOR_S, RecentStart
from onboard_agent.failsafe.foreign_mode import FOREIGN_FOR_S, ForeignMode
from onboard_agent.sticks.arming_sticks import EVERY_S, ArmingSticks
from onboard_agent.sticks.stick_age import StickAge
from wire.control_messages import SafetySettings
from wire.dialect import decode, mavlink

ARM, TAKEOFF, START, SET_MODE = 400, 22, 300, 176
ACCEPTED, IN_PROGRESS, FAILED = 0, 5, 4


@pytest.mark.parametrize(
    ("command", "result", "counts"),
    [
        (ARM, ACCEPTED, True),
        (TAKEOFF, ACCEPTED, True),
        (TAKEOFF, IN_PROGRESS, True),
        (START, ACCEPTED, True),
        (ARM, FAILED, False),
        (SET_MODE, ACCEPTED, False),
    ],
)
def test_what_was_accepted_just_now_counts_as_armed(command: int, result: int, counts: bool) -> None:
    start = RecentStart()
    assert not start.counts_as_armed(10.0)
    start.acknowledged(mavlink.MAVLink_command_ack_message(command, result), 10.0)
    assert start.counts_as_armed(10.0 + COUNTS_FOR_S) is counts
    assert not start.counts_as_armed(10.1 + COUNTS_FOR_S)


def test_a_proof_is_asked_for_until_the_order_has_been_open_for_long_enough() -> None:
    proof = DisarmProof(FrameMaker())
    proof.begin(10.0)
    (frame,) = proof.due(10.0, vehicle_system_id=3)
    ask: Any = decode(frame)
    assert (ask.command, ask.param1, ask.target_system) == (512, mavlink.MAVLINK_MSG_ID_HEARTBEAT, 3)
    assert proof.due(10.0 + ASK_BEAT_S / 2, vehicle_system_id=3) == []
    assert len(proof.due(10.001 + ASK_BEAT_S, vehicle_system_id=3)) == 1
    assert not proof.failed(10.0 + PROOF_WITHIN_S / 2)
    assert proof.failed(10.0 + PROOF_WITHIN_S)
    proof.proved = True
    assert not proof.failed(10.0 + PROOF_WITHIN_S)
    assert not proof.over(9.9 + WATCH_S)
    assert proof.over(10.0 + WATCH_S)
    proof.begin(20.0)
    assert not proof.proved


def test_a_mode_is_foreign_once_it_was_shown_for_a_while() -> None:
    foreign = ForeignMode()
    foreign.shown(6, ours=17, now=10.0)
    assert foreign.mode(9.9 + FOREIGN_FOR_S) is None
    foreign.shown(6, ours=17, now=10.5)
    assert foreign.mode(10.01 + FOREIGN_FOR_S) == 6
    foreign.shown(9, ours=17, now=10.7)
    assert foreign.mode(10.8) is None, "another one begins again"
    foreign.shown(17, ours=17, now=10.9)
    assert foreign.mode(20.0) is None
    foreign.shown(6, ours=17, now=21.0)
    foreign.shown(6, ours=None, now=21.1)
    assert foreign.mode(30.0) is None, "not settled"
    foreign.shown(6, ours=17, now=31.0)
    foreign.forget()
    assert foreign.mode(40.0) is None


def test_sticks_at_rest_come_more_often_than_a_radio_failsafe_waits() -> None:
    arming = ArmingSticks(FrameMaker())
    sent: list[tuple[float, Any]] = []
    for step in range(80):
        now = 10.0 + step * 0.025
        frames = arming.due(now, wanted=step < 40, vehicle_system_id=3, ground_station_system_id=254)
        sent += [(now, decode(frame)) for frame in frames]
        assert arming.on is (step < 40)
    times = [now for now, _ in sent]
    assert times[0] == 10.0
    assert times[-1] < 11.0
    assert max(later - earlier for earlier, later in pairwise(times)) <= EVERY_S + 0.03
    assert {(m.x, m.y, m.z, m.r, m.target, m.get_srcSystem()) for _, m in sent} == {(0, 0, 0, 0, 3, 254)}


SETTINGS = SafetySettings(rtt_limit_ms=500.0, rtt_limit_s=1.0)


def test_sticks_are_too_old_once_they_have_been_for_as_long_as_the_settings_say() -> None:
    age = StickAge()
    age.came(0.26, 10.0, SETTINGS)
    age.came(0.40, 10.9, SETTINGS)
    assert not age.too_old(10.98, SETTINGS)
    assert age.too_old(11.0, SETTINGS)
    assert age.age_s == 0.40
    assert not age.too_old(11.1, SETTINGS), "once"


def test_sticks_count_from_when_they_became_too_old_on_their_way() -> None:
    age = StickAge()
    age.came(0.25, 10.0, SETTINGS)
    age.came(0.65, 10.4, SETTINGS)
    assert not age.too_old(10.98, SETTINGS)
    assert age.too_old(11.0, SETTINGS)


def test_sticks_that_are_fresh_enough_or_nobodys_begin_it_anew() -> None:
    age = StickAge()
    age.came(0.4, 10.0, SETTINGS)
    age.came(0.25, 10.5, SETTINGS)
    assert not age.too_old(11.2, SETTINGS)
    age.came(0.4, 12.0, SETTINGS)
    age.over()
    assert not age.too_old(14.0, SETTINGS)
