"""A real agent core behind a real sealed link. Its autopilot is flown by hand and records who flies it."""

from collections import deque
from collections.abc import Callable
from contextlib import suppress

from onboard_agent.onboard import Onboard
from server.link.core.agent_link import AgentLink
from server.live.hub import Hub
from wire.control_messages import (
    AutopilotState,
    ControlChanged,
    HoldOrder,
    HoldProgress,
    ToAgent,
    ToTower,
    Welcome,
    decode_to_agent,
    encode_message,
)
from wire.dialect import build, decode, mavlink
from wire.drops import Dropped
from wire.frames import message_id
from wire.ids import DroneId, Epoch, LinkId
from wire.sealed_link import SealedLink
from wire.sealing import read_link_id

ARMED_ALT_HOLD = build(mavlink.MAVLink_heartbeat_message(2, 3, 209, 2, 4, 3), system_id=1, component_id=1, sequence=0)


def stick_frame(user_id: int, *, centred: bool) -> bytes:
    """Returns a stick frame with the user's id in the field for gamepad buttons."""
    pitch = 0 if centred else 700
    message = mavlink.MAVLink_manual_control_message(1, pitch, 0, 500, 0, user_id)
    return build(message, system_id=255, component_id=190, sequence=0)


class ModelAgent:
    """The agent of one drone. `flown_by` records (epoch, user) of each stick frame that reached the autopilot."""

    takes: tuple[str, ...] = ()
    """Additional capabilities that both sides announce."""

    def __init__(self, drone_id: DroneId, now: float, *, onboard: Onboard | None = None, process: int = 0) -> None:
        self.drone_id = drone_id
        self.onboard = onboard or Onboard(now=now, speaks_first=False)
        self.process = process
        self.flown_by: list[tuple[int, int]] = []
        self.control: deque[ToAgent] = deque()
        self.has_channel = False
        self.link: AgentLink | None = None
        self._held = 0
        """The epoch of the newest hold that the tower ordered on this link."""
        self._progress: list[HoldProgress] = []
        """Hold steps to repeat on another control channel."""
        self._send: Callable[[bytes, tuple[str, int]], None] = lambda datagram, address: None
        self._sealed: SealedLink | None = None
        self._coming: SealedLink | None = None
        self._autopilot_beats(now)

    def connect(self, hub: Hub, link_id: LinkId, network: deque[tuple[DroneId, bytes]], now: float) -> None:
        """Signs in. The welcome is in transit when this returns, as in the tower's control channel."""
        self.disconnect(hub, now)
        self.has_channel = True
        self._held = 0
        self._send = lambda datagram, address: network.append((self.drone_id, datagram))
        keys = link_id.to_bytes(4, "little") * 8, (link_id ^ 0xFFFFFFFF).to_bytes(4, "little") * 8
        self._coming = _sealed(link_id, self.drone_id, send=keys[0], receive=keys[1], now=now)
        self.link = AgentLink(
            sealed=_sealed(link_id, self.drone_id, send=keys[1], receive=keys[0], now=now),
            send_datagram=self._send,
            post=self.control.append,
            close=lambda code, why: None,
            call_later=lambda delay_s, call: None,  # the model flies with urgent frames alone
            resume_key=b"r" * 32,
            takes=self.takes,
            process=self.process,
        )
        drone = hub.state.drones.get(self.drone_id)
        assert drone is not None
        holder = drone.lease.holder.name if drone.lease.holder else None
        self.control.append(
            Welcome(
                drone_id=self.drone_id,
                name=drone.record.name,
                link_id=link_id,
                public_key=b"",
                udp_port=1,
                epoch=drone.lease.epoch,
                holder=holder,
                holder_present=drone.somebody_flies(),
                takes=self.takes,
            )
        )
        hub.attach_link(self.link, now)

    def disconnect(self, hub: Hub | None, now: float) -> None:
        """Ends the link. Messages in transit on the control channel are lost."""
        if hub is not None and self.link is not None:
            hub.detach_link(self.link)
        if self._sealed is not None:
            self.onboard.link_broken(now)
        self.link = self._sealed = self._coming = None
        self.has_channel = False
        self.control.clear()
        self._progress.clear()

    def lose_channel(self, hub: Hub, now: float) -> None:
        """Ends the control channel; its messages in transit are lost. The link continues, or ends with it."""
        if self.link is None or not self.has_channel:
            return
        self.control.clear()
        self.has_channel = False
        if hub.lose_channel(self.link, now):
            self.disconnect(None, now)

    def resume(self, hub: Hub, now: float) -> None:
        """Opens another control channel for the same link if the tower still has it, whether or not the last one was
        lost."""
        link = self.link
        if link is None or not self.linked or hub.links.resumable(link.link_id, self.drone_id, now) is not link:
            return
        self.control.clear()
        link.adopt(
            send_datagram=self._send,
            post=self.control.append,
            close=lambda code, why: None,
            channel=object(),
            waiting=lambda: (0, 0),
        )
        hub.resumed(link)
        self.has_channel = True
        for progress in self._progress:
            hub.reports.receive(link, progress)
        self.onboard.resumed()

    def is_linked_to(self, hub: Hub) -> bool:
        """Whether both sides have the same link."""
        drone = hub.state.drones.get(self.drone_id)
        return self.linked and drone is not None and drone.link is self.link

    @property
    def linked(self) -> bool:
        return self._sealed is not None

    def next_control_message(self, hub: Hub, now: float) -> None:
        if not self.control:
            return
        message = self.control.popleft()
        if isinstance(message, Welcome):
            self._sealed, self._coming = self._coming, None
            self.onboard.welcomed(message, now)
            self.speak(hub, now)
        else:
            self._message(message, now)

    def _message(self, message: ToAgent, now: float) -> None:
        if isinstance(message, HoldOrder):
            self._held = max(self._held, message.epoch)
        self.onboard.message(message, now)

    def datagram(self, datagram: bytes, now: float) -> None:
        """Handles a datagram from the network: intact, late, duplicated or of a past link."""
        if self._sealed is None or read_link_id(datagram) != self._sealed.link_id:
            return
        try:
            received = self._sealed.receive(datagram, now)
        except Dropped:
            return
        self.onboard.tower_heard(now)
        if received.urgent is not None:
            message = decode_to_agent(received.urgent)
            if isinstance(message, (HoldOrder, ControlChanged)):
                self._message(message, now)
        if received.frames is None:
            return
        known = self.onboard.downlink.epoch
        self.onboard.from_tower(received.frames, now)
        assert self.onboard.downlink.epoch >= known, "the epoch went back within a link"
        self._to_autopilot()

    def _autopilot_beats(self, now: float) -> None:
        self.onboard.from_autopilot([ARMED_ALT_HOLD], now)

    def tick(self, now: float) -> None:
        self._autopilot_beats(now)
        self.onboard.tick(now)
        self._to_autopilot()

    def speak(self, hub: Hub, now: float) -> None:
        """Sends the agent's messages on both channels, or on the one that exists."""
        if self._sealed is None or self.link is None:
            return
        for datagram in self._sealed.datagrams_to_send(now):
            self._to_tower(hub, datagram, now)
        for message in self.onboard.messages_to_tower(now):
            self._announce(hub, message, now)

    def _announce(self, hub: Hub, message: ToTower, now: float) -> None:
        assert self._sealed is not None and self.link is not None
        if isinstance(message, HoldProgress):
            self._progress.append(message)
        if self.has_channel:
            hub.reports.receive(self.link, message)
        elif isinstance(message, (HoldProgress, AutopilotState)):
            self._to_tower(hub, self._sealed.seal_urgent(encode_message(message).encode()), now)

    def _to_tower(self, hub: Hub, datagram: bytes, now: float) -> None:
        assert self._sealed is not None
        # The tower may no longer know the link: an orphan has ended and the agent does not know yet.
        with suppress(Dropped):
            hub.datagram(datagram, self._sealed.link_id, ("203.0.113.1", 4000), now)

    def _to_autopilot(self) -> None:
        for frame in self.onboard.frames_to_autopilot():
            if message_id(frame) != mavlink.MAVLINK_MSG_ID_MANUAL_CONTROL:
                continue
            message = decode(frame)
            assert message is not None
            if message.buttons:  # the agent's own centred sticks press none
                assert self.onboard.downlink.epoch >= self._held, "sticks of an epoch that a hold has ended"
                self.flown_by.append((Epoch(self.onboard.downlink.epoch), message.buttons))


def _sealed(link_id: LinkId, drone_id: DroneId, *, send: bytes, receive: bytes, now: float) -> SealedLink:
    return SealedLink(link_id=link_id, drone_id=drone_id, send_key=send, receive_key=receive, now=now)
