"""Floods: legitimate traffic passes, the rest is counted and reported, and pilots are not affected."""

import pytest
from hub_world import FakeBrowser, HubWorld, command_ack, command_long, heartbeat, sticks
from hypothesis import given
from hypothesis import strategies as st

from server.kernel.people import UserRef
from server.link.core.flood_gate import FLOODING, PATIENCE, RESERVED, FloodGate, FloodLimits
from server.link.core.socket_bounds import SocketBounds
from server.link.core.token_bucket import TokenBucket
from server.live import live_messages as live
from server.live.live_drone import LeaseView
from wire.dialect import build, mavlink
from wire.drops import DropReason
from wire.ids import DroneId, Epoch, UserId
from wire.tagged import tag

ONE, TWO = DroneId(1), DroneId(2)
LIMITS = FloodLimits()


def ask_parameter(index: int) -> bytes:
    message = mavlink.MAVLink_param_request_read_message(1, 1, b"", index)
    return build(message, system_id=255, component_id=190, sequence=index & 0xFF)


ASK = ask_parameter(1)


@pytest.fixture
def world() -> HubWorld:
    return HubWorld()


def give_controls(world: HubWorld, drone_id: DroneId = ONE, user: int = 1, name: str = "alice") -> None:
    holder = UserRef(UserId(user), name)
    lease = LeaseView(holder=holder, taken_from=None, epoch=Epoch(1))
    world.hub.apply_lease(drone_id, lease, event="acquired", by=holder, reason="", now=0.0)


def notices(browser: FakeBrowser) -> list[tuple[str, int]]:
    return [(event.code, event.count) for event in browser.events() if isinstance(event, live.Notice)]


def test_sticks_at_50_hz_and_1500_parameters_at_once_pass(world: HubWorld) -> None:
    agent, alice = world.agent(1), world.browser(1)
    give_controls(world)
    alice.events()
    for index in range(1500):
        alice.send(tag(ONE, ask_parameter(index)), now=0.0)
    passed = len(agent.received())
    for number in range(50 * 60):
        now = number / 50
        if number % 25 == 0:
            agent.answer_pings(now)
        alice.send(tag(ONE, sticks()), now=now)
        passed += len(agent.received(now))
    assert passed == 1500 + 50 * 60
    assert world.hub.state.drops[DropReason.FLOOD] == 0
    assert notices(alice) == []


def test_what_is_beyond_is_counted_and_told_and_gets_no_other_answer(world: HubWorld) -> None:
    agent, alice = world.agent(1), world.browser(1)
    give_controls(world)
    alice.events()
    alice.frames()
    for _ in range(LIMITS.drone_burst + 7):
        alice.send(tag(ONE, command_long()), now=0.0)
    assert len(agent.received()) == LIMITS.drone_burst
    assert world.hub.state.drops[DropReason.FLOOD] == 7
    assert notices(alice) == [("flood", 1)]
    assert alice.frames(2e9) == []
    world.hub.tick(1.0)
    assert notices(alice) == [("flood", 6)]


def test_who_goes_on_is_closed_and_heard_no_more(world: HubWorld) -> None:
    agent, alice, bob = world.agent(1), world.browser(1), world.browser(2)
    for _ in range(LIMITS.user_burst + PATIENCE + 10):
        alice.send(tag(ONE, ASK), now=0.0)
    assert {code for code, _ in alice.closed} == {FLOODING}
    counted = world.hub.state.drops[DropReason.FLOOD]
    agent.received()
    alice.send(tag(ONE, ASK), now=100.0)
    assert (agent.received(), world.hub.state.drops[DropReason.FLOOD]) == ([], counted)
    assert bob.closed == []


def test_a_flood_of_messages_that_mean_nothing_ends_the_same_way(world: HubWorld) -> None:
    alice = world.browser(1)
    for _ in range(LIMITS.user_burst + PATIENCE + 10):
        alice.send(b"\xff", now=0.0)
    assert {code for code, _ in alice.closed} == {FLOODING}
    assert world.hub.state.drops[DropReason.MALFORMED] == LIMITS.user_burst * (1 - RESERVED)


def test_text_messages_have_a_bound_too(world: HubWorld) -> None:
    alice = world.browser(1)
    heard = [world.hub.admits_request(alice.browser, 0.0) for _ in range(300)]
    assert heard.count(True) == 200
    assert notices(alice) == [("flood", 1)]
    assert world.hub.admits_request(alice.browser, 1.0)


