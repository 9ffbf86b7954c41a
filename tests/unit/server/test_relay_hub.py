"""The hub's rules: who receives which frames, which frames reach a drone, and what happens to the rest."""

from unittest.mock import ANY

import msgspec
import pytest
from hub_world import FIRST_ORDER, HubWorld, command_ack, command_long, heartbeat, record, sticks

from server.control.core.hold_orders import OFFLINE
from server.kernel.people import UserRef
from server.live import live_messages as live
from server.live.hub import LINK_REPLACED, SESSION_ENDED
from server.live.live_drone import LeaseView
from wire.batching import MAX_WAIT_S
from wire.content import Ping, encode_keepalive
from wire.control_messages import AutopilotState, ControlChanged, HoldOrder, HoldProgress, HoldStep
from wire.dialect import build, mavlink
from wire.drops import Dropped, DropReason
from wire.ids import DroneId, Epoch, UserId
from wire.open_holds import OPEN_HOLDS, Stay
from wire.sealing import Sealer
from wire.tagged import MAX_UPWARD_MESSAGE_BYTES, tag

ONE, TWO = DroneId(1), DroneId(2)
ALICE = UserRef(UserId(1), "alice")


@pytest.fixture
def world() -> HubWorld:
    return HubWorld()


def give_controls(world: HubWorld, epoch: int = 1, drone_id: DroneId = ONE, holder: UserRef = ALICE) -> None:
    lease = LeaseView(holder=holder, taken_from=None, epoch=Epoch(epoch))
    world.hub.apply_lease(drone_id, lease, event="acquired", by=holder, reason="", now=0.0)


def test_the_tenant_wall_stands_though_every_drone_is_sysid_1(world: HubWorld) -> None:
    alice, bob, admin = world.browser(1), world.browser(2), world.browser(9)
    world.agent(1).send(command_ack(11))
    world.agent(2).send(command_ack(22))
    first, second = tag(ONE, command_ack(11)), tag(TWO, command_ack(22))
    beat_one, beat_two = tag(ONE, heartbeat()), tag(TWO, heartbeat())
    assert set(alice.frames()) == {first, beat_one}
    assert set(bob.frames()) == {second, beat_two}
    assert set(admin.frames()) == {first, second, beat_one, beat_two}


def test_a_frame_of_the_holder_reaches_the_drone_as_it_was(world: HubWorld) -> None:
    agent, alice = world.agent(1), world.browser(1)
    give_controls(world)
    frame = command_long()
    alice.send(tag(ONE, frame))
    assert agent.received() == [(1, frame)]
    assert alice.events() == [
        live.DroneChanged(world.hub.squads.view(ONE, UserId(1), alice.browser.viewer.role)),
        live.Control(1, "acquired", 1, ALICE, ALICE, ""),
    ]


@pytest.mark.parametrize(
    ("user_id", "drone_id", "reason"),
    [
        (1, 1, DropReason.NOT_IN_CONTROL),
        (9, 1, DropReason.NOT_IN_CONTROL),
        (2, 1, DropReason.UNKNOWN_DRONE),
        (2, 77, DropReason.UNKNOWN_DRONE),
    ],
)
def test_frames_of_others_are_refused_counted_and_answered(
    world: HubWorld, user_id: int, drone_id: int, reason: DropReason
) -> None:
    agent = world.agent(1)
    browser = world.browser(user_id)
    browser.send(tag(DroneId(drone_id), command_long()))
    assert agent.received() == []
    assert world.hub.state.drops[reason] == 1
    (notice,) = browser.events()
    assert isinstance(notice, live.Notice)
    assert (notice.code, notice.drone_id, notice.count) == (reason.value, drone_id, 1)


def test_not_yours_and_not_there_get_the_same_answer(world: HubWorld) -> None:
    bob = world.browser(2)
    bob.send(tag(ONE, command_long()))
    bob.send(tag(DroneId(77), command_long()))
    not_yours, not_there = bob.events()
    assert isinstance(not_yours, live.Notice)
    assert isinstance(not_there, live.Notice)
    assert not_yours.text == not_there.text
    assert "Drone 1" not in not_yours.text


def test_a_storm_of_refusals_is_told_once_a_second(world: HubWorld) -> None:
    world.agent(1)
    alice = world.browser(1)
    for _ in range(50):
        alice.send(tag(ONE, sticks()), now=10.0)
    assert [event.count for event in alice.events() if isinstance(event, live.Notice)] == [1]
    world.hub.tick(11.0)
    assert [event.count for event in alice.events() if isinstance(event, live.Notice)] == [49]
    assert world.hub.state.drops[DropReason.NOT_IN_CONTROL] == 50


