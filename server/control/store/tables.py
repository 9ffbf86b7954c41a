"""The tables of control: who holds each drone, how it holds, and who has acknowledged its loss check."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from sqlalchemy import JSON, BigInteger, ForeignKey, String
from sqlalchemy.orm import Mapped, mapped_column

from server.storage.database import Base, UtcDateTime


class ControlLeaseRow(Base):
    """One row for each drone that ever had a holder."""

    __tablename__ = "control_leases"

    drone_id: Mapped[int] = mapped_column(ForeignKey("drones.id", ondelete="CASCADE"), primary_key=True)
    holder_id: Mapped[int | None] = mapped_column(ForeignKey("users.id", ondelete="SET NULL"), index=True)
    operator_holder_id: Mapped[int | None] = mapped_column(ForeignKey("users.id", ondelete="SET NULL"), unique=True)
    """The holder again, if it is an operator: the database itself limits an operator to one drone."""
    epoch: Mapped[int] = mapped_column(BigInteger, default=0, server_default="0")
    """0..2**32-1, so too large for PostgreSQL's ordinary integer."""
    taken_from_id: Mapped[int | None] = mapped_column(ForeignKey("users.id", ondelete="SET NULL"))
    offered: Mapped[bool] = mapped_column(default=False)
    assistant_id: Mapped[int | None] = mapped_column(ForeignKey("users.id", ondelete="SET NULL"))
    view_taken: Mapped[bool] = mapped_column("blind", default=False)
    video_moved: Mapped[bool] = mapped_column(default=False)
    hold_open: Mapped[bool] = mapped_column(default=False)
    """A hold is open, or is due for a drone that was offline: it is ordered again on the next link."""
    changed_at: Mapped[datetime] = mapped_column(UtcDateTime)
    reason: Mapped[str] = mapped_column(String(256), default="", server_default="")


class DroneSettingsRow(Base):
    """How a drone holds, if an admin has changed the defaults: only the changed values, by name."""

    __tablename__ = "drone_settings"

    drone_id: Mapped[int] = mapped_column(ForeignKey("drones.id", ondelete="CASCADE"), primary_key=True)
    chosen: Mapped[dict[str, Any]] = mapped_column(JSON)
    changed_at: Mapped[datetime] = mapped_column(UtcDateTime)


class LossAcknowledgementRow(Base):
    """The set of dangerous parameters of a drone that a user has acknowledged; only the newest."""

    __tablename__ = "loss_acknowledgements"

    drone_id: Mapped[int] = mapped_column(ForeignKey("drones.id", ondelete="CASCADE"), primary_key=True)
    user_id: Mapped[int] = mapped_column(ForeignKey("users.id", ondelete="CASCADE"), primary_key=True)
    findings_hash: Mapped[str] = mapped_column(String(64))
    acknowledged_at: Mapped[datetime] = mapped_column(UtcDateTime)
