"""Storage of leases: one transaction that reads, decides and writes with a compare-and-set on the epoch.

Knows the database and the rules, not the hub. The audit record is part of the same transaction, also for a refusal.
"""

import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from datetime import datetime
from typing import Final, Protocol, cast

from sqlalchemy import CursorResult, select, update
from sqlalchemy.exc import IntegrityError
from sqlalchemy.ext.asyncio import AsyncSession

from server.accounts.store.tables import UserRow
from server.audit.store.trail import TOWER as TOWER_ITSELF
from server.audit.store.trail import record
from server.control.core.lease import Actor, Changed, Event, Lease, Refused, decide
from server.control.store.tables import ControlLeaseRow
from server.fleet.store.snapshot import ties_of
from server.kernel.access import Action, Reach, reaches_all, roles_with
from server.kernel.clock import Clock
from server.kernel.people import Principal, Role, UserRef
from server.kernel.relations import Relation, Right, may, relation_of
from server.live.live_drone import LeaseView
from server.storage.database import Database
from wire.ids import DroneId, Epoch, UserId

MOVED: Final = Refused("control-changed", "the holder has just changed: check again")
HOLDS_ANOTHER: Final = Refused("holds-another", "release the drone that you are flying first")


@dataclass(frozen=True)
class Ask:
    """A request to change a lease. `by` is None if the tower acts by itself.

    `as_tower`: it is the tower's own event, whoever caused it. `about`: see Actor. `began_at`: perf_counter seconds.
    """

    drone_id: DroneId
    event: Event
    by: Principal | None
    reason: str
    began_at: float
    address: str = ""
    watch: bool = True
    moves_video: bool = False
    sticks_centred: bool = False
    interrupts: bool = False
    """With TAKE: the hold also interrupts a return or a landing flown by the autopilot."""
    as_tower: bool = False
    about: UserId | None = None


@dataclass(frozen=True)
class Committed:
    """What the database contains now, and the previous lease."""

    before: Lease
    changed: Changed
    view: LeaseView


class LeaseStore(Protocol):
    """What the service needs of a database."""

    async def commit(self, ask: Ask) -> Committed | Refused:
        """Decides on the present lease and writes the result; of two at the same time one is refused."""

    async def settle(self, ask: Ask) -> LeaseView:
        """Records that `ask` was not carried out in time. Returns the present lease, because the response to a commit
        may have been lost."""


RefuseElsewhere = Callable[[AsyncSession, DroneId], Awaitable[Refused | None]]


class DatabaseLeaseStore:
    """Leases in the tower's database."""

    def __init__(self, database: Database, clock: Clock) -> None:
        self._database = database
        self._clock = clock
        self.refuse_elsewhere: RefuseElsewhere | None = None
        """With several towers: a refusal unless this one is the drone's home."""

    async def commit(self, ask: Ask) -> Committed | Refused:
        """See LeaseStore."""
        try:
            async with self._database.writing(first=True) as session:
                outcome = await self._decide_and_write(session, ask)
                self._record(session, ask, outcome)
                await session.flush()
        except IntegrityError:
            # At the same time another request wrote the drone's first lease, or gave this operator another drone.
            return HOLDS_ANOTHER if ask.event in (Event.ACQUIRE, Event.ACCEPT) else MOVED
        return outcome

    async def settle(self, ask: Ask) -> LeaseView:
        """See LeaseStore."""
        async with self._database.writing(first=True) as session:
            row = await session.get(ControlLeaseRow, ask.drone_id)
            lease = lease_of_row(row) if row is not None else Lease()
            detail = {"reason": ask.reason, "result": "failed", "code": "database-unavailable", "epoch": lease.epoch}
            record(
                session,
                at=self._clock(),
                actor=ask.by or TOWER_ITSELF,
                action=f"control.{ask.event.value}",
                drone_id=ask.drone_id,
                detail=detail,
                address=ask.address,
            )
            named = {lease.holder, lease.taken_from, lease.assistant} - {None}
            users = {user.id: user for user in await session.scalars(select(UserRow).where(UserRow.id.in_(named)))}
            return view_of(lease, users)

    async def _decide_and_write(self, session: AsyncSession, ask: Ask) -> Committed | Refused:
        if self.refuse_elsewhere is not None:
            elsewhere = await self.refuse_elsewhere(session, ask.drone_id)
            if elsewhere is not None:
                return elsewhere
        row = await session.get(ControlLeaseRow, ask.drone_id, with_for_update=True)
        before = lease_of_row(row) if row is not None else Lease()
        outcome = decide(before, ask.event, await _actor(session, ask, before, self._clock()))
        if isinstance(outcome, Refused):
            return outcome
        after = outcome.lease
        named = {after.holder, after.taken_from, after.assistant} - {None}
        users = {user.id: user for user in await session.scalars(select(UserRow).where(UserRow.id.in_(named)))}
        holder = users.get(after.holder) if after.holder is not None else None
        values = {
            "holder_id": after.holder,
            "operator_holder_id": after.holder if holder is not None and _has_one_drone(holder) else None,
            "taken_from_id": after.taken_from,
            "offered": after.offered,
            "assistant_id": after.assistant,
            "view_taken": after.view_taken,
            "video_moved": after.video_moved,
            "epoch": after.epoch,
            "changed_at": self._clock(),
            "reason": ask.reason,
        }
        if row is None:
            session.add(ControlLeaseRow(drone_id=ask.drone_id, **values))
        else:
            written = await session.execute(
                update(ControlLeaseRow)
                .where(ControlLeaseRow.drone_id == ask.drone_id, ControlLeaseRow.epoch == before.epoch)
                .values(**values)
            )
            if cast("CursorResult[object]", written).rowcount != 1:
                return MOVED
        return Committed(before, outcome, view_of(after, users))

    def _record(self, session: AsyncSession, ask: Ask, outcome: Committed | Refused) -> None:
        detail: dict[str, object] = {"reason": ask.reason}
        if isinstance(outcome, Refused):
            if ask.as_tower:
                return  # too late, and not worth a record
            detail |= {"result": "refused", "code": outcome.code}
        else:
            view = outcome.view
            people = {"holder": view.holder, "taken_from": view.taken_from, "assistant": view.assistant}
            detail |= {"result": "done", "epoch": view.epoch}
            detail |= {part: ref.name if ref else None for part, ref in people.items()}
            if ask.event is Event.TAKE:
                detail |= {"view_taken": view.view_taken, "video_taken": view.view_taken or view.video_moved}
                detail |= {"interrupt": ask.interrupts}
        detail["took_ms"] = round((time.perf_counter() - ask.began_at) * 1000.0, 1)
        record(
            session,
            at=self._clock(),
            actor=ask.by or TOWER_ITSELF,
            action=f"control.{ask.event.value}",
            drone_id=ask.drone_id,
            detail=detail,
            address=ask.address,
        )


