"""The chain of hashes over the audit trail: a row for each event, signed heads, and signed stubs for removed events."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import BigInteger, LargeBinary, String
from sqlalchemy.orm import Mapped, mapped_column

from server.storage.database import Base, UtcDateTime


class AuditChainRow(Base):
    """One event's place in the chain. The event is in `audit_events`; no foreign key, or a removed event would take
    this row with it and leave no trace."""

    __tablename__ = "audit_chain"

    number: Mapped[int] = mapped_column(BigInteger, primary_key=True, autoincrement=False)
    event_id: Mapped[int] = mapped_column(unique=True)
    previous: Mapped[bytes] = mapped_column(LargeBinary)
    """The hash of the row before."""
    hash: Mapped[bytes] = mapped_column(LargeBinary)


class AuditChainStateRow(Base):
    """One row. Whoever appends to the chain locks it, so several towers append in one order."""

    __tablename__ = "audit_chain_state"

    id: Mapped[int] = mapped_column(primary_key=True, autoincrement=False)
    number: Mapped[int] = mapped_column(BigInteger)
    """Of the newest event in the chain."""
    hash: Mapped[bytes] = mapped_column(LargeBinary)
    final_id: Mapped[int] = mapped_column(BigInteger)
    """Every event up to this id is in the chain: no transaction that could still add one goes on."""


class AuditHeadRow(Base):
    """The chain up to this number, as the tower signed it."""

    __tablename__ = "audit_heads"

    number: Mapped[int] = mapped_column(BigInteger, primary_key=True, autoincrement=False)
    hash: Mapped[bytes] = mapped_column(LargeBinary)
    at: Mapped[datetime] = mapped_column(UtcDateTime, index=True)
    key: Mapped[str] = mapped_column(String(64))
    signature: Mapped[bytes] = mapped_column(LargeBinary)


class AuditStubRow(Base):
    """Events that retention removed."""

    __tablename__ = "audit_stubs"

    first: Mapped[int] = mapped_column(BigInteger, primary_key=True, autoincrement=False)
    last: Mapped[int] = mapped_column(BigInteger, unique=True)
    previous: Mapped[bytes] = mapped_column(LargeBinary)
    hash: Mapped[bytes] = mapped_column(LargeBinary)
    at: Mapped[datetime] = mapped_column(UtcDateTime)
    key: Mapped[str] = mapped_column(String(64))
    signature: Mapped[bytes] = mapped_column(LargeBinary)
