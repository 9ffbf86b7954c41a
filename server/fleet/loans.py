"""The rules of lending: a drone, to a user, until a time, within limits; and whoever ends what is over.

Every rule takes a session of `Database.writing()`, so that a rule and its audit record live or die together.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Final

import structlog
from sqlalchemy import select
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.ext.asyncio import AsyncSession

from server.accounts.users import get_user
from server.audit.deed import Deed
from server.audit.trail import TOWER
from server.beats import rest
from server.clock import Clock
from server.database import Database
from server.fleet.drones import get_drone
from server.fleet.live_picture import LivePicture
from server.fleet.roster import Roster
from server.fleet.snapshot import begin_fleet_change
from server.fleet.tables import LoanRow, OwnershipRow
from server.refusal import Refusal

LONGEST: Final = timedelta(days=366)
LOOK_EVERY_S: Final = 0.25
_log = structlog.get_logger(__name__)


class OwnerAlready(Refusal):
    def __init__(self) -> None:
        super().__init__("this user owns the drone: there is nothing to lend")


class BadLoan(Refusal):
    """Not a time until which a drone can be lent."""


@dataclass(frozen=True)
class Terms:
    until: datetime
    may_arm: bool
    max_height_m: float | None
    radius_m: float | None


async def lend(session: AsyncSession, *, drone_id: int, user_id: int, terms: Terms, deed: Deed) -> None:
    """Lending again changes the terms."""
    if not deed.at < terms.until <= deed.at + LONGEST:
        raise BadLoan("a loan ends in the future, within a year")
    await begin_fleet_change(session)
    drone, user = await get_drone(session, drone_id), await get_user(session, user_id)
    if await session.get(OwnershipRow, (drone_id, user_id)) is not None:
        raise OwnerAlready
    row = await session.get(LoanRow, (drone_id, user_id))
    if row is None:
        row = LoanRow(drone_id=drone_id, user_id=user_id)
        session.add(row)
    row.until, row.may_arm = terms.until, terms.may_arm
    row.max_height_m, row.radius_m = terms.max_height_m, terms.radius_m
    deed.record(
        session,
        "drone.lent",
        drone_id=drone_id,
        drone=drone.name,
        user_id=user_id,
        user=user.name,
        until=terms.until.isoformat(),
        may_arm=terms.may_arm,
        max_height_m=terms.max_height_m,
        radius_m=terms.radius_m,
    )


async def end_loan(session: AsyncSession, *, drone_id: int, user_id: int, deed: Deed) -> None:
    """Ending one that is not there changes nothing."""
    await begin_fleet_change(session)
    drone, user = await get_drone(session, drone_id), await get_user(session, user_id)
    row = await session.get(LoanRow, (drone_id, user_id))
    if row is not None:
        await session.delete(row)
        deed.record(session, "drone.loan_ended", drone_id=drone_id, drone=drone.name, user_id=user_id, user=user.name)


class LoanKeeper:
    """Ends loans at their time: at once in the live picture, whether or not the database can be reached, then there."""

    def __init__(self, database: Database, picture: LivePicture, roster: Roster, clock: Clock) -> None:
        self._database = database
        self._picture = picture
        self._roster = roster
        self._clock = clock
        self._to_write = True

    async def watch(self) -> None:
        """Until cancelled."""
        while True:
            self._to_write = self._picture.end_loans(self._clock()) or self._to_write
            if self._to_write:
                try:
                    await self._write()
                except (SQLAlchemyError, OSError) as error:
                    _log.error("loan_end_not_written", error=type(error).__name__)
            await rest(LOOK_EVERY_S)

    async def _write(self) -> None:
        now = self._clock()
        async with self._database.writing() as session:
            over = (await session.scalars(select(LoanRow).where(LoanRow.until <= now))).all()
            if over:
                await begin_fleet_change(session)
            for row in over:
                deed = Deed(by=TOWER, at=now)
                deed.record(session, "drone.loan_expired", drone_id=row.drone_id, user_id=row.user_id)
                await session.delete(row)
        self._to_write = False
        if over:
            await self._roster.refresh()