def test_nothing_is_sent_to_a_drone_that_is_offline_not_even_later(world: HubWorld) -> None:
    alice = world.browser(1)
    give_controls(world)
    alice.events()
    alice.send(tag(ONE, command_long()))
    (notice,) = alice.events()
    assert isinstance(notice, live.Notice)
    assert notice.code == "offline"
    assert world.agent(1).received() == []


@pytest.mark.parametrize(
    "message",
    [b"", b"\x01\0\0\0", b"\xff" * 40, tag(ONE, command_long())[:-1], bytes(MAX_UPWARD_MESSAGE_BYTES + 1)],
    ids=["empty", "tag only", "noise", "cut off", "too long"],
)
def test_malformed_messages_are_dropped_whole(world: HubWorld, message: bytes) -> None:
    agent, alice = world.agent(1), world.browser(1)
    give_controls(world)
    alice.events()
    alice.send(message)
    (notice,) = alice.events()
    assert isinstance(notice, live.Notice)
    assert (notice.code, notice.drone_id) == ("malformed", None)
    assert agent.received() == []


def test_a_damaged_frame_is_refused_and_its_neighbours_pass(world: HubWorld) -> None:
    agent, alice = world.agent(1), world.browser(1)
    give_controls(world)
    alice.events()
    good = command_long()
    damaged = good[:-1] + bytes((good[-1] ^ 1,))
    alice.send(tag(ONE, good) + tag(ONE, damaged) + tag(ONE, good))
    assert agent.received() == [(1, good), (1, good)]
    assert world.hub.state.drops[DropReason.BAD_FRAME] == 1


def test_signing_keys_are_never_forwarded(world: HubWorld) -> None:
    agent, alice = world.agent(1), world.browser(1)
    give_controls(world)
    setup = build(mavlink.MAVLink_setup_signing_message(1, 1, [1] * 32, 1), system_id=1, component_id=1, sequence=0)
    alice.frames()
    alice.send(tag(ONE, setup))
    agent.send(setup)
    assert agent.received() == []
    assert alice.frames() == []
    assert world.hub.state.drops[DropReason.NOT_ALLOWED] == 2


def test_control_moves_the_epoch_and_shuts_the_old_holder_out(world: HubWorld) -> None:
    agent, alice, admin = world.agent(1), world.browser(1), world.browser(9)
    give_controls(world, epoch=1)
    taken = LeaseView(holder=UserRef(UserId(9), "admin"), taken_from=ALICE, epoch=Epoch(2))
    world.hub.apply_lease(ONE, taken, event="taken", by=taken.holder, reason="weather", now=0.0)
    assert world.hub.holds.order(ONE, "weather")
    alice.send(tag(ONE, sticks()))
    admin.send(tag(ONE, sticks()))
    assert [epoch for epoch, _ in agent.received()] == [2]
    assert agent.posted[-2:] == [
        ControlChanged(number=ANY, epoch=2, holder="admin", holder_present=True),
        HoldOrder(order_id=FIRST_ORDER, epoch=2, reason="weather", interrupts=False),
    ]


def test_an_old_lease_never_comes_back(world: HubWorld) -> None:
    give_controls(world, epoch=5)
    give_controls(world, epoch=4, holder=UserRef(UserId(9), "admin"))
    world.apply(record(1, (1,), holder=9, epoch=3), record(2, (2,)))
    drone = world.hub.state.drones.get(ONE)
    assert drone is not None
    assert (drone.lease.holder, drone.lease.epoch) == (ALICE, 5)


def test_an_older_snapshot_is_ignored(world: HubWorld) -> None:
    world.apply(record(1, (1,)), record(2, (2,)))
    world.revision = 0
    world.apply()
    assert world.hub.state.drones.get(ONE) is not None


def test_losing_an_ownership_takes_the_drone_out_of_sight_at_once(world: HubWorld) -> None:
    agent, alice = world.agent(1), world.browser(1)
    agent.send(command_ack())
    world.apply(record(1, ()), record(2, (2,)))
    assert alice.events() == [live.DroneRemoved(1)]
    agent.send(command_ack())
    assert alice.frames() == []


def test_a_new_owner_sees_the_drone_at_once(world: HubWorld) -> None:
    bob = world.browser(2)
    world.apply(record(1, (1, 2)), record(2, (2,)))
    (seen,) = [event for event in bob.events() if isinstance(event, live.DroneChanged)]
    assert [owner.name for owner in seen.drone.owners] == ["alice", "bob"]


