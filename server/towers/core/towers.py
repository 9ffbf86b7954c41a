"""One tower among several: whom it hears, whose browsers it has as visitors, and which drone belongs where.

The shell passes in packets and the time, and sends what `publish` is given. Everything is plain and returns at once.
"""

from collections.abc import Callable, Collection, Iterable
from typing import Final

from server.live.hub import Hub
from server.towers.core.home_directory import HomeDirectory
from server.towers.core.messages import (
    Answer,
    Ask,
    Beat,
    HandOver,
    Hello,
    Homes,
    InAir,
    MalformedPacket,
    Message,
    decode_messages,
    encode_bodies,
    encode_packet,
    read_header,
)
from server.towers.core.place import Place
from server.towers.core.streams import BEAT_EVERY_S, IncomingStream, OutgoingStream
from server.towers.core.visitors import Stop, Visitor, Visitors
from server.towers.core.visits import Visits
from wire.ids import DroneId
from wire.lateness import stamp_ms

IN_AIR_EVERY_S: Final = 0.5
"""How often the others are told where the drones here are. The separation watch looks as often."""
HANDED_OVER_FOR_S: Final = 4.0
"""A drone that comes later than this after its last tower's word counts as unknown: it holds."""


class OtherTower:
    """What is known of one of the others."""

    def __init__(self) -> None:
        self.incoming = IncomingStream()
        self.outgoing = OutgoingStream()
        self.waiting: list[Message] = []
        """To be sent with the next packet."""
        self.knows_us = False
        """It was told the browsers and drones of this tower in the present stream."""
        self.reaches_database = True
        self.revision = -1

    @property
    def is_ready(self) -> bool:
        return self.incoming.is_open and self.knows_us


