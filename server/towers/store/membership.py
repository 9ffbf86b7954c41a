"""Makes a process one of several towers of its database (docs/adr/0012-several-towers.md).

The row of the exclusive lock says that towers with a bus have the database, so a tower without one is refused, and the
other way round. Each tower has a row of its own and renews it. Who does not, is declared dead by another one.
"""

from __future__ import annotations

import asyncio
import json
import os
import secrets
import socket
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from typing import Final, cast

import structlog
from sqlalchemy import Executable, Table, Text, bindparam, delete, exists, func, select
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.ext.asyncio import AsyncSession

from server.kernel.clock import Clock
from server.storage.database import Database, LockLost, open_database
from server.storage.repeated_statement import RepeatedStatement
from server.towers.core.tower_lease import (
    BUS,
    CHECK_EVERY_S,
    HOLD_AFTER_S,
    NOBODY,
    RENEW_EVERY_S,
    LockBelief,
    LockState,
    LockWatch,
)
from server.towers.store.tables import TowerMemberRow
from server.towers.store.tower_lock import REACHED_WITHIN_S, TowerLockHeld, awake_or_asleep_s, state_of
from server.towers.store.tower_lock_tables import THE_ROW, TowerLockRow

RENEW_WITHIN_S: Final = 0.7
"""Two attempts and the pause between them are shorter than the lease."""
_log = structlog.get_logger(__name__)


@dataclass(frozen=True)
class Member:
    """A running tower, as its row says."""

    tower: str
    renewals: int
    url: str = ""
    bus_version: int = 0
    draining: bool = False
    alerts_as: str = ""


def _by_tower(member: Member) -> str:
    return member.tower


def _renewal_of(tower: str) -> Executable:
    """One statement, because each tower repeats it twice a second. Its value: all towers as JSON, or NULL if `tower` is
    none of them. All towers write the common row, so it comes last. If a tower without a bus takes that row while this
    waits for it, the own row is counted all the same, which decides nothing then."""
    members, common = cast("Table", TowerMemberRow.__table__), cast("Table", TowerLockRow.__table__)
    with_a_bus = (common.c.id == THE_ROW, common.c.owner == BUS)
    mine = (
        members.update()
        .where(members.c.tower == tower, exists(select(common.c.id).where(*with_a_bus)))
        .values(renewals=members.c.renewals + 1, doing=bindparam("doing"), alerts_as=bindparam("alerts_as"))
        .returning(members.c.tower)
        .cte("mine")
    )
    lock = (
        common.update()
        .where(*with_a_bus, exists(select(mine.c.tower)))
        .values(renewals=common.c.renewals + 1, renewed_at=bindparam("at"))
        .returning(common.c.id)
        .cte("lock")
    )
    values = [members.c[name.name] for name in fields(Member)]
    found = func.json_agg(func.json_build_array(*values))
    return select(found.cast(Text)).where(exists(select(lock.c.id)))


class MemberBelief(LockBelief):
    """Whether a tower may trust that it still is one. While the database is silent, the bus tells whether another tower
    can reach it, and could declare this one dead."""

    def __init__(self, began_at: float, others_decide: Callable[[], bool]) -> None:
        super().__init__(began_at)
        self._others_decide = others_decide

    @property
    def is_watched(self) -> bool:
        return self._others_decide()