def test_a_removed_drone_loses_its_link(world: HubWorld) -> None:
    agent, admin = world.agent(1), world.browser(9)
    world.apply(record(2, (2,)))
    assert agent.closed
    assert live.DroneRemoved(1) in admin.events()
    with pytest.raises(Dropped, match="unknown_link"):
        agent.send(heartbeat())


def test_a_new_credential_ends_the_link_of_the_old_one(world: HubWorld) -> None:
    agent = world.agent(1)
    world.apply(record(1, (1,), credential="new"), record(2, (2,)))
    assert agent.closed


def test_a_disabled_account_is_out_at_once(world: HubWorld) -> None:
    agent, alice = world.agent(1), world.browser(1)
    give_controls(world)
    alice.frames()
    world.disabled.add(1)
    world.apply(record(1, (1,)), record(2, (2,)))
    assert alice.closed == [(SESSION_ENDED, "the account was disabled")]
    alice.send(tag(ONE, command_long()))
    agent.send(command_ack())
    assert agent.received() == []
    assert alice.frames() == []


def test_ending_a_session_closes_only_its_own_browsers(world: HubWorld) -> None:
    first, second = world.browser(1, session_id=11), world.browser(1, session_id=12)
    world.hub.end_sessions([11])
    assert first.closed
    assert not second.closed
    world.hub.end_user(UserId(1), "the password was changed")
    assert second.closed


def test_the_newest_link_of_a_drone_counts(world: HubWorld) -> None:
    old = world.agent(1, link_id=5)
    new = world.agent(1, link_id=6)
    assert old.closed == [(LINK_REPLACED, "the same drone has signed in again")]
    world.hub.detach_link(old.link)
    drone = world.hub.state.drones.get(ONE)
    assert drone is not None
    assert drone.link is new.link
    assert drone.online


def test_the_address_is_followed_on_the_newest_datagram_only(world: HubWorld) -> None:
    agent = world.agent(1)
    early, late = (agent.sealed.seal_frames(Epoch(0), [heartbeat(n)], 0.0)[0] for n in (1, 2))
    moved, stale = ("203.0.113.9", 1), ("203.0.113.66", 2)
    agent.deliver(late, address=moved)
    agent.deliver(early, address=stale)
    assert agent.link.routes.newest == moved
    with pytest.raises(Dropped, match="replayed"):
        agent.deliver(late, address=stale)
    assert agent.link.routes.newest == moved


def test_a_tag_of_another_drone_is_dropped(world: HubWorld) -> None:
    bob = world.browser(2)
    agent = world.agent(1)
    agent.sealed.drone_id = TWO
    with pytest.raises(Dropped, match="foreign_tag"):
        agent.send(command_ack())
    assert bob.frames() == []


def test_a_datagram_under_a_wrong_key_is_dropped_and_not_answered(world: HubWorld) -> None:
    agent = world.agent(1)
    agent.received()
    forged = Sealer(b"x" * 32, agent.link.link_id).seal(encode_keepalive(Ping(1)))
    with pytest.raises(Dropped, match="not_authentic"):
        agent.deliver(forged, address=("203.0.113.66", 6))
    assert agent.link.routes.newest == agent.address
    assert agent.sent_to == []


def test_online_is_told_when_the_data_channel_works_and_when_it_falls_silent(world: HubWorld) -> None:
    alice = world.browser(1)
    agent = world.agent(1, heard=False)
    assert alice.events() == []
    agent.send(heartbeat(), now=1.0)
    assert [event.drone.online for event in alice.events() if isinstance(event, live.DroneChanged)] == [True]
    world.hub.tick(3.9)
    assert alice.events() == []
    world.hub.tick(4.1)
    assert [event.drone.online for event in alice.events() if isinstance(event, live.DroneChanged)] == [False]


def test_an_agent_is_sent_only_what_it_understands(world: HubWorld) -> None:
    older, newer = world.agent(1), world.agent(2, takes=(OPEN_HOLDS,))
    for agent in (older, newer):
        agent.posted.clear()
        agent.received()
        agent.link.post(Stay(order_id=1, by="alice"))
        agent.link.send_urgent(Stay(order_id=2, by="alice"))
        agent.link.send_newest(Stay(order_id=3, by="alice"), 0.0)
    assert (older.posted, older.sent_to) == ([], [])
    assert world.hub.state.drops == {DropReason.NOT_UNDERSTOOD: 3}
    assert newer.posted == [Stay(order_id=1, by="alice"), Stay(order_id=2, by="alice")]
    assert newer.sent_to