class Towers:
    """One for a tower that shares a bus. It implements `Reach` for its visits."""

    def __init__(
        self,
        me: str,
        hub: Hub,
        *,
        publish: Callable[[str, bytes], None],
        begin_writing: Callable[[Visitor], Stop],
        wake: Callable[[], None] = lambda: None,
    ) -> None:
        """`publish`: sends a packet to a tower. `wake`: asks for a call of `flush` soon."""
        self.me = me
        self._hub = hub
        self._publish = publish
        self._wake = wake
        self._others: dict[str, OtherTower] = {}
        self._dirty = False
        self._beat_at = self._in_air_at = float("-inf")
        self.directory = HomeDirectory()
        self.visits = Visits(hub.state, hub.flood, self)
        self.visitors = Visitors(hub, send=self.send, begin_writing=begin_writing)
        self.reaches_database: Callable[[], bool] = lambda: True
        self.on_ask: Callable[[str, Ask], None] = lambda tower, ask: None
        self.on_answer: Callable[[str, Answer], None] = lambda tower, answer: None
        self.on_lost: Callable[[str], None] = lambda tower: None
        """This tower is not heard any more: what it was asked is not answered."""
        self.is_claiming: Callable[[DroneId], bool] = lambda drone_id: False
        """Whether this tower is about to become the home, because the drone's agent has just linked here."""
        self.on_newer_fleet: Callable[[int], None] = lambda revision: None
        self.packets_dropped = 0
        self._bus_versions: dict[str, int] = {}
        self._handed_over: dict[DroneId, tuple[int, int, float]] = {}
        hub.state.place_of = self.place_of
        hub.alerts.are_taken_over = self._takes_over_alerts
        hub.visits = self.visits

    # -- the other towers ------------------------------------------------------------------------------------

    def set_members(self, towers: Collection[str], now: float) -> None:
        """The towers that the database knows. Nobody else is listened to."""
        for tower in [one for one in self._others if one not in towers]:
            self._lost(tower, now)
            del self._others[tower]
            self._place((home for home, _ in self.directory.of(tower)), now)
        for tower in towers:
            if tower != self.me and tower not in self._others:
                self._others[tower] = OtherTower()
                self._open(tower, now, answers=False)

    @property
    def others(self) -> dict[str, OtherTower]:
        """By number of the tower. Read only."""
        return self._others

    def ready(self) -> Iterable[str]:
        """See Reach."""
        return [tower for tower, other in self._others.items() if other.is_ready]

    def home_of(self, drone_id: DroneId) -> str | None:
        """See Reach. This tower itself where it is the home."""
        return self.directory.home_of(drone_id)

    def others_decide(self) -> bool:
        """While this tower does not reach the database: whether another one may. Where nobody is heard, nobody knows,
        so it may."""
        heard = [other for other in self._others.values() if other.incoming.is_open]
        return any(other.reaches_database for other in heard) if heard else bool(self._others)

    def send(self, tower: str, message: Message) -> None:
        """See Reach."""
        other = self._others.get(tower)
        if other is not None and other.is_ready:
            self._put(other, message)

    def flush(self, now: float) -> None:
        """Sends what waits: one packet to each tower, or several if it is much."""
        self._dirty = False
        for tower, other in self._others.items():
            if other.waiting:
                waiting, other.waiting = other.waiting, []
                stream, sent_ms = other.outgoing.number, stamp_ms(now)
                for body in encode_bodies(waiting):
                    self._publish(tower, encode_packet(self.me, stream, other.outgoing.next(), sent_ms, body))

    def receive(self, packet: bytes, now: float) -> None:
        """A packet from the bus."""
        try:
            header = read_header(packet)
            other = self._others.get(header.sender)
            if other is None:
                raise MalformedPacket("no tower of this database")
            taken = other.incoming.receive(header.stream, header.sequence, header.sent_ms, now)
            messages = decode_messages(header.body) if taken.taken else []
        except MalformedPacket:
            self.packets_dropped += 1
            return
        if taken.broke:
            self._lost(header.sender, now, keeps_place=taken.opened)
        for message in messages:
            self._heard(header.sender, other, message, now)

    def tick(self, now: float) -> None:
        """Ten times a second."""
        for tower, other in self._others.items():
            if other.incoming.check(now):
                self._lost(tower, now)
        if now - self._beat_at < BEAT_EVERY_S:
            return
        self._beat_at = now
        self._tell_in_air(now)
        reaches = self.reaches_database()
        for tower, other in self._others.items():
            if other.outgoing.must_open(now):
                self._open(tower, now, answers=False)
            self._put(other, Beat(other.incoming.heard, reaches, self._hub.fleet.revision))
        self.flush(now)

    def understands(self, tower: str, version: int) -> bool:
        """Whether that tower knows the messages of this version of the bus."""
        return self._bus_versions.get(tower, 0) >= version

    def version_of(self, tower: str) -> int | None:
        """Of the bus, as the database says; None: it has not said it yet."""
        return self._bus_versions.get(tower)

    def _tell_in_air(self, now: float) -> None:
        """Also while nothing is in the air: what is not named has landed."""
        towers = [tower for tower in self.ready() if self.understands(tower, 2)]
        if not towers or now - self._in_air_at < IN_AIR_EVERY_S:
            return
        self._in_air_at = now
        message = InAir(self._hub.separation.in_air.told(now), self._hub.aircraft.shared(now))
        for tower in towers:
            self.send(tower, message)

    def _takes_over_alerts(self, drone_id: DroneId) -> bool:
        """Whether the drone's home, another tower, goes on with the alerts that it had here."""
        home = self.directory.home_of(drone_id)
        return home is not None and home != self.me and self.understands(home, 2)

    # -- places ----------------------------------------------------------------------------------------------

    def place_of(self, drone_id: DroneId) -> Place:
        home = self.directory.home_of(drone_id)
        if home is None:
            return Place.NOWHERE
        if home == self.me:
            return Place.HERE
        other = self._others.get(home)
        return Place.ELSEWHERE if other is not None and other.is_ready else Place.OUT_OF_REACH

    def claimed(self, homes: Iterable[tuple[int, int]], now: float) -> None:
        """The database has accepted these claims of this tower."""
        told = list(homes)
        self._place(self.directory.learn(self.me, told), now)
        for tower in self.ready():
            self.send(tower, Homes(told))

    def set_versions(self, versions: dict[str, int]) -> None:
        """Which messages the others understand."""
        self._bus_versions = versions

    def hand_over(self, drone_id: DroneId, epoch: int) -> None:
        """This tower's drone is about to link to another one, and all is well with it."""
        claim = self.directory.claim_of(drone_id)
        for tower in self.ready():
            if self.understands(tower, 1):
                self.send(tower, HandOver(drone_id, claim, epoch))

    def was_handed_over(self, drone_id: DroneId, claim: int, epoch: int, now: float) -> bool:
        """Whether the home before this claim has just said that all is well with the drone, and nobody has changed its
        lease since."""
        said = self._handed_over.pop(drone_id, None)
        return said is not None and said[:2] == (claim - 1, epoch) and now - said[2] <= HANDED_OVER_FOR_S

    def learn_homes(self, tower: str, homes: Iterable[tuple[int, int]], now: float) -> None:
        """The database knows these claims of that tower."""
        self._place(self.directory.learn(tower, homes), now)

    def _place(self, drone_ids: Iterable[int], now: float) -> None:
        for number in list(drone_ids):
            drone_id = DroneId(number)
            drone = self._hub.state.drones.get(drone_id)
            if drone is not None and (place := self.place_of(drone_id)) is not drone.place:
                self._hub.place_drone(drone_id, place, now, keeps_link=self.is_claiming(drone_id))
                self.visits.moved(drone_id)

    # -- inside ----------------------------------------------------------------------------------------------

    def _put(self, other: OtherTower, message: Message) -> None:
        other.waiting.append(message)
        if not self._dirty:
            self._dirty = True
            self._wake()

    def _open(self, tower: str, now: float, *, answers: bool) -> None:
        other = self._others[tower]
        other.waiting.clear()
        other.knows_us = False
        other.outgoing.open(now)
        self._put(other, Hello(answers))
        if answers:
            self._tell_all(tower, other, now)

    def _tell_all(self, tower: str, other: OtherTower, now: float) -> None:
        other.knows_us = True
        self._put(other, Homes(self.directory.of(self.me)))
        self.visits.opened(tower)
        self._place((home for home, _ in self.directory.of(tower)), now)

    def _lost(self, tower: str, now: float, *, keeps_place: bool = False) -> None:
        other = self._others[tower]
        self.visitors.left(tower, now)
        self.on_lost(tower)
        if not keeps_place:
            other.knows_us = False
            other.outgoing.reported(0)  # a bus that lost one direction may have lost both
            self._place((home for home, _ in self.directory.of(tower)), now)

    def _heard(self, tower: str, other: OtherTower, message: Message, now: float) -> None:
        match message:
            case Hello():
                if not message.answers:
                    self._open(tower, now, answers=True)
                elif not other.knows_us:
                    self._tell_all(tower, other, now)
            case Beat():
                other.reaches_database, other.revision = message.reaches_database, message.revision
                other.outgoing.reported(message.heard)
                if message.revision > self._hub.fleet.revision:
                    self.on_newer_fleet(message.revision)
            case Homes():
                self.learn_homes(tower, message.homes, now)
            case HandOver():
                if self.directory.home_of(DroneId(message.drone_id)) == tower:
                    self._handed_over[DroneId(message.drone_id)] = (message.claim, message.epoch, now)
            case InAir():
                late_s, home_of = other.incoming.late_s, self.directory.home_of
                self._hub.state.elsewhere.learn(tower, message.drones, now, late_s=late_s, home_of=home_of)
                self._hub.aircraft.heard_elsewhere(message.aircraft, now, late_s=late_s)
            case Ask():
                self.on_ask(tower, message)
            case Answer():
                self.on_answer(tower, message)
            case _:
                self.visitors.heard(tower, message, now)
                self.visits.heard(tower, message)