class TowerMembership:
    """The place of one process among the towers. Has the interface of TowerLock."""

    def __init__(self, database_url: str, *, clock: Clock, now: Callable[[], float] = awake_or_asleep_s) -> None:
        self._url = database_url
        self._clock = clock
        self._now = now
        self.tower = secrets.token_hex(16)
        self._database: Database | None = None
        self._renewal: RepeatedStatement | None = None
        self._belief: MemberBelief | None = None
        self._watches: dict[str, LockWatch] = {}
        self._answered = True
        self._ending: set[asyncio.Task[list[Member] | None]] = set()
        self._running_out: asyncio.TimerHandle | None = None
        self.members: frozenset[str] = frozenset()
        """All towers, this one included."""
        self.present: tuple[Member, ...] = ()
        """The same, with what their rows say but their counters."""
        self.own_url = ""
        """Where agents reach this tower alone. Set it before `take`."""
        self.bus_version = 0
        self.doing = ""
        """How far this tower is with ending its work, for people: written with each renewal."""
        self.alerts_as = ""
        """The subject of this tower's own alerts: written with each renewal."""
        self.on_present: Callable[[], None] = lambda: None
        """`present` has changed."""
        self.others_decide: Callable[[], bool] = lambda: True
        self.on_members: Callable[[frozenset[str]], None] = lambda members: None
        self.address = ""
        self.on_lost: Callable[[str], None] = lambda words: None
        self.on_running_out: Callable[[], None] = lambda: None
        self.lost_words = ""

    @property
    def is_taken(self) -> bool:
        return self._belief is not None

    def may_act(self) -> bool:
        """Whether this process may still act as a tower."""
        return self._belief is not None and self._belief.may_act(self._now())

    async def confirmed(self) -> bool:
        """The same: other towers take over what this one had, so nothing waits for it."""
        return self.may_act()

    @property
    def is_renewed(self) -> bool:
        """Whether the last attempt to write the renewal succeeded."""
        return self._answered and self.may_act()

    async def take(self, *, waits: bool) -> None:
        """Returns as one of the towers. Raises TowerLockHeld while a tower without a bus has the database."""
        watch, gives_up_at = LockWatch(), self._now() + REACHED_WITHIN_S
        while True:
            try:
                state, began_at = await self._join(watch)
                if state is None:
                    self._belief = MemberBelief(began_at, lambda: self.others_decide())
                    return
            except (SQLAlchemyError, OSError):
                if not waits and self._now() >= gives_up_at:
                    raise
                watch.unanswered()
            else:
                if watch.is_alive and not waits:
                    raise TowerLockHeld(state)
            await asyncio.sleep(CHECK_EVERY_S)

    async def _join(self, watch: LockWatch) -> tuple[LockState | None, float]:
        """None with the time of the attempt: it has joined. Otherwise the state of the lock that another one has."""
        began_at = self._now()
        async with asyncio.timeout(RENEW_WITHIN_S), self._open().writing() as session:
            row = (
                await session.scalars(select(TowerLockRow).where(TowerLockRow.id == THE_ROW).with_for_update())
            ).one()
            state = state_of(row)
            if state.owner != BUS:
                if not watch.may_take(state, self._now()):
                    return state, began_at
                row.owner, row.renewals = BUS, 0
                row.host, row.pid = socket.gethostname()[:255], os.getpid()
                row.taken_at = self._clock()
            row.address = self.address[:255]
            mine = TowerMemberRow(
                tower=self.tower,
                host=socket.gethostname()[:255],
                pid=os.getpid(),
                address=self.address[:255],
                joined_at=self._clock(),
                url=self.own_url,
                bus_version=self.bus_version,
            )
            await session.merge(mine)  # the answer to an earlier attempt may have been lost
        return None, began_at

    async def keep(self) -> None:
        """Renews the membership until it is lost or the call is cancelled."""
        while await self._renew_once():  # noqa: ASYNC110  # it is the pause between two renewals
            await asyncio.sleep(RENEW_EVERY_S)

    async def _renew_once(self) -> bool:
        belief = self._belief
        assert belief is not None
        if belief.is_lost:
            return False
        began_at = self._now()
        attempt = asyncio.create_task(self._write_renewal())
        try:
            await asyncio.wait({attempt}, timeout=RENEW_WITHIN_S)
        finally:
            if not attempt.done():
                attempt.cancel()
                self._ending.add(attempt)
                attempt.add_done_callback(self._ended)
        answered = attempt not in self._ending
        try:
            found = attempt.result() if answered else None
        except (SQLAlchemyError, OSError):
            answered, found = False, None
        if answered != self._answered:
            self._answered = answered
            (_log.info if answered else _log.error)("tower_renewed" if answered else "tower_not_renewed")
        if not answered:
            belief.unanswered(began_at)
            self._watches.clear()  # the others could not renew either, perhaps
            return True
        if found is None:
            self._lose()
            return False
        belief.renewed(began_at)
        self._watch_lease(began_at)
        await self._watch_others(found)
        return True

    async def _write_renewal(self) -> list[Member] | None:
        """Returns all towers with their counters; None if this one is none of them."""
        if self._renewal is None:
            self._renewal = self._open().repeated(_renewal_of(self.tower))
        found = await self._renewal.scalar(doing=self.doing[:255], alerts_as=self.alerts_as, at=self._clock())
        return None if found is None else [Member(*values) for values in json.loads(found)]

    async def _watch_others(self, found: list[Member]) -> None:
        members = {one.tower for one in found}
        for gone in [one for one in self._watches if one not in members]:
            del self._watches[gone]
        for tower, renewals in [(one.tower, one.renewals) for one in found]:
            if tower == self.tower:
                continue
            watch = self._watches.setdefault(tower, LockWatch())
            if watch.may_take(LockState(tower, renewals), self._now()) and await self._declare_dead(tower, renewals):
                members.discard(tower)
        present = tuple(sorted((replace(one, renewals=0) for one in found if one.tower in members), key=_by_tower))
        is_new, self.present = present != self.present, present
        if frozenset(members) != self.members:
            self.members = frozenset(members)
            self.on_members(self.members)
        if is_new:
            self.on_present()

    async def _declare_dead(self, tower: str, renewals: int) -> bool:
        dead = delete(TowerMemberRow).where(TowerMemberRow.tower == tower, TowerMemberRow.renewals == renewals)
        try:
            async with asyncio.timeout(RENEW_WITHIN_S), self._open().writing() as session:
                gone = await session.scalar(dead.returning(TowerMemberRow.tower)) is not None
        except (SQLAlchemyError, OSError):
            return False
        if gone:
            _log.warning("tower_declared_dead", tower=tower)
        return gone

    def _watch_lease(self, began_at: float) -> None:
        if self._running_out is not None:
            self._running_out.cancel()
        self._running_out = asyncio.get_running_loop().call_later(began_at + HOLD_AFTER_S - self._now(), self._runs_out)

    def _runs_out(self) -> None:
        belief = self._belief
        if belief is not None and not belief.is_lost and belief.must_hold(self._now() + 0.05):
            _log.error("tower_membership_runs_out")
            self.on_running_out()

    def _lose(self) -> None:
        belief = self._belief
        if belief is None or belief.is_lost:
            return
        belief.is_lost = True
        self.lost_words = (
            "the other towers of this database have declared this one dead. It had not renewed its row for "
            f"{belief.silent_for_s(self._now()):.1f} s; it has closed every link and ends"
        )
        _log.error("tower_membership_lost", words=self.lost_words)
        self.on_lost(self.lost_words)

    async def check(self, session: AsyncSession) -> None:
        """Inside a transaction that is about to write: raises LockLost if this process is no tower any more."""
        if self._belief is None:
            return
        if not self._belief.is_lost:
            mine = select(TowerMemberRow.tower).where(TowerMemberRow.tower == self.tower)
            if await session.scalar(mine.with_for_update(read=True, key_share=True)) is not None:
                return
            self._lose()
        raise LockLost("this process is no tower of this database any more")

    async def release(self) -> None:
        """Leaves the towers. The last one frees the database."""
        if self._belief is not None and not self._belief.is_lost:
            with suppress(SQLAlchemyError, OSError):
                async with asyncio.timeout(RENEW_WITHIN_S), self._open().writing() as session:
                    row = select(TowerLockRow).where(TowerLockRow.id == THE_ROW).with_for_update()
                    lock = (await session.scalars(row)).one()
                    await session.execute(delete(TowerMemberRow).where(TowerMemberRow.tower == self.tower))
                    left = await session.scalar(select(TowerMemberRow.tower).limit(1))
                    if left is None and lock.owner == BUS:
                        lock.owner, lock.address, lock.pid = NOBODY, "", 0
        self._belief = None
        if self._running_out is not None:
            self._running_out.cancel()
        if self._ending:
            await asyncio.wait(self._ending, timeout=RENEW_WITHIN_S)
        if self._database is not None:
            await self._database.close()
            self._database, self._renewal = None, None

    def _ended(self, attempt: asyncio.Task[list[Member] | None]) -> None:
        self._ending.discard(attempt)
        if not attempt.cancelled():
            attempt.exception()  # nobody else retrieves it

    def _open(self) -> Database:
        if self._database is None:
            self._database = open_database(self._url, timeout_s=RENEW_WITHIN_S)
        return self._database
