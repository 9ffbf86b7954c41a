"""The table of control: one lease for each drone that anybody ever held."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import BigInteger, ForeignKey, String
from sqlalchemy.orm import Mapped, mapped_column

from server.database import Base, UtcDateTime


class ControlLeaseRow(Base):
    __tablename__ = "control_leases"

    drone_id: Mapped[int] = mapped_column(ForeignKey("drones.id", ondelete="CASCADE"), primary_key=True)
    holder_id: Mapped[int | None] = mapped_column(ForeignKey("users.id", ondelete="SET NULL"), index=True)
    operator_holder_id: Mapped[int | None] = mapped_column(ForeignKey("users.id", ondelete="SET NULL"), unique=True)
    """The holder again, where it is an operator: the database itself lets an operator hold one drone at most."""
    epoch: Mapped[int] = mapped_column(BigInteger, default=0, server_default="0")
    """0..2**32-1, so too large for PostgreSQL's ordinary integer."""
    taken_from_id: Mapped[int | None] = mapped_column(ForeignKey("users.id", ondelete="SET NULL"))
    changed_at: Mapped[datetime] = mapped_column(UtcDateTime)
    reason: Mapped[str] = mapped_column(String(256), default="", server_default="")
