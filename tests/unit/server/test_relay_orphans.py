"""A link without a control channel: who still flies, what still reaches the drone, and when the link ends."""

from unittest.mock import ANY

import pytest
from hub_world import FIRST_ORDER, NOW, FakeAgent, FakeBrowser, HubWorld, command_ack, heartbeat, record, sticks

from server.control.core.orphans import ORPHAN_S, SILENT_S
from server.kernel.people import UserRef
from server.link.core.agent_routes import OVER_CHANNEL
from server.live import live_messages as live
from server.live.live_counts import count_live
from server.live.live_drone import LeaseView
from wire.control_messages import (
    AutopilotState,
    ControlChanged,
    HoldCause,
    HoldOrder,
    HoldProgress,
    HoldStep,
    ToAgent,
    decode_to_agent,
    encode_message,
)
from wire.drops import Dropped, DropReason
from wire.ids import DroneId, Epoch, UserId
from wire.rekeying import OUTLIVED_AFTER_S
from wire.tagged import tag

OWN = HoldCause.PILOT_LOST
ONE, TWO = DroneId(1), DroneId(2)
ALICE, ADMIN = UserRef(UserId(1), "alice"), UserRef(UserId(9), "admin")


class Scene:
    """alice flies drone 1 by hand, and its agent has just lost its control channel."""

    def __init__(self) -> None:
        self.world = HubWorld()
        self.hub = self.world.hub
        self.agent: FakeAgent = self.world.agent(1)
        self.agent.link.resume_key = b"r" * 32
        self.alice: FakeBrowser = self.world.browser(1)
        self.hub.apply_lease(ONE, LeaseView(ALICE, None, Epoch(1)), event="acquired", by=ALICE, reason="", now=0.0)
        self.fly(0.0)
        self.agent.received()
        self.agent.posted.clear()
        assert not self.hub.lose_channel(self.agent.link, 0.0)

    def fly(self, now: float) -> None:
        self.alice.send(tag(ONE, sticks()), now)

    def live_until(self, until: float, *, begin: float = 0.1) -> None:
        """Continues the agent's datagrams and the hub's ticks."""
        tenth = round(begin * 10)
        while tenth / 10 <= until:
            self.agent.send(heartbeat(), now=tenth / 10)
            self.hub.tick(tenth / 10)
            tenth += 1

    @property
    def has_link(self) -> bool:
        drone = self.hub.state.drones.get(ONE)
        return drone is not None and drone.link is self.agent.link

    @property
    def resumable(self) -> bool:
        return self.hub.links.resumable(self.agent.link.link_id, ONE, 0.5) is self.agent.link

    def urgent(self, now: float) -> list[ToAgent]:
        sent, self.agent.sent_to = self.agent.sent_to, []
        texts = [self.agent.sealed.receive(datagram, now).urgent for datagram, _ in sent]
        return [decode_to_agent(text) for text in texts if text]

    def adopt(self) -> list[ToAgent]:
        """Adds another control channel. Returns the messages sent to it."""
        posted: list[ToAgent] = []
        self.agent.link.adopt(
            send_datagram=lambda datagram, address: self.agent.sent_to.append((datagram, address)),
            post=posted.append,
            close=lambda code, why: None,
            channel=object(),
            waiting=lambda: (1, 2),
        )
        self.hub.resumed(self.agent.link)
        return posted


@pytest.fixture
def scene() -> Scene:
    return Scene()


def test_frames_go_on_both_ways(scene: Scene) -> None:
    scene.alice.frames()
    scene.agent.send(command_ack(), now=0.2)
    assert scene.alice.frames() == [tag(ONE, command_ack())]
    scene.fly(0.3)
    assert scene.agent.received(0.3) == [(1, sticks())]
    drone = scene.hub.state.drones.get(ONE)
    assert drone is not None and drone.online


def test_it_ends_after_its_time(scene: Scene) -> None:
    scene.live_until(ORPHAN_S - 0.1)
    assert scene.has_link
    scene.live_until(ORPHAN_S, begin=ORPHAN_S)
    assert not scene.has_link and scene.agent.link.link_id not in scene.hub.state.links


def test_it_ends_when_its_datagrams_do(scene: Scene) -> None:
    scene.live_until(2.0)
    scene.hub.tick(2.0 + SILENT_S)
    assert scene.has_link
    scene.hub.tick(2.1 + SILENT_S)
    assert not scene.has_link


