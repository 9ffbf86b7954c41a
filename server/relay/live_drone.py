"""One drone as the hub knows it right now: record, holder, link, watchers. State only; the rules are in the hub."""

from dataclasses import dataclass, field

from server.accounts.tables import Role
from server.fleet.snapshot import DroneRecord, UserRef
from server.fleet.views import DroneView, UserRefView
from server.relay.agent_link import AgentLink
from server.relay.browser import Browser
from wire.ids import DroneId, Epoch, UserId


@dataclass(frozen=True)
class LeaseView:
    """Who has the controls, as the database last said. `taken_from` is shut out until the controls are given back."""

    holder: UserRef | None
    taken_from: UserRef | None
    epoch: Epoch
    offered: bool = False
    """Given back to `taken_from`, who has not accepted yet."""
    assistant: UserRef | None = None
    """An admin whose commands win for as long as they come."""
    blind: bool = False
    """`taken_from` may not watch either."""


def lease_of(record: DroneRecord) -> LeaseView:
    """The lease that a database record tells of."""
    return LeaseView(
        holder=record.holder,
        taken_from=record.taken_from,
        epoch=record.epoch,
        offered=record.offered,
        assistant=record.assistant,
        blind=record.blind,
    )


@dataclass
class LiveDrone:
    """Mutable; touched by the hub only, and never across an await."""

    record: DroneRecord
    lease: LeaseView
    link: AgentLink | None = None
    online: bool = False
    """What the browsers were last told."""
    autopilot_heard: bool = False
    armed: bool = False
    airborne: bool = False
    sticks_at: float = float("-inf")
    """When the holder's last stick frame was passed on."""
    holder_missing_since: float | None = None
    """Since when the holder has had no live browser; None while there is one, or no holder."""
    watchers: dict[int, Browser] = field(default_factory=dict)
    """Browsers that may see this drone, by their number."""

    @property
    def drone_id(self) -> DroneId:
        return self.record.id

    @property
    def holder_id(self) -> UserId | None:
        return self.lease.holder.id if self.lease.holder else None

    def may_be_seen_by(self, user_id: UserId, role: Role) -> bool:
        """Admins see every drone, operators their own."""
        return role is Role.ADMIN or any(owner.id == user_id for owner in self.record.owners)

    def view(self) -> DroneView:
        """As the console is told. The same for everybody who may see the drone."""
        return DroneView(
            id=self.record.id,
            name=self.record.name,
            online=self.online,
            owners=[UserRefView.of(owner) for owner in self.record.owners],
            holder=_view_of(self.lease.holder),
            epoch=self.lease.epoch,
            taken_from=_view_of(self.lease.taken_from),
            autopilot_heard=self.autopilot_heard,
        )


def _view_of(ref: UserRef | None) -> UserRefView | None:
    return UserRefView.of(ref) if ref else None