def test_the_agent_is_told_whether_the_holder_is_there(world: HubWorld) -> None:
    agent = world.agent(1)
    give_controls(world)
    assert agent.posted[-1] == ControlChanged(number=ANY, epoch=1, holder="alice", holder_present=False)
    alice = world.browser(1)
    assert agent.posted[-1] == ControlChanged(number=ANY, epoch=1, holder="alice", holder_present=True)
    world.hub.detach_browser(alice.browser, 1.0)
    assert agent.posted[-1] == ControlChanged(number=ANY, epoch=1, holder="alice", holder_present=False)


def test_hold_progress_reaches_those_who_watch(world: HubWorld) -> None:
    agent, alice, bob = world.agent(1), world.browser(1), world.browser(2)
    progress = HoldProgress(order_id=1, epoch=0, step=HoldStep.CONFIRMED, detail="ALT_HOLD", elapsed_ms=9.5)
    world.hub.reports.receive(agent.link, progress)
    assert alice.events() == [live.Hold(1, 0, "confirmed", "ALT_HOLD", 9.5, "order")]
    assert bob.events() == []


def test_a_hold_of_a_drone_that_is_offline_is_said_to_be_unconfirmed(world: HubWorld) -> None:
    alice = world.browser(1)
    assert not world.hub.holds.order(ONE, "weather")
    assert alice.events() == [live.Hold(1, 0, "unconfirmed", OFFLINE, 0.0, "order")]


def test_the_autopilot_being_heard_is_told(world: HubWorld) -> None:
    agent, alice = world.agent(1), world.browser(1)
    world.hub.reports.receive(agent.link, AutopilotState(heard=True, armed=False, airborne=False))
    assert [e.drone.autopilot_heard for e in alice.events() if isinstance(e, live.DroneChanged)] == [True]


def test_the_focus_of_a_drone_that_is_not_theirs_is_refused(world: HubWorld) -> None:
    alice = world.browser(1)
    world.hub.audience.focus(alice.browser, TWO, 0.0)
    assert alice.browser.outbox.focus is None
    (notice,) = alice.events()
    assert isinstance(notice, live.Notice)
    assert notice.code == "unknown-drone"
    world.hub.audience.focus(alice.browser, ONE, 0.0)
    assert alice.browser.outbox.focus == ONE


def test_frames_to_an_agent_share_a_datagram_unless_one_is_urgent(world: HubWorld) -> None:
    agent, alice = world.agent(1), world.browser(1)
    give_controls(world, epoch=4)
    agent.received()
    param_list = build(mavlink.MAVLink_param_request_list_message(1, 1), system_id=255, component_id=190, sequence=1)
    alice.send(tag(DroneId(1), param_list), now=1.0)
    alice.send(tag(DroneId(1), param_list), now=1.004)
    assert agent.sent_to == []
    ((delay_s, send_batch),) = agent.alarms
    assert delay_s == pytest.approx(MAX_WAIT_S)
    send_batch(1.0 + delay_s)
    assert len(agent.sent_to) == 1
    assert agent.received() == [(4, param_list), (4, param_list)]
    alice.send(tag(DroneId(1), param_list), now=2.0)
    alice.send(tag(DroneId(1), sticks()), now=2.001)
    assert agent.received() == [(4, param_list), (4, sticks())]
    agent.alarms[-1][1](2.010)
    assert agent.sent_to == []
    assert len(agent.alarms) == 2


def test_watchers_are_told_how_the_link_is_seen_from_the_drone(world: HubWorld) -> None:
    agent, alice = world.agent(1), world.browser(1)
    for step in range(300):
        now = step / 10
        agent.link.send_keepalives(now)
        agent.answer_pings(now)
        if step % 5 in (1, 2, 3):  # while no ping would share its datagram
            agent.sealed.seal_frames(Epoch(0), [heartbeat()], now)  # lost on its way up
        agent.answer_pings(now + 0.04)
    alice.events()
    world.hub.each_second(30.0)
    (links,) = [event for event in alice.events() if isinstance(event, live.Links)]
    (reported,) = [msgspec.json.decode(one, type=live.LinkQuality) for one in links.links]
    assert (reported.drone_id, reported.transport, reported.uplinks) == (1, "udp", 1)
    assert reported.over_30s.loss_up is not None and reported.over_30s.loss_up > 0.5
    assert reported.over_30s.loss_down == 0.0
    assert reported.over_1s.rtt_ms is not None
    assert reported.path_mtu >= 1200
