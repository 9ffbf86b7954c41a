"""The control desk: carries a decision of the table into the database, the hub and the drone, in that order.

The decision is made on the row as it stands inside the writing transaction and written with a compare-and-set on
the epoch, so of two towers or two admins at the same moment one wins and the other is told so.
"""

from dataclasses import dataclass
from typing import Final, cast

from sqlalchemy import CursorResult, select, update
from sqlalchemy.exc import IntegrityError
from sqlalchemy.ext.asyncio import AsyncSession

from server.access import UnknownDrone
from server.accounts.sessions import Principal
from server.accounts.tables import Role, UserRow
from server.audit.trail import record
from server.clock import Clock
from server.control.lease import Actor, Changed, Event, Lease, Order, Outcome, Refused, decide
from server.control.tables import ControlLeaseRow
from server.database import Database
from server.fleet.snapshot import UserRef
from server.fleet.tables import OwnershipRow
from server.fleet.views import DroneView
from server.refusal import Refusal
from server.relay.hub import Hub
from server.relay.live_drone import LeaseView
from wire.ids import DroneId, Epoch, UserId

TOLD_AS: Final = {
    Event.ACQUIRE: "acquired",
    Event.RELEASE: "released",
    Event.TAKE: "taken",
    Event.GIVE: "given",
    Event.REVOKE: "revoked",
}
"""The past tense in which everybody hears of an event."""


class ControlRefused(Refusal):
    """The table said no. `code` is stable and for programs."""

    def __init__(self, refused: Refused) -> None:
        super().__init__(refused.words)
        self.code = refused.code


_MOVED: Final = Refused("control-changed", "who has the controls has just changed; look again")
_HOLDS_ANOTHER: Final = Refused("holds-another", "release the drone that you are flying first")


@dataclass(frozen=True)
class _Committed:
    changed: Changed
    lease: LeaseView


class ControlDesk:
    """One for a tower. `change` is the only way in which a lease changes."""

    def __init__(self, database: Database, hub: Hub, clock: Clock) -> None:
        self._database = database
        self._hub = hub
        self._clock = clock

    async def change(
        self, principal: Principal, drone_id: DroneId, event: Event, *, reason: str, address: str, now: float
    ) -> DroneView:
        """Does what `event` asks for and returns the drone as it is then.

        `reason` is free text for people, `now` monotonic seconds. Raises UnknownDrone for a drone that
        is not there or not theirs to see, ControlRefused with the table's answer.
        """
        live_drone = self._hub.drone_for(drone_id, principal.user_id, principal.role)
        if live_drone is None:
            raise UnknownDrone
        by_hand = self._hub.flown_by_hand(live_drone, now)
        try:
            async with self._database.writing() as session:
                committed = await self._commit(session, principal, drone_id, event, reason, address)
        except IntegrityError:
            # Somebody wrote the drone's first lease, or gave this operator another drone, at the same moment.
            raise ControlRefused(_HOLDS_ANOTHER if event is Event.ACQUIRE else _MOVED) from None
        # No await from here on: the refusal of the old holder and the order to hold are one step.
        self._hub.apply_lease(
            drone_id,
            committed.lease,
            event=TOLD_AS[event],
            by=UserRef(principal.user_id, principal.name),
            reason=reason,
            now=now,
        )
        orders = committed.changed.orders
        if Order.HOLD in orders or (Order.HOLD_IF_FLOWN_BY_HAND in orders and by_hand):
            self._hub.order_hold(drone_id, reason or f"controls {TOLD_AS[event]} by {principal.name}")
        view = self._hub.drone_view(drone_id, principal.user_id, principal.role)
        if view is None:
            raise UnknownDrone
        return view

    async def _commit(
        self,
        session: AsyncSession,
        principal: Principal,
        drone_id: DroneId,
        event: Event,
        reason: str,
        address: str,
    ) -> _Committed:
        row = await session.get(ControlLeaseRow, drone_id, with_for_update=True)
        lease = Lease()
        if row is not None:
            lease = Lease(_user_id(row.holder_id), _user_id(row.taken_from_id), Epoch(row.epoch))
        actor = await self._actor(session, principal, drone_id, lease)
        outcome: Outcome = decide(lease, event, actor)
        if isinstance(outcome, Refused):
            raise ControlRefused(outcome)
        after = outcome.lease
        users = {
            user.id: user
            for user in await session.scalars(select(UserRow).where(UserRow.id.in_({after.holder, after.taken_from})))
        }
        holder = users.get(after.holder) if after.holder is not None else None
        values = {
            "holder_id": after.holder,
            "operator_holder_id": after.holder if holder is not None and holder.role == Role.OPERATOR else None,
            "taken_from_id": after.taken_from,
            "epoch": after.epoch,
            "changed_at": self._clock(),
            "reason": reason,
        }
        if row is None:
            session.add(ControlLeaseRow(drone_id=drone_id, **values))
        else:
            written = await session.execute(
                update(ControlLeaseRow)
                .where(ControlLeaseRow.drone_id == drone_id, ControlLeaseRow.epoch == lease.epoch)
                .values(**values)
            )
            if cast("CursorResult[object]", written).rowcount != 1:
                raise ControlRefused(_MOVED)
        record(
            session,
            at=self._clock(),
            actor=principal,
            action=f"control.{event.value}",
            drone_id=drone_id,
            detail={"epoch": after.epoch, "reason": reason, "holder": holder.name if holder else None},
            address=address,
        )
        await session.flush()
        return _Committed(
            outcome,
            LeaseView(holder=_ref(users, after.holder), taken_from=_ref(users, after.taken_from), epoch=after.epoch),
        )

    async def _actor(self, session: AsyncSession, principal: Principal, drone_id: DroneId, lease: Lease) -> Actor:
        owners = set(await session.scalars(select(OwnershipRow.user_id).where(OwnershipRow.drone_id == drone_id)))
        flying_elsewhere = set(
            await session.scalars(
                select(ControlLeaseRow.operator_holder_id).where(
                    ControlLeaseRow.operator_holder_id.is_not(None), ControlLeaseRow.drone_id != drone_id
                )
            )
        )
        may_fly = True
        if lease.taken_from is not None:
            operator = await session.get(UserRow, lease.taken_from)
            may_fly = (
                operator is not None
                and not operator.disabled
                and lease.taken_from in owners
                and lease.taken_from not in flying_elsewhere
            )
        return Actor(
            user_id=principal.user_id,
            is_admin=principal.role is Role.ADMIN,
            is_owner=principal.user_id in owners,
            holds_another=principal.user_id in flying_elsewhere,
            operator_may_fly=may_fly,
        )


def _user_id(value: int | None) -> UserId | None:
    return None if value is None else UserId(value)


def _ref(users: dict[int, UserRow], user_id: UserId | None) -> UserRef | None:
    user = users.get(user_id) if user_id is not None else None
    return UserRef(UserId(user.id), user.name) if user is not None else None
