"""A small world around a hub: accounts, drones, agents and browsers without a socket."""

from collections.abc import Callable, Collection
from datetime import UTC, datetime

from server.kernel.fleet import DroneRecord, FleetSnapshot, SignInRecord, UserRecord
from server.kernel.people import Principal, Role, SignInId, UserRef
from server.link.core.agent_link import AgentLink
from server.live.browser import Browser
from server.live.hub import Hub
from server.live.live_messages import ToBrowser
from wire.control_messages import ToAgent
from wire.dialect import build, mavlink
from wire.ids import DroneId, Epoch, LinkId, UserId
from wire.sealed_link import SealedLink
from wire.sealing import read_link_id

OLGA = 6
"""An observer account."""
NAMES = {1: "alice", 2: "bob", OLGA: "olga", 9: "admin"}
LATER = datetime(2100, 1, 1, tzinfo=UTC)
NOW = datetime(2026, 1, 1, tzinfo=UTC)
"""The fixed time of day."""
FIRST_ORDER = int(NOW.timestamp()) + 1
"""The number of the first order from a hub made at that time."""


def heartbeat(sequence: int = 0) -> bytes:
    message = mavlink.MAVLink_heartbeat_message(2, 3, 81, 5, 4, 3)
    return build(message, system_id=1, component_id=1, sequence=sequence)


def command_ack(command: int = 400) -> bytes:
    return build(mavlink.MAVLink_command_ack_message(command, 0), system_id=1, component_id=1, sequence=0)


def command_long(command: int = 400, system_id: int = 255) -> bytes:
    message = mavlink.MAVLink_command_long_message(1, 1, command, 0, 1, 0, 0, 0, 0, 0, 0)
    return build(message, system_id=system_id, component_id=190, sequence=7)


def sticks() -> bytes:
    message = mavlink.MAVLink_manual_control_message(1, 0, 0, 500, 0, 0)
    return build(message, system_id=255, component_id=190, sequence=0)


def record(
    drone_id: int, owners: tuple[int, ...], *, holder: int | None = None, epoch: int = 0, credential: str = "c"
) -> DroneRecord:
    return DroneRecord(
        id=DroneId(drone_id),
        name=f"Drone {drone_id}",
        owners=tuple(UserRef(UserId(owner), NAMES[owner]) for owner in owners),
        credential_hash=credential,
        holder=UserRef(UserId(holder), NAMES[holder]) if holder else None,
        epoch=Epoch(epoch),
        taken_from=None,
    )


class FakeAgent:
    """The agent's end of a link, with the source address of its datagrams."""

    def __init__(self, hub: Hub, drone_id: int, *, link_id: int, now: float = 0.0, takes: Collection[str] = ()) -> None:
        self.hub = hub
        self.address = ("198.51.100.1", 4000 + link_id)
        self.sealed = _sealed(drone_id, link_id, send=b"a" * 32, receive=b"t" * 32, now=now)
        self.sent_to: list[tuple[bytes, tuple[str, int]]] = []
        self.posted: list[ToAgent] = []
        self.alarms: list[tuple[float, Callable[[float], None]]] = []
        """Timers that the link requested: (delay in seconds, callback)."""
        self.closed: list[tuple[int, str]] = []
        self.link = AgentLink(
            sealed=_sealed(drone_id, link_id, send=b"t" * 32, receive=b"a" * 32, now=now, leads=False),
            send_datagram=lambda datagram, address: self.sent_to.append((datagram, address)),
            post=self.posted.append,
            close=lambda code, why: self.closed.append((code, why)),
            call_later=lambda delay_s, call: self.alarms.append((delay_s, call)),
            takes=takes,
            drops=hub.state.drops,
        )
        hub.attach_link(self.link, now)

    def send(self, *frames: bytes, now: float = 0.0) -> None:
        for datagram in self.sealed.seal_frames(Epoch(0), frames, now):
            self.deliver(datagram, now=now)

    def deliver(self, datagram: bytes, *, now: float = 0.0, address: tuple[str, int] | None = None) -> None:
        self.hub.datagram(datagram, read_link_id(datagram), address or self.address, now)

    def answer_pings(self, now: float) -> None:
        """Passes the sealed link's own datagrams to the tower at once."""
        self.received(now)
        for datagram in self.sealed.datagrams_to_send(now):
            self.deliver(datagram, now=now)

    def received(self, now: float = 0.0) -> list[tuple[int, bytes]]:
        """Returns (epoch, frame) of everything sent to this agent since the last call."""
        sent, self.sent_to = self.sent_to, []
        frames = []
        for datagram, _ in sent:
            content = self.sealed.receive(datagram, now).frames
            if content is not None:
                frames += [(content.epoch, frame) for frame in content.frames]
        return frames


def _sealed(drone_id: int, link_id: int, *, send: bytes, receive: bytes, now: float, leads: bool = True) -> SealedLink:
    keys = {"send_key": send, "receive_key": receive}
    return SealedLink(link_id=LinkId(link_id), drone_id=DroneId(drone_id), **keys, now=now, leads=leads)


def role_of(user_id: int) -> Role:
    return {OLGA: Role.OBSERVER, 9: Role.ADMIN}.get(user_id, Role.OPERATOR)


class FakeBrowser:
    """A signed-in browser that reads at once."""

    def __init__(self, hub: Hub, user_id: int, *, session_id: int = 0, now: float = 0.0) -> None:
        self.hub = hub
        self.closed: list[tuple[int, str]] = []
        principal = Principal(UserId(user_id), NAMES[user_id], role_of(user_id), session_id or user_id, LATER)
        self.browser = Browser(
            hub.next_browser_number(),
            principal,
            now,
            wake=lambda: None,
            close=lambda code, why: self.closed.append((code, why)),
        )
        hub.attach_browser(self.browser, "2026-01-01T00:00:00+00:00", now)

    def events(self) -> list[ToBrowser]:
        return self.browser.take_events()

    def frames(self, now: float = 1e9) -> list[bytes]:
        return self.browser.outbox.take(now)

    def send(self, message: bytes, now: float = 0.0) -> None:
        self.hub.frames_from_browser(self.browser, message, now)


class HubWorld:
    """alice owns drone 1, bob owns drone 2, the admin owns none; every drone is sysid 1."""

    def __init__(self, *, height_limit_m: float = 0.0) -> None:
        self.hub = Hub(clock=lambda: NOW, height_limit_m=height_limit_m)
        self.revision = 0
        self.disabled: set[int] = set()
        self.apply(record(1, (1,)), record(2, (2,)))

    def apply(self, *records: DroneRecord) -> None:
        self.revision += 1
        users = {
            UserId(number): UserRecord(name, role_of(number), number in self.disabled) for number, name in NAMES.items()
        }
        sign_ins: dict[SignInId, SignInRecord] = {number: SignInRecord(UserId(number)) for number in NAMES}
        self.hub.apply_fleet(FleetSnapshot(self.revision, records, users, sign_ins))

    def agent(self, drone_id: int, *, link_id: int = 0, heard: bool = True, takes: Collection[str] = ()) -> FakeAgent:
        agent = FakeAgent(self.hub, drone_id, link_id=link_id or 100 + drone_id, takes=takes)
        if heard:
            agent.send(heartbeat())
        return agent

    def browser(self, user_id: int, **more: int) -> FakeBrowser:
        browser = FakeBrowser(self.hub, user_id, **more)
        browser.events()
        browser.frames()
        return browser