def test_a_link_over_the_control_channel_ends_with_it() -> None:
    world = HubWorld()
    agent = world.agent(1, heard=False)
    agent.link.resume_key = b"r" * 32
    assert world.hub.lose_channel(agent.link, 0.0), "nothing has come yet"
    agent = world.agent(1, link_id=7, heard=False)
    agent.link.resume_key = b"r" * 32
    agent.address = OVER_CHANNEL
    agent.send(heartbeat())
    assert world.hub.lose_channel(agent.link, 0.0)
    drone = world.hub.state.drones.get(ONE)
    assert drone is not None and drone.link is None


def test_an_order_goes_over_udp_until_it_is_answered_and_is_posted_on_the_next_channel(scene: Scene) -> None:
    assert scene.hub.holds.order(ONE, "gusts")
    order = HoldOrder(order_id=FIRST_ORDER, epoch=1, reason="gusts", interrupts=False)
    assert order in scene.urgent(0.0)
    for tenth in range(1, 31):
        scene.agent.send(heartbeat(), now=tenth / 10)
        scene.hub.tick(tenth / 10)
        assert order in scene.urgent(tenth / 10), "it goes on as long as nobody has answered"
    assert scene.agent.posted == [], "there is nothing to post on"
    assert order in scene.adopt()
    progress = HoldProgress(
        order_id=FIRST_ORDER, epoch=1, step=HoldStep.STICKS_CENTRED, detail="", elapsed_ms=1.0, number=1
    )
    scene.agent.deliver(scene.agent.sealed.seal_urgent(encode_message(progress).encode()), now=3.1)
    assert order not in scene.adopt()


def test_take_shuts_the_old_holder_out_at_once_and_the_drone_hears_of_it(scene: Scene) -> None:
    taken = LeaseView(ADMIN, ALICE, Epoch(2))
    scene.hub.apply_lease(ONE, taken, event="taken", by=ADMIN, reason="", now=0.5)
    scene.hub.holds.order(ONE, "taken")
    scene.fly(0.6)
    reported = scene.urgent(0.6)
    assert ControlChanged(number=ANY, epoch=2, holder="admin", holder_present=False) in reported
    assert HoldOrder(order_id=FIRST_ORDER, epoch=2, reason="taken", interrupts=False) in reported
    assert scene.agent.received(0.6) == []


def test_a_new_credential_ends_it(scene: Scene) -> None:
    assert scene.resumable
    scene.world.apply(record(1, (1,), holder=1, epoch=1, credential="other"), record(2, (2,)))
    assert not scene.has_link and not scene.resumable
    with pytest.raises(Dropped) as dropped:
        scene.agent.send(heartbeat(), now=0.2)
    assert dropped.value.reason is DropReason.UNKNOWN_LINK
    scene.hub.tick(0.3)
    scene.hub.tick(ORPHAN_S + 1.0)


def test_a_drone_that_is_removed_takes_its_orphan_along(scene: Scene) -> None:
    scene.world.apply(record(2, (2,)))
    assert not scene.resumable
    scene.hub.tick(ORPHAN_S + 1.0)


def test_an_account_that_is_disabled_flies_no_further(scene: Scene) -> None:
    scene.world.disabled.add(1)
    scene.world.apply(record(1, (1,), holder=1, epoch=1), record(2, (2,)))
    scene.fly(0.5)
    assert scene.agent.received(0.5) == []


def test_a_sign_in_without_the_proof_replaces_it_and_a_drone_flown_by_hand_holds(scene: Scene) -> None:
    new = scene.world.agent(1, link_id=500)
    assert not scene.has_link and not scene.resumable
    assert [message for message in new.posted if isinstance(message, HoldOrder)]
    with pytest.raises(Dropped):
        scene.agent.send(heartbeat(), now=0.2)
    scene.hub.tick(ORPHAN_S + 1.0)
    drone = scene.hub.state.drones.get(ONE)
    assert drone is not None and drone.link is new.link, "the end of the orphan is not that of the new link"


