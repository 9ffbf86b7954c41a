"""A database of leases in memory, with the points at which a real one lets other transactions run in between."""

from collections.abc import Generator
from dataclasses import dataclass, field
from datetime import UTC, datetime

from server.control.core.lease import TOWER as THE_TOWER
from server.control.core.lease import Actor, Changed, Event, Lease, Refused, decide
from server.control.store.lease_store import HOLDS_ANOTHER, MOVED, Ask, Committed
from server.kernel.fleet import DroneRecord, FleetSnapshot, SignInRecord, TeamRecord, UserRecord
from server.kernel.people import Role, SignInId, UserRef
from server.kernel.relations import Relation, Right, TeamRole, Ties, may, relation_of
from server.live.live_drone import LeaseView
from wire.ids import DroneId, UserId

SINCE = datetime(2026, 1, 1, tzinfo=UTC)


class Pause:
    """Awaiting it lets other tasks run."""

    def __await__(self) -> Generator[None, None, None]:
        yield


@dataclass
class Account:
    name: str
    role: Role
    owns: set[DroneId]
    disabled: bool = False
    team: dict[DroneId, TeamRole] = field(default_factory=dict)
    """The user's role in the team of each drone."""


@dataclass
class MemoryStore:
    """`history` holds the lease of every epoch. The invariants are checked against it."""

    accounts: dict[UserId, Account]
    leases: dict[DroneId, Lease]
    history: dict[tuple[DroneId, int], Lease] = field(default_factory=dict)
    revision: int = 0

    def __post_init__(self) -> None:
        for drone_id, lease in self.leases.items():
            self.history[drone_id, lease.epoch] = lease

    async def commit(self, ask: Ask) -> Committed | Refused:
        before = self.leases[ask.drone_id]
        actor = self._actor(ask, before)
        in_rank = self._is_in_rank(ask, before)
        await Pause()
        outcome = decide(before, ask.event, actor)
        if isinstance(outcome, Refused):
            return outcome
        if self.leases[ask.drone_id].epoch != before.epoch:
            return MOVED
        if ask.about is not None and ask.event in (Event.REVOKE, Event.EXPIRE):
            assert before.holder == ask.about, "the controls were revoked from somebody else"
        if ask.by is not None and ask.event in (Event.TAKE, Event.ASSIST, Event.GIVE):
            assert in_rank, f"{ask.by.user_id} changed {before}, out of rank"
        if self._holds_another(outcome.lease.holder, ask.drone_id):
            return HOLDS_ANOTHER
        self._write(ask.drone_id, outcome.lease)
        await Pause()
        return Committed(before, outcome, self.view(outcome.lease))

    def _is_in_rank(self, ask: Ask, before: Lease) -> bool:
        """A second implementation of the rank rules, independent of the rights table and the control rules.

        It reads the accounts when `_actor` does, as one transaction does. A right that ends after that ends the change
        too, but later: the hub revokes what the change gave, and `teardown` of the model asks for it.
        """
        if ask.by is None:
            return True
        account = self.accounts[ask.by.user_id]
        if account.role is Role.ADMIN:
            return True
        above = [part for part in (before.holder, before.assistant) if part and self.accounts[part].role is Role.ADMIN]
        return account.team.get(ask.drone_id) is TeamRole.ADMIN and not above

    def after_start(self) -> None:
        """Does the same as `server.control.store.after_start`."""
        for drone_id, lease in self.leases.items():
            outcome = decide(lease, Event.ASSIST_END, THE_TOWER)
            if isinstance(outcome, Changed):
                self._write(drone_id, outcome.lease)

    def snapshot(self) -> FleetSnapshot:
        drones = []
        for drone_id, lease in self.leases.items():
            view = self.view(lease)
            owners = [user_id for user_id, account in self.accounts.items() if drone_id in account.owns]
            drones.append(
                DroneRecord(
                    id=drone_id,
                    name=f"Drone {drone_id}",
                    owners=tuple(UserRef(user_id, self.accounts[user_id].name) for user_id in owners),
                    credential_hash="c",
                    holder=view.holder,
                    epoch=view.epoch,
                    taken_from=view.taken_from,
                    offered=view.offered,
                    assistant=view.assistant,
                    view_taken=view.view_taken,
                    team=TeamRecord(1, "team", dict(self._ties(drone_id).crew), SINCE),
                )
            )
        users = {user_id: UserRecord(one.name, one.role, one.disabled) for user_id, one in self.accounts.items()}
        sign_ins: dict[SignInId, SignInRecord] = {int(user_id): SignInRecord(user_id) for user_id in self.accounts}
        return FleetSnapshot(self.revision, tuple(drones), users, sign_ins)

    def view(self, lease: Lease) -> LeaseView:
        def ref(user_id: UserId | None) -> UserRef | None:
            return None if user_id is None else UserRef(user_id, self.accounts[user_id].name)

        return LeaseView(
            holder=ref(lease.holder),
            taken_from=ref(lease.taken_from),
            epoch=lease.epoch,
            offered=lease.offered,
            assistant=ref(lease.assistant),
            view_taken=lease.view_taken,
        )

    def _write(self, drone_id: DroneId, lease: Lease) -> None:
        assert lease.epoch == self.leases[drone_id].epoch + 1
        self.leases[drone_id] = lease
        self.history[drone_id, lease.epoch] = lease

    def _holds_another(self, user_id: UserId | None, drone_id: DroneId) -> bool:
        if user_id is None or self.accounts[user_id].role is not Role.OPERATOR:
            return False
        return any(lease.holder == user_id for other, lease in self.leases.items() if other != drone_id)

    def _ties(self, drone_id: DroneId) -> Ties:
        return Ties(
            owners=frozenset(user_id for user_id, one in self.accounts.items() if drone_id in one.owns),
            crew={user_id: one.team[drone_id] for user_id, one in self.accounts.items() if drone_id in one.team},
        )

    def _relation(self, user_id: UserId, drone_id: DroneId) -> Relation:
        return relation_of(self._ties(drone_id), user_id, self.accounts[user_id].role)

    def _may_fly(self, user_id: UserId, drone_id: DroneId) -> bool:
        allowed = may(self._relation(user_id, drone_id), Right.FLY)
        return not self.accounts[user_id].disabled and allowed and not self._holds_another(user_id, drone_id)

    def _actor(self, ask: Ask, lease: Lease) -> Actor:
        if ask.as_tower or ask.by is None:
            return Actor(None, is_tower=True, about=ask.about)
        user_id = ask.by.user_id
        relation = self._relation(user_id, ask.drone_id)
        above = [one for one in (lease.holder, lease.assistant) if one and self.accounts[one].role is Role.ADMIN]
        return Actor(
            user_id=user_id,
            is_admin=relation is Relation.ADMIN,
            is_team_admin=relation is Relation.TEAM_ADMIN,
            is_owner=may(relation, Right.FLY),
            outranked=relation is not Relation.ADMIN and bool(above),
            holds_another=self._holds_another(user_id, ask.drone_id),
            operator_may_fly=lease.taken_from is None or self._may_fly(lease.taken_from, ask.drone_id),
            watch=ask.watch,
            sticks_centred=ask.sticks_centred,
        )
