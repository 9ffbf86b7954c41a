"""A snapshot of the fleet: drones, their people, loans and teams. Contains no live state."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import datetime
from functools import cached_property

from server.kernel.people import Role, SignInId, UserRef
from server.kernel.relations import TeamRole, Ties
from server.kernel.restraint import Restraint
from server.kernel.scopes import ALL_SCOPES, Scope
from wire.ids import DroneId, Epoch, UserId


@dataclass(frozen=True)
class UserRecord:
    name: str
    role: Role
    disabled: bool
    must_change_password: bool = False


@dataclass(frozen=True)
class SignInRecord:
    """Whose session or API token it is, and what it may be used for."""

    user_id: UserId
    scopes: frozenset[Scope] = ALL_SCOPES


@dataclass(frozen=True)
class LoanRecord:
    """Limits in metres above and around home; None: no limit."""

    user: UserRef
    until: datetime
    may_arm: bool
    max_height_m: float | None
    radius_m: float | None


@dataclass(frozen=True)
class TeamRecord:
    """The team of a drone."""

    id: int
    name: str
    crew: Mapping[UserId, TeamRole]
    since: datetime
    """When the drone was added to it."""


@dataclass(frozen=True)
class DroneRecord:
    id: DroneId
    name: str
    owners: tuple[UserRef, ...]
    """Sorted by id."""
    credential_hash: str
    """SHA-256 of the whole text of a bearer credential, in hexadecimal digits. Empty: no credential."""
    holder: UserRef | None
    epoch: Epoch
    taken_from: UserRef | None
    offered: bool = False
    """Offered back to `taken_from`, who has not accepted yet."""
    assistant: UserRef | None = None
    view_taken: bool = False
    """`taken_from` may not watch the drone either."""
    video_moved: bool = False
    """`taken_from` may not watch the video."""
    loans: tuple[LoanRecord, ...] = ()
    """Sorted by the users' ids."""
    public_key: bytes = b""
    """The 32 bytes of the drone's Ed25519 key. Empty: no key."""
    key_since: datetime | None = None
    team: TeamRecord | None = None
    restraint: Restraint | None = None
    """What admins do because it sends too much."""

    @property
    def identity(self) -> tuple[str, bytes]:
        """The identity that its agent must prove. A sign-in with another one is no longer valid."""
        return self.credential_hash, self.public_key

    @cached_property
    def ties(self) -> Ties:
        """The people related to the drone, for the check of rights."""
        return Ties(
            owners=frozenset(one.id for one in self.owners),
            borrowers=frozenset(one.user.id for one in self.loans),
            crew=self.team.crew if self.team is not None else {},
        )


@dataclass(frozen=True)
class FleetSnapshot:
    revision: int
    drones: tuple[DroneRecord, ...]
    """Sorted by id."""
    users: Mapping[UserId, UserRecord]
    sign_ins: Mapping[SignInId, SignInRecord] = field(default_factory=dict)
    """The API tokens that are not revoked, and the sessions that have not ended. A new session does not change the
    fleet: newer ones may be missing."""
    share_limits: Mapping[str, int] = field(default_factory=dict)
    """Limits of shares that an admin has chosen, by name."""
