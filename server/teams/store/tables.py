"""The tables of teams: their names, members, drones and invitations."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import CheckConstraint, ForeignKey, String, UniqueConstraint, false
from sqlalchemy.orm import Mapped, mapped_column

from server.storage.database import Base, UtcDateTime

_ROLES = "role IN ('observer', 'operator', 'admin')"


class TeamRow(Base):
    """Its id is random, so that it does not reveal how many other teams exist."""

    __tablename__ = "teams"

    id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    name: Mapped[str] = mapped_column(String(64))
    """Not unique: a taken name would reveal another team."""
    made_by: Mapped[int | None] = mapped_column(ForeignKey("users.id", ondelete="SET NULL"), index=True)
    created_at: Mapped[datetime] = mapped_column(UtcDateTime)


class TeamMemberRow(Base):
    __tablename__ = "team_members"
    __table_args__ = (CheckConstraint(_ROLES, name="role"),)

    team_id: Mapped[int] = mapped_column(ForeignKey("teams.id", ondelete="CASCADE"), primary_key=True)
    user_id: Mapped[int] = mapped_column(ForeignKey("users.id", ondelete="CASCADE"), primary_key=True, index=True)
    role: Mapped[str] = mapped_column(String(16))


class TeamDroneRow(Base):
    """A drone is in at most one team: those who fly it for one team never meet those of another."""

    __tablename__ = "team_drones"

    drone_id: Mapped[int] = mapped_column(ForeignKey("drones.id", ondelete="CASCADE"), primary_key=True)
    team_id: Mapped[int] = mapped_column(ForeignKey("teams.id", ondelete="CASCADE"), index=True)
    since: Mapped[datetime] = mapped_column(UtcDateTime)


class TeamInvitationRow(Base):
    """For a name, whether or not a user has it: the team must not learn that from here."""

    __tablename__ = "team_invitations"
    __table_args__ = (UniqueConstraint("team_id", "name_key"), CheckConstraint(_ROLES, name="role"))

    id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    """Random, like that of a team."""
    team_id: Mapped[int] = mapped_column(ForeignKey("teams.id", ondelete="CASCADE"))
    name: Mapped[str] = mapped_column(String(64))
    name_key: Mapped[str] = mapped_column(String(256), index=True)
    role: Mapped[str] = mapped_column(String(16))
    invited_by: Mapped[str] = mapped_column(String(64))
    created_at: Mapped[datetime] = mapped_column(UtcDateTime)
    expires_at: Mapped[datetime] = mapped_column(UtcDateTime)
    declined: Mapped[bool] = mapped_column(default=False, server_default=false())
    """The team still sees "invited"."""
