"""A snapshot of the fleet in the database, for the hub. Contains no live state."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection
from datetime import datetime
from typing import Final

from sqlalchemy import select, update
from sqlalchemy.ext.asyncio import AsyncSession

from server.accounts.store.tables import ApiTokenRow, SessionRow, UserRow
from server.control.store.tables import ControlLeaseRow
from server.fleet.store.tables import (
    DroneRow,
    FleetRevisionRow,
    LoanRow,
    OwnershipRow,
    RestraintRow,
    ShareLimitRow,
)
from server.kernel.fleet import DroneRecord, FleetSnapshot, LoanRecord, SignInRecord, TeamRecord, UserRecord
from server.kernel.people import Role, SignInId, TokenId, UserRef
from server.kernel.relations import TeamRole, Ties
from server.kernel.restraint import Measure, Restraint
from server.kernel.scopes import scopes_in
from server.storage.in_slices import slices
from server.teams.store.tables import TeamDroneRow, TeamMemberRow, TeamRow
from wire.drone_key import key_bytes
from wire.ids import DroneId, Epoch, UserId

REVISION: Final = select(FleetRevisionRow.revision)


MAX_NEWER: Final = 1_000
MEMBERS_AT_ONCE: Final = 500
SIGN_INS_AT_ONCE: Final = 500
"""Each change of the fleet reads all of them."""


async def read_revision(session: AsyncSession) -> int:
    return await session.scalar(REVISION) or 0


async def begin_fleet_change(session: AsyncSession) -> None:
    """Counts a change of drones, ownerships, users or API tokens. Call it first in the transaction that makes the
    change: on PostgreSQL it also serialises such transactions, so that two cannot both demote the last admin."""
    await session.execute(
        update(FleetRevisionRow).where(FleetRevisionRow.id == 1).values(revision=FleetRevisionRow.revision + 1)
    )


async def load_snapshot(session: AsyncSession, now: datetime | None = None) -> FleetSnapshot:
    """Needs a session of `Database.reading()` for a consistent snapshot. Omits loans that are over at `now`."""
    revision = await read_revision(session)
    users: dict[UserId, UserRecord] = {}
    columns = (UserRow.id, UserRow.name, UserRow.role, UserRow.disabled, UserRow.must_change_password)
    for user in await session.execute(select(*columns)):
        users[UserId(user.id)] = UserRecord(user.name, Role(user.role), user.disabled, user.must_change_password)

    def ref(user_id: int | None) -> UserRef | None:
        return None if user_id is None else UserRef(UserId(user_id), users[UserId(user_id)].name)

    owners: defaultdict[int, list[UserRef]] = defaultdict(list)
    # Columns, not objects: each change of the fleet reads a thousand drones while frames wait.
    owned = select(OwnershipRow.drone_id, OwnershipRow.user_id)
    for own in await session.execute(owned.order_by(OwnershipRow.drone_id, OwnershipRow.user_id)):
        owners[own.drone_id].append(UserRef(UserId(own.user_id), users[UserId(own.user_id)].name))
    loans: defaultdict[int, list[LoanRecord]] = defaultdict(list)
    for loan in await session.scalars(select(LoanRow).order_by(LoanRow.drone_id, LoanRow.user_id)):
        borrower = ref(loan.user_id)
        if borrower is not None and (now is None or loan.until > now):
            record = LoanRecord(borrower, loan.until, loan.may_arm, loan.max_height_m, loan.radius_m)
            loans[loan.drone_id].append(record)
    teams = await _teams(session)
    restraints = {one.drone_id: _restraint(one) for one in await session.scalars(select(RestraintRow))}
    leases = {one.drone_id: one for one in await session.scalars(select(ControlLeaseRow))}

    drones = []
    known = select(DroneRow.id, DroneRow.name, DroneRow.credential_hash, DroneRow.public_key, DroneRow.key_since)
    for drone in await session.execute(known.order_by(DroneRow.id)):
        lease = leases.get(drone.id)
        drones.append(
            DroneRecord(
                id=DroneId(drone.id),
                name=drone.name,
                owners=tuple(owners[drone.id]),
                credential_hash=drone.credential_hash,
                holder=ref(lease.holder_id) if lease else None,
                epoch=Epoch(lease.epoch if lease else 0),
                taken_from=ref(lease.taken_from_id) if lease else None,
                offered=lease.offered if lease else False,
                assistant=ref(lease.assistant_id) if lease else None,
                view_taken=lease.view_taken if lease else False,
                video_moved=lease.video_moved if lease else False,
                loans=tuple(loans[drone.id]),
                public_key=key_bytes(drone.public_key) if drone.public_key else b"",
                key_since=drone.key_since,
                team=teams.get(drone.id),
                restraint=restraints.get(drone.id),
            )
        )
    limits = await session.execute(select(ShareLimitRow.name, ShareLimitRow.value))
    return FleetSnapshot(
        revision=revision,
        drones=tuple(drones),
        users=users,
        sign_ins=await _sign_ins(session),
        share_limits={row.name: row.value for row in limits},
    )


async def _sign_ins(session: AsyncSession) -> dict[SignInId, SignInRecord]:
    found: dict[SignInId, SignInRecord] = {}
    records: dict[tuple[int, str], SignInRecord] = {}
    """By user and scopes: most people have several that say the same."""
    async for some in slices(session, select(SessionRow.id, SessionRow.user_id), rows=SIGN_INS_AT_ONCE):
        for one in some:
            record = records.get((one.user_id, ""))
            if record is None:
                record = records[one.user_id, ""] = SignInRecord(UserId(one.user_id))
            found[one.id] = record
    tokens = select(ApiTokenRow.id, ApiTokenRow.user_id, ApiTokenRow.scopes)
    async for part in slices(session, tokens, rows=SIGN_INS_AT_ONCE):
        for token in part:
            key = token.user_id, token.scopes
            record = records.get(key)
            if record is None:
                record = records[key] = SignInRecord(UserId(token.user_id), scopes_in(token.scopes))
            found[TokenId(token.id)] = record
    return found


async def sessions_among(session: AsyncSession, session_ids: Collection[int]) -> dict[SignInId, SignInRecord]:
    """Returns those among these sessions that have not ended."""
    query = select(SessionRow.id, SessionRow.user_id).where(SessionRow.id.in_(session_ids))
    return {one.id: SignInRecord(UserId(one.user_id)) for one in await session.execute(query)}


async def sessions_after(session: AsyncSession, session_id: int) -> dict[SignInId, SignInRecord]:
    """Returns those with a greater number, the oldest first and at most MAX_NEWER."""
    query = select(SessionRow.id, SessionRow.user_id).where(SessionRow.id > session_id)
    found = await session.execute(query.order_by(SessionRow.id).limit(MAX_NEWER))
    return {one.id: SignInRecord(UserId(one.user_id)) for one in found}


def _restraint(row: RestraintRow) -> Restraint:
    return Restraint(Measure(row.measure), row.reason, row.by_name, row.by_admin, row.since)


async def ties_of(session: AsyncSession, drone_id: int, now: datetime) -> Ties:
    """Returns the people related to one drone, as of this transaction."""
    owners = await session.scalars(select(OwnershipRow.user_id).where(OwnershipRow.drone_id == drone_id))
    on_loan = select(LoanRow.user_id).where(LoanRow.drone_id == drone_id, LoanRow.until > now)
    crew = select(TeamMemberRow.user_id, TeamMemberRow.role)
    crew = crew.join(TeamDroneRow, TeamDroneRow.team_id == TeamMemberRow.team_id)
    return Ties(
        owners=frozenset(UserId(one) for one in owners),
        borrowers=frozenset(UserId(one) for one in await session.scalars(on_loan)),
        crew={
            UserId(one.user_id): TeamRole(one.role)
            for one in await session.execute(crew.where(TeamDroneRow.drone_id == drone_id))
        },
    )


async def _teams(session: AsyncSession) -> dict[int, TeamRecord]:
    """Returns teams by drone. The drones of a team share one crew."""
    crews: defaultdict[int, dict[UserId, TeamRole]] = defaultdict(dict)
    roles = {role.value: role for role in TeamRole}
    members = select(TeamMemberRow.team_id, TeamMemberRow.user_id, TeamMemberRow.role)
    async for some in slices(session, members, rows=MEMBERS_AT_ONCE):
        for member in some:
            crews[member.team_id][UserId(member.user_id)] = roles[member.role]
    grouped = select(TeamDroneRow.drone_id, TeamDroneRow.since, TeamRow.id, TeamRow.name)
    return {
        row.drone_id: TeamRecord(row.id, row.name, crews[row.id], row.since)
        for row in await session.execute(grouped.join(TeamRow, TeamRow.id == TeamDroneRow.team_id))
    }