def test_resumed_it_is_the_same_link_and_all_is_told_anew(scene: Scene) -> None:
    scene.live_until(3.0)
    posted = scene.adopt()
    drone = scene.hub.state.drones.get(ONE)
    assert drone is not None
    assert posted == [
        drone.stream,
        drone.safety,
        ControlChanged(number=ANY, epoch=1, holder="alice", holder_present=True),
    ]
    scene.live_until(ORPHAN_S + 3.0, begin=3.1)
    assert scene.has_link, "it is an orphan no more"
    assert count_live(scene.hub.state).agents_waiting == count_live(scene.hub.state).agents_deepest == (1, 2), (
        "of the new control channel"
    )
    assert scene.hub.state.traffic.holds_ordered == 0


def test_its_picture_goes_on_over_udp_and_the_control_channel_alone_has_it_again(scene: Scene) -> None:
    drone = scene.hub.state.drones.get(ONE)
    assert drone is not None

    def announce(now: float, *, armed: bool, airborne: bool) -> None:
        state = AutopilotState(heard=True, armed=armed, airborne=airborne)
        scene.agent.deliver(scene.agent.sealed.seal_urgent(encode_message(state).encode()), now=now)

    announce(0.2, armed=True, airborne=False)
    announce(0.4, armed=True, airborne=True)
    assert (drone.autopilot_heard, drone.armed, drone.airborne) == (True, True, True)
    assert drone.flight_start.since == NOW, "the time of day is known over UDP too"
    assert [one.drone.airborne for one in scene.alice.events() if isinstance(one, live.DroneChanged)][-1]
    scene.adopt()
    announce(0.5, armed=False, airborne=False)
    assert drone.airborne, "a datagram that was long on its way says nothing beside the control channel"


def test_steps_of_a_hold_that_the_next_link_tells_again_are_told_once(scene: Scene) -> None:
    reported = [
        HoldProgress(order_id=0, epoch=1, step=step, detail="", elapsed_ms=0.0, cause=OWN, number=7 + number)
        for number, step in enumerate((HoldStep.ORDERED, HoldStep.STICKS_CENTRED, HoldStep.CONFIRMED))
    ]
    for progress in reported[:2]:
        scene.agent.deliver(scene.agent.sealed.seal_urgent(encode_message(progress).encode()), now=0.2)
    scene.hub.tick(2.0 + SILENT_S)
    assert not scene.has_link
    new = scene.world.agent(1, link_id=500)
    for progress in reported:
        scene.hub.reports.receive(new.link, progress)
    holds = [event for event in scene.alice.events() if isinstance(event, live.Hold)]
    assert [event.step for event in holds if event.cause == OWN] == [progress.step for progress in reported]


def test_an_agent_that_was_started_again_is_heard_though_it_counts_from_elsewhere(scene: Scene) -> None:
    def reported(number: int) -> HoldProgress:
        step = HoldStep.STICKS_CENTRED
        return HoldProgress(order_id=0, epoch=1, step=step, detail="", elapsed_ms=0.0, number=number)

    scene.hub.reports.receive(scene.agent.link, reported(900))
    new = scene.world.agent(1, link_id=500)
    scene.alice.events()
    scene.hub.reports.receive(new.link, reported(3))
    assert [event for event in scene.alice.events() if isinstance(event, live.Hold)]


def test_what_may_not_be_resumed(scene: Scene) -> None:
    link_id = scene.agent.link.link_id
    assert scene.hub.links.resumable(link_id, ONE, 0.5) is scene.agent.link
    assert scene.hub.links.resumable(link_id, TWO, 0.5) is None, "another drone's credential"
    assert scene.hub.links.resumable(link_id + 1, ONE, 0.5) is None
    scene.hub.tick(0.0)  # it is flown: the tower sends its own pings, so silence is a loss
    assert scene.hub.links.resumable(link_id, ONE, SILENT_S + 0.1) is None, "its datagrams do not come"
    idle = scene.world.agent(2).link
    idle.resume_key = b"r" * 32
    idle.sealed.keepalive.heard_at = 0.0
    idle.routes.follow(("127.0.0.1", 7))
    assert scene.hub.links.resumable(idle.link_id, TWO, SILENT_S + idle.sealed.keepalive.rests_s) is idle
    assert scene.hub.links.resumable(idle.link_id, TWO, SILENT_S + idle.sealed.keepalive.rests_s + 0.1) is None
    late = OUTLIVED_AFTER_S + 1.0
    scene.agent.link.sealed.keepalive.heard_at = late
    assert scene.hub.links.resumable(link_id, ONE, late) is None, "keys that should have been changed long ago"