def view_of(lease: Lease, users: dict[int, UserRow]) -> LeaseView:
    return LeaseView(
        holder=_ref(users, lease.holder),
        taken_from=_ref(users, lease.taken_from),
        epoch=lease.epoch,
        offered=lease.offered,
        assistant=_ref(users, lease.assistant),
        view_taken=lease.view_taken,
        video_moved=lease.video_moved,
    )


def lease_of_row(row: ControlLeaseRow) -> Lease:
    """Returns the lease in a row."""
    return Lease(
        holder=_user_id(row.holder_id),
        taken_from=_user_id(row.taken_from_id),
        offered=row.offered,
        assistant=_user_id(row.assistant_id),
        view_taken=row.view_taken,
        video_moved=row.video_moved,
        epoch=Epoch(row.epoch),
    )


async def _actor(session: AsyncSession, ask: Ask, lease: Lease, now: datetime) -> Actor:
    if ask.as_tower or ask.by is None:
        return Actor(None, is_tower=True, about=ask.about)
    ties = await ties_of(session, ask.drone_id, now)
    relation = relation_of(ties, ask.by.user_id, ask.by.role)
    in_the_way = {lease.holder, lease.assistant} - {None}
    admins = select(UserRow.id).where(
        UserRow.id.in_(in_the_way), UserRow.role.in_(roles_with(Action.COMMAND, Reach.ALL))
    )
    outranked = relation is not Relation.ADMIN and (await session.scalars(admins)).first() is not None
    flying_elsewhere = set(
        await session.scalars(
            select(ControlLeaseRow.operator_holder_id).where(
                ControlLeaseRow.operator_holder_id.is_not(None), ControlLeaseRow.drone_id != ask.drone_id
            )
        )
    )
    may_fly = True
    if lease.taken_from is not None:
        owed = await session.get(UserRow, lease.taken_from)
        may_fly = (
            owed is not None
            and not owed.disabled
            and may(relation_of(ties, lease.taken_from, Role(owed.role)), Right.FLY)
            and lease.taken_from not in flying_elsewhere
        )
    return Actor(
        user_id=ask.by.user_id,
        is_admin=relation is Relation.ADMIN,
        is_team_admin=relation is Relation.TEAM_ADMIN,
        is_owner=may(relation, Right.FLY),
        outranked=outranked,
        holds_another=ask.by.user_id in flying_elsewhere,
        operator_may_fly=may_fly,
        watch=ask.watch,
        moves_video=ask.moves_video,
        sticks_centred=ask.sticks_centred,
    )


def _has_one_drone(holder: UserRow) -> bool:
    return not reaches_all(Role(holder.role), Action.HOLD_SEVERAL)


def _user_id(value: int | None) -> UserId | None:
    return None if value is None else UserId(value)


def _ref(users: dict[int, UserRow], user_id: UserId | None) -> UserRef | None:
    user = users.get(user_id) if user_id is not None else None
    return UserRef(UserId(user.id), user.name) if user is not None else None
