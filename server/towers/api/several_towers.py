"""Runs one tower among several: the bus, the members in the database, and the periodic work."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping, Sequence
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Final

import structlog

from server.fleet.store.roster import Roster
from server.kernel.fleet import SignInRecord
from server.kernel.people import SignInId
from server.link.api.live_writer import LiveWriter
from server.link.api.write_round import WriteRound
from server.live.hub import Hub
from server.runtime.aligned_timers import rest
from server.storage.database import DatabaseUnavailable
from server.towers.api.asking import Asking
from server.towers.api.draining import Draining
from server.towers.api.nats_bus import HIGH_WATER_BYTES, NatsBus
from server.towers.api.video_bus import VideoBus
from server.towers.core.messages import SEALS, EventUp, FramesUp
from server.towers.core.towers import Towers
from server.towers.core.visitors import Stop, Visitor
from server.towers.store.claims import Claims
from server.towers.store.membership import TowerMembership
from wire.tower_list import MAX_TOWERS

TICK_S: Final = 0.1
LEARNT_EVERY_S: Final = 10
"""How often the homes are read from the database, beside what the towers tell each other."""
MAX_LOOKED_UP: Final = 500
"""Sessions in one query."""
READ_AGAIN: Final = 100
"""Numbers of sessions: the database gives them before the rows are there."""
ReadSessions = Callable[[Sequence[int]], Awaitable[Mapping[SignInId, SignInRecord]]]
ReadNewerSessions = Callable[[int], Awaitable[Mapping[SignInId, SignInRecord]]]
_log = structlog.get_logger(__name__)


class _VisitorWriter:
    """Where the messages of one visitor go."""

    def __init__(self, visitor: Visitor, towers: Towers, room: _Room) -> None:
        self._visitor = visitor
        self._towers = towers
        self._room = room
        self.on_room: Callable[[], None] = lambda: None

    def has_room(self) -> bool:
        return self._room.is_there_for(self)

    def write_binary(self, payload: bytes) -> None:
        self._room.unflushed_bytes += len(payload)
        self._towers.send(self._visitor.tower, FramesUp(self._visitor.remote, payload))

    def write_text(self, payload: bytes) -> None:
        self._room.unflushed_bytes += len(payload)
        self._towers.send(self._visitor.tower, EventUp(self._visitor.remote, payload))


class _Room:
    """Whether the bus takes more for visitors, and who has to be told when it does. What is written is on the bus only
    after the next flush, so it counts from the write on: the picture of a thousand drones is more than a packet."""

    def __init__(self, bus: NatsBus) -> None:
        self._bus = bus
        self._waiting: set[_VisitorWriter] = set()
        self.unflushed_bytes = 0

    def is_there_for(self, writer: _VisitorWriter) -> bool:
        if self.unflushed_bytes < HIGH_WATER_BYTES and self._bus.has_room():
            return True
        self._waiting.add(writer)
        return False

    def tick(self) -> None:
        """Ten times a second."""
        if self._waiting and self.unflushed_bytes < HIGH_WATER_BYTES and self._bus.has_room():
            waiting, self._waiting = self._waiting, set()
            for writer in waiting:
                writer.on_room()

    def left(self, writer: _VisitorWriter) -> None:
        self._waiting.discard(writer)


class SeveralTowers:
    """The parts of a tower that shares a bus. `claims` is set once the control service exists."""

    claims: Claims

    def __init__(
        self,
        url: str,
        membership: TowerMembership,
        hub: Hub,
        *,
        keys: Callable[[], Sequence[bytes]],
        authority: Path | None = None,
    ) -> None:
        """`keys`: with which towers seal what they say."""
        self._membership = membership
        self._hub = hub
        self._round = WriteRound()
        self.bus = NatsBus(url, membership.tower, on_packet=self._received, keys=keys, authority=authority)
        self._room = _Room(self.bus)
        self.towers = Towers(
            membership.tower, hub, publish=self.bus.publish, begin_writing=self._begin_writing, wake=self._flush_soon
        )
        self.video = VideoBus(
            url, membership.tower, hub, self.towers, may_act=membership.may_act, keys=keys, authority=authority
        )
        self.bus.is_older = self.video.bus.is_older = self._seals_nothing
        self.towers.reaches_database = lambda: membership.is_renewed
        self.asking = Asking(self.towers)
        self.asking.principal_of = hub.fleet.principal_of
        self.towers.visitors.on_unknown = self._look_up_soon
        self._looking_up: asyncio.Task[None] | None = None
        self.read_sessions: ReadSessions | None = None
        """Looks sessions up in the database. Raises DatabaseUnavailable, OSError."""
        self.read_newer_sessions: ReadNewerSessions | None = None
        """All those with a greater number."""
        membership.others_decide = self.towers.others_decide
        self._refreshing: asyncio.Task[None] | None = None
        self._draining: asyncio.Task[None] | None = None
        self.on_drained: Callable[[], None] = lambda: None
        """Nobody is left here: the process may end."""
        self._roster: Roster | None = None

    async def open(self) -> None:
        """Both connections to the bus. Raises BusUnavailable."""
        await self.bus.open()
        await self.video.open()

    async def close(self) -> None:
        """Idempotent."""
        await self.video.close()
        await self.bus.close()

    @asynccontextmanager
    async def running(self, roster: Roster) -> AsyncIterator[None]:
        """Joins the others. Raises BusUnavailable. The bus is open on entry (`open`)."""
        self._roster = roster
        membership = self._membership
        membership.on_members = lambda members: self.towers.set_members(members, time.monotonic())
        self.towers.on_newer_fleet = self._refresh
        membership.on_present = self._present
        if membership.members:
            membership.on_members(membership.members)
        self._present()
        await self.claims.learn()
        beating = asyncio.create_task(self._beat())
        working = asyncio.create_task(self._each_second())
        try:
            yield
        finally:
            begun = (beating, working, self._refreshing, self._draining, self._looking_up)
            tasks = [one for one in begun if one is not None]
            for one in tasks:
                one.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            await self.claims.stop()
            await self.asking.stop()

    def _present(self) -> None:
        """The towers that the database knows, or what they say of themselves, have changed."""
        present = self._membership.present
        self.towers.set_versions({one.tower: one.bus_version for one in present})
        # A tower that is not heard stays in the list until it is declared dead: the bus may be lost, not the tower.
        self._hub.links.tell_towers(tuple(one.url for one in present if one.url and not one.draining)[:MAX_TOWERS])
        mine = next((one for one in present if one.tower == self._membership.tower), None)
        if mine is not None and mine.draining and self._draining is None:
            self._draining = asyncio.create_task(self._drain())

    def keeps_alerts_as(self, subject: str) -> None:
        """The subject of this tower's own alerts, for the others."""
        self._membership.alerts_as = subject

    def alert_subjects(self) -> frozenset[str] | None:
        """The subjects of all running towers' own alerts; None if one is not known."""
        subjects = frozenset(one.alerts_as for one in self._membership.present)
        return subjects if subjects and "" not in subjects else None

    def is_first(self) -> bool:
        """Whether this tower does what one of the running towers has to do."""
        membership = self._membership
        return membership.is_renewed and membership.tower == min(membership.members, default="")

    @property
    def is_draining(self) -> bool:
        return self._draining is not None

    async def _drain(self) -> None:
        def report(words: str) -> None:
            self._membership.doing = words

        await Draining(self._hub, self.towers, report=report).run()
        self.on_drained()

    def _seals_nothing(self, tower: str) -> bool:
        version = self.towers.version_of(tower)
        return version is not None and version < SEALS

    def _received(self, packet: bytes) -> None:
        if self._membership.may_act():
            self.towers.receive(packet, time.monotonic())

    def _flush_soon(self) -> None:
        asyncio.get_running_loop().call_soon(self._flush)

    def _flush(self) -> None:
        self._room.unflushed_bytes = 0
        self.towers.flush(time.monotonic())

    async def _learn_sessions(self) -> None:
        """So that this tower knows them while the database is out of reach. Raises DatabaseUnavailable, OSError."""
        if self.read_newer_sessions is not None:
            fleet = self._hub.fleet
            fleet.note_sign_ins(await self.read_newer_sessions(max(0, fleet.newest_session - READ_AGAIN)))

    def _look_up_soon(self) -> None:
        if self.read_sessions is not None and (self._looking_up is None or self._looking_up.done()):
            self._looking_up = asyncio.create_task(self._look_up(self.read_sessions))

    async def _look_up(self, read: ReadSessions) -> None:
        """Sessions that are newer than this tower's picture of the fleet. What is not found is asked for again with the
        next browser."""
        visitors, asked = self.towers.visitors, set[int]()
        while wanted := sorted(visitors.unknown_sessions() - asked)[:MAX_LOOKED_UP]:
            asked.update(wanted)
            try:
                found = await read(wanted)
            except (DatabaseUnavailable, OSError) as error:
                _log.debug("sessions_not_read", error=type(error).__name__)
                return
            self._hub.fleet.note_sign_ins(found)
            visitors.fleet_changed(time.monotonic())

    def _begin_writing(self, visitor: Visitor) -> Stop:
        writer = _VisitorWriter(visitor, self.towers, self._room)
        live = LiveWriter(visitor, writer, self._round, self._hub.state.traffic)

        def stop() -> None:
            live.stop()
            self._room.left(writer)

        return stop

    async def _beat(self) -> None:
        while True:
            await rest(TICK_S)
            if not self._membership.may_act():
                continue
            self.towers.tick(time.monotonic())
            self.video.tick(time.monotonic())
            self._room.tick()

    async def _each_second(self) -> None:
        revision, seconds = -1, 0
        while True:
            await rest(1.0)
            seconds += 1
            now = time.monotonic()
            if self._hub.fleet.revision != revision:
                revision = self._hub.fleet.revision
                self.towers.visitors.fleet_changed(now)
            self.claims.check_links(now)
            try:
                await self._learn_sessions()
                await self.claims.adopt()
                if seconds % LEARNT_EVERY_S == 0:
                    await self.claims.learn()
            except (DatabaseUnavailable, OSError) as error:
                _log.debug("towers_not_read", error=type(error).__name__)

    def _refresh(self, revision: int) -> None:
        if self._roster is None or (self._refreshing is not None and not self._refreshing.done()):
            return
        self._refreshing = asyncio.create_task(self._refresh_now(self._roster))

    @staticmethod
    async def _refresh_now(roster: Roster) -> None:
        try:
            await roster.refresh()
        except (DatabaseUnavailable, OSError) as error:
            _log.debug("roster_not_read", error=type(error).__name__)
