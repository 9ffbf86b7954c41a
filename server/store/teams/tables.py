"""The tables of teams: their names, who is in them, which drones they have, and who has been invited."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import CheckConstraint, ForeignKey, String, UniqueConstraint, false
from sqlalchemy.orm import Mapped, mapped_column

from server.store.database import Base, UtcDateTime

_ROLES = "role IN ('observer', 'operator', 'admin')"


class TeamRow(Base):
    """The id is random: it does not reveal how many other teams there are."""

    __tablename__ = "teams"

    id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    name: Mapped[str] = mapped_column(String(64))
    """Not unique: that a name is taken would tell of another team."""
    made_by: Mapped[int | None] = mapped_column(ForeignKey("users.id", ondelete="SET NULL"), index=True)
    created_at: Mapped[datetime] = mapped_column(UtcDateTime)


class TeamMemberRow(Base):
    __tablename__ = "team_members"
    __table_args__ = (CheckConstraint(_ROLES, name="role"),)

    team_id: Mapped[int] = mapped_column(ForeignKey("teams.id", ondelete="CASCADE"), primary_key=True)
    user_id: Mapped[int] = mapped_column(ForeignKey("users.id", ondelete="CASCADE"), primary_key=True, index=True)
    role: Mapped[str] = mapped_column(String(16))


class TeamDroneRow(Base):
    """A drone is in one team at most: its pilots never meet those of another team."""

    __tablename__ = "team_drones"

    drone_id: Mapped[int] = mapped_column(ForeignKey("drones.id", ondelete="CASCADE"), primary_key=True)
    team_id: Mapped[int] = mapped_column(ForeignKey("teams.id", ondelete="CASCADE"), index=True)
    since: Mapped[datetime] = mapped_column(UtcDateTime)


class TeamInvitationRow(Base):
    """By name, whether or not such a user exists: the team must not learn that here."""

    __tablename__ = "team_invitations"
    __table_args__ = (UniqueConstraint("team_id", "name_key"), CheckConstraint(_ROLES, name="role"))

    id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    """Drawn by lot, as that of a team."""
    team_id: Mapped[int] = mapped_column(ForeignKey("teams.id", ondelete="CASCADE"))
    name: Mapped[str] = mapped_column(String(64))
    name_key: Mapped[str] = mapped_column(String(256), index=True)
    role: Mapped[str] = mapped_column(String(16))
    invited_by: Mapped[str] = mapped_column(String(64))
    created_at: Mapped[datetime] = mapped_column(UtcDateTime)
    expires_at: Mapped[datetime] = mapped_column(UtcDateTime)
    declined: Mapped[bool] = mapped_column(default=False, server_default=false())
    """The team goes on to read "invited"."""
