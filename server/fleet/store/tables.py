"""The tables of the fleet: drones, their owners and borrowers, the enrolment of their agents, and the revision of the
last change. `server.teams.store.tables` has the tables of teams."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import CheckConstraint, ForeignKey, String, false
from sqlalchemy.orm import Mapped, mapped_column

from server.storage.database import Base, UtcDateTime


class DroneRow(Base):
    __tablename__ = "drones"
    # The id is the tag in front of every frame: the id of a deleted drone must never be reused.
    __table_args__ = ({"sqlite_autoincrement": True},)

    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(String(64))
    name_key: Mapped[str] = mapped_column(String(256), unique=True)
    credential_hash: Mapped[str] = mapped_column(String(64))
    """Hash of a bearer credential that an older version issued and no key has replaced yet. Empty: none."""
    created_at: Mapped[datetime] = mapped_column(UtcDateTime)
    public_key: Mapped[str | None] = mapped_column(String(43))
    """The public half of the drone's Ed25519 key (wire.drone_key.key_text). None: no agent signs in with a key."""
    key_since: Mapped[datetime | None] = mapped_column(UtcDateTime)


class OwnershipRow(Base):
    __tablename__ = "ownerships"

    drone_id: Mapped[int] = mapped_column(ForeignKey("drones.id", ondelete="CASCADE"), primary_key=True)
    user_id: Mapped[int] = mapped_column(ForeignKey("users.id", ondelete="CASCADE"), primary_key=True, index=True)


class LoanRow(Base):
    """A temporary loan of a drone to a user, within limits. Deleted when it is over; the audit trail keeps it."""

    __tablename__ = "loans"

    drone_id: Mapped[int] = mapped_column(ForeignKey("drones.id", ondelete="CASCADE"), primary_key=True)
    user_id: Mapped[int] = mapped_column(ForeignKey("users.id", ondelete="CASCADE"), primary_key=True, index=True)
    until: Mapped[datetime] = mapped_column(UtcDateTime, index=True)
    may_arm: Mapped[bool]
    max_height_m: Mapped[float | None]
    """Above home."""
    radius_m: Mapped[float | None]
    """Around home."""
    team_id: Mapped[int | None] = mapped_column(ForeignKey("teams.id", ondelete="CASCADE"), index=True)
    """Lent by an admin of this team, and over when drone or borrower leave it; None: lent by an admin of the tower."""


class RestraintRow(Base):
    """What admins do about a drone that sends too much (server.kernel.restraint). Deleted when it is lifted."""

    __tablename__ = "drone_restraints"
    __table_args__ = (CheckConstraint("measure IN ('muted', 'limited', 'quarantined')", name="measure"),)

    drone_id: Mapped[int] = mapped_column(ForeignKey("drones.id", ondelete="CASCADE"), primary_key=True)
    measure: Mapped[str] = mapped_column(String(16))
    reason: Mapped[str] = mapped_column(String(200))
    by_name: Mapped[str] = mapped_column(String(64))
    by_admin: Mapped[bool]
    """An admin of the tower, and not of the drone's team."""
    since: Mapped[datetime] = mapped_column(UtcDateTime)


class ShareLimitRow(Base):
    """A limit that an admin has chosen for a share (server.kernel.shares); without a row its default counts."""

    __tablename__ = "share_limits"

    name: Mapped[str] = mapped_column(String(32), primary_key=True)
    value: Mapped[int]
    changed_by: Mapped[str] = mapped_column(String(64))
    changed_at: Mapped[datetime] = mapped_column(UtcDateTime)


class EnrolmentRow(Base):
    """Permission to register a key for a drone, once."""

    __tablename__ = "enrolments"
    __table_args__ = ({"sqlite_autoincrement": True},)

    id: Mapped[int] = mapped_column(primary_key=True)
    drone_id: Mapped[int] = mapped_column(ForeignKey("drones.id", ondelete="CASCADE"), index=True)
    token_hash: Mapped[str] = mapped_column(String(64), unique=True)
    created_by: Mapped[str] = mapped_column(String(64))
    created_at: Mapped[datetime] = mapped_column(UtcDateTime)
    expires_at: Mapped[datetime] = mapped_column(UtcDateTime)
    cancelled: Mapped[bool] = mapped_column(default=False, server_default=false())
    used_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    used_from: Mapped[str] = mapped_column(String(64), default="", server_default="")
    agent_seen_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    public_key: Mapped[str | None] = mapped_column(String(43))
    """The key that it was used with."""


class TowerIdentityRow(Base):
    """One row: the key by which agents recognise this tower. The private half is sealed (server.runtime.vault)."""

    __tablename__ = "tower_identity"
    __table_args__ = (CheckConstraint("id = 1", name="one_row"),)

    id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    public_key: Mapped[str] = mapped_column(String(43))
    sealed_key: Mapped[str] = mapped_column(String(255))


class FleetRevisionRow(Base):
    """One row. A transaction that changes drones, ownerships or users increments it."""

    __tablename__ = "fleet_revision"
    __table_args__ = (CheckConstraint("id = 1", name="one_row"),)

    id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    revision: Mapped[int]