def test_a_watcher_who_floods_a_drone_does_not_take_the_sticks_from_whoever_flies_it(world: HubWorld) -> None:
    agent, alice, admin = world.agent(1), world.browser(1), world.browser(9)
    give_controls(world)
    for _ in range(2 * LIMITS.drone_burst):
        admin.send(tag(ONE, ASK), now=0.0)
    assert world.hub.state.drops[DropReason.FLOOD] > 0
    agent.received()
    alice.send(tag(ONE, sticks()), now=0.0)
    assert agent.received() == [(1, sticks())]


def test_who_floods_one_drone_can_still_fly_another(world: HubWorld) -> None:
    agent, _, admin = world.agent(1), world.agent(2), world.browser(9)
    give_controls(world, ONE, 9, "admin")
    for _ in range(2 * LIMITS.user_burst):
        admin.send(tag(TWO, ASK), now=0.0)
    assert world.hub.state.drops[DropReason.FLOOD] > 0
    admin.send(tag(ONE, sticks()), now=0.0)
    assert agent.received() == [(1, sticks())]


def test_a_drone_that_sends_too_much_loses_state_first_and_watchers_are_told_of_the_rest(world: HubWorld) -> None:
    agent, other = world.agent(1), world.agent(2)
    alice, bob = world.browser(1), world.browser(2)
    reserve = int(RESERVED * LIMITS.agent_burst)
    agent.send(*([heartbeat()] * (LIMITS.agent_burst - reserve + 100)))
    state_dropped = world.hub.state.drops[DropReason.FLOOD]
    assert 100 <= state_dropped <= 200, "whole datagrams"
    agent.send(*([command_ack()] * (reserve + 500)))
    assert world.hub.state.drops[DropReason.FLOOD] > state_dropped
    lost = sum(event.count for event in alice.events() if isinstance(event, live.Lost))
    came = alice.frames(2e9).count(tag(ONE, command_ack()))
    assert came + lost == reserve + 500
    other.send(command_ack())
    assert tag(TWO, command_ack()) in bob.frames(2e9), "the other drone is not concerned"


def test_reports_of_an_agent_have_a_bound(world: HubWorld) -> None:
    agent, other = world.agent(1), world.agent(2)
    assert [world.hub.admits_report(agent.link, 0.0) for _ in range(600)].count(True) == 500
    assert world.hub.admits_report(other.link, 0.0)
    assert world.hub.state.drops[DropReason.FLOOD] == 100


def test_accounts_that_are_full_again_are_forgotten() -> None:
    gate = FloodGate(FloodLimits())
    for user in range(100):
        gate.admits(UserId(user), DroneId(user), flies=False, now=0.0)
    assert len(gate) == 200
    gate.forget_idle({DroneId(7): None}, 10.0)
    assert len(gate) == 1


@given(st.lists(st.tuples(st.floats(0, 2), st.integers(1, 9)), max_size=60))
def test_a_bucket_never_gives_more_than_its_rate_and_its_burst(steps: list[tuple[float, int]]) -> None:
    bucket, now, given_out = TokenBucket(10.0, 20.0, 0.0), 0.0, 0
    for wait, count in steps:
        now += wait
        given_out += count if bucket.take(count, now) else 0
        assert given_out <= 20.0 + 10.0 * now + 1e-6


def test_connections_of_a_user_and_of_an_address_have_a_bound(world: HubWorld) -> None:
    bounds = SocketBounds(per_user=2, per_address=3)
    browsers = [world.browser(user).browser for user in (1, 1, 2)]
    for browser in browsers:
        browser.address = "198.51.100.7"
    assert bounds.refusal(browsers, UserId(1), "203.0.113.1") is not None
    assert bounds.refusal(browsers, UserId(2), "203.0.113.1") is None
    assert bounds.refusal(browsers, UserId(2), "198.51.100.7") is not None


def test_connections_cannot_be_opened_and_closed_without_end(world: HubWorld) -> None:
    answers = [world.hub.capacity_refusal(UserId(1), "198.51.100.7", 0.0) for _ in range(100)]
    assert answers.count(None) == 80
    assert world.hub.capacity_refusal(UserId(2), "198.51.100.7", 0.0) is None
    assert world.hub.capacity_refusal(UserId(1), "198.51.100.7", 0.6) is None
