"""When an agent switches from UDP to the WebSocket, and when it goes back."""

import pytest

from wire.transport_choice import (
    ANSWERS_IN_A_ROW_WITHIN_S,
    FALL_BACK_AFTER_S,
    IN_DOUBT_AFTER_S,
    MAX_NEEDED,
    SOON_S,
    Transport,
    TransportChoice,
)

UDP, WEBSOCKET = Transport.UDP, Transport.WEBSOCKET


def fallen_back(now: float = 2.0) -> TransportChoice:
    """The WebSocket works, as was proven at once."""
    choice = TransportChoice(0.0)
    choice.tick(now)
    assert choice.transport is WEBSOCKET
    choice.proven(WEBSOCKET, now)
    return choice


def test_udp_stays_for_as_long_as_there_is_proof() -> None:
    choice = TransportChoice(0.0)
    for n in range(100):
        now = n * FALL_BACK_AFTER_S
        choice.tick(now)
        assert choice.transport is UDP
        choice.proven(UDP, now)


def test_without_proof_the_websocket_is_taken() -> None:
    choice = TransportChoice(0.0)
    choice.tick(FALL_BACK_AFTER_S)
    assert choice.transport is UDP
    choice.proven(WEBSOCKET, FALL_BACK_AFTER_S)
    choice.tick(FALL_BACK_AFTER_S + 0.01)
    assert choice.transport is WEBSOCKET, "what arrived over the WebSocket proves nothing of UDP"


def test_probes_go_out_in_doubt_and_over_the_websocket_only() -> None:
    choice = TransportChoice(0.0)
    assert not choice.probe_due(IN_DOUBT_AFTER_S)
    times = [n / 100 for n in range(76, 151)]
    sent = [now for now in times if choice.probe_due(now)]
    assert len(sent) == 4
    choice = fallen_back()
    sent = []
    for n in range(200, 400):
        choice.proven(WEBSOCKET, n / 100)
        sent += [n / 100] if choice.probe_due(n / 100) else []
    assert len(sent) == 4


def test_answers_in_a_row_lead_back() -> None:
    choice = fallen_back()
    choice.proven(WEBSOCKET, 2.4)
    choice.probe_answered(2.5)
    assert choice.transport is WEBSOCKET
    choice.proven(WEBSOCKET, 2.9)
    choice.probe_answered(3.0)
    assert choice.transport is UDP


def test_a_gap_begins_the_row_anew() -> None:
    choice = fallen_back()
    now = 2.5
    for _ in range(5):
        choice.proven(WEBSOCKET, now)
        choice.probe_answered(now)
        assert choice.transport is WEBSOCKET
        now += ANSWERS_IN_A_ROW_WITHIN_S + 0.01


def test_one_answer_is_enough_where_the_websocket_is_dead() -> None:
    choice = fallen_back(2.0)
    choice.probe_answered(2.0 + IN_DOUBT_AFTER_S + 0.1)
    assert choice.transport is UDP


def test_until_the_websocket_is_proven_datagrams_go_both_ways_and_one_answer_leads_back() -> None:
    choice = TransportChoice(0.0)
    assert not choice.both(5.0), "over UDP there is one way"
    choice.tick(2.0)
    assert choice.transport is WEBSOCKET
    assert choice.both(2.1)
    choice.proven(WEBSOCKET, 2.3)
    assert not choice.both(2.4)
    assert choice.both(2.4 + IN_DOUBT_AFTER_S)
    choice.probe_answered(2.4 + IN_DOUBT_AFTER_S)
    assert choice.transport is UDP


def relapse(choice: TransportChoice, now: float) -> float:
    """Goes back to UDP, and away from it at once. Returns the time."""
    while choice.transport is WEBSOCKET:
        now += 0.5
        choice.proven(WEBSOCKET, now)
        choice.probe_answered(now)
    now += FALL_BACK_AFTER_S + 0.1
    choice.tick(now)
    assert choice.transport is WEBSOCKET
    choice.proven(WEBSOCKET, now)
    return now


def test_a_way_that_comes_and_goes_has_to_prove_itself_for_longer_each_time() -> None:
    choice = fallen_back()
    now, needed = 2.0, []
    for _ in range(7):
        now = relapse(choice, now)
        needed.append(choice.needed)
    assert needed == [4, 8, 16, MAX_NEEDED, MAX_NEEDED, MAX_NEEDED, MAX_NEEDED]


def test_a_long_steady_time_on_udp_is_believed_again() -> None:
    choice = fallen_back()
    now = relapse(choice, 2.0)
    while choice.transport is WEBSOCKET:
        now += 0.5
        choice.proven(WEBSOCKET, now)
        choice.probe_answered(now)
    until = now + SOON_S + 1
    while now < until:
        now += 1.0
        choice.proven(UDP, now)
        choice.tick(now)
    choice.tick(now + FALL_BACK_AFTER_S + 0.1)
    assert (choice.transport, choice.needed) == (WEBSOCKET, pytest.approx(2))
