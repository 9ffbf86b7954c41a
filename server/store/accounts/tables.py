"""The tables of accounts: users, their passkeys, sessions, API tokens, recovery codes and preferences."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from sqlalchemy import JSON, BigInteger, CheckConstraint, ForeignKey, LargeBinary, String, false
from sqlalchemy.orm import Mapped, mapped_column

from server.store.database import Base, UtcDateTime


class UserRow(Base):
    __tablename__ = "users"
    __table_args__ = (
        CheckConstraint("role IN ('admin', 'operator', 'observer')", name="role"),
        # An id is a person in the audit trail: SQLite must not hand it out a second time.
        {"sqlite_autoincrement": True},
    )

    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(String(64))
    name_key: Mapped[str] = mapped_column(String(256), unique=True)
    """The name as it is compared: see `server/domain/names.py`."""
    password_hash: Mapped[str] = mapped_column(String(256))
    role: Mapped[str] = mapped_column(String(16))
    disabled: Mapped[bool] = mapped_column(default=False, server_default=false())
    created_at: Mapped[datetime] = mapped_column(UtcDateTime)
    must_change_password: Mapped[bool] = mapped_column(default=False, server_default=false())
    """Somebody else knows it: who made the account, or who reset it."""
    password_changed_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    """None: it is still the first one."""
    totp_sealed: Mapped[str | None] = mapped_column(String(255))
    """The second factor's secret, sealed by `server/runtime/vault.py`; None: none."""
    totp_pending_sealed: Mapped[str | None] = mapped_column(String(255))
    """One that was shown to its user, who has not proved yet to have it."""
    totp_last_step: Mapped[int | None]
    """The newest time step whose code was used: it and all before are worth nothing."""
    passkey_handle: Mapped[bytes | None] = mapped_column(LargeBinary(64))
    """The account's name towards authenticators: random, so that it reveals nothing. None: never had a passkey."""
    passkey_count: Mapped[int] = mapped_column(default=0, server_default="0")
    """How many rows of `passkeys` are theirs: changed together with them, under a lock of this row."""

    @property
    def has_second_factor(self) -> bool:
        """A password alone does not sign them in."""
        return self.totp_sealed is not None or self.passkey_count > 0


class PasskeyRow(Base):
    __tablename__ = "passkeys"
    # An id is a passkey in the audit trail: it is never handed out a second time.
    __table_args__ = ({"sqlite_autoincrement": True},)

    id: Mapped[int] = mapped_column(primary_key=True)
    user_id: Mapped[int] = mapped_column(ForeignKey("users.id", ondelete="CASCADE"), index=True)
    credential_id: Mapped[bytes] = mapped_column(LargeBinary(1023), unique=True)
    public_key: Mapped[bytes] = mapped_column(LargeBinary(1024))
    """In COSE format. Nothing in this table signs anybody in."""
    sign_count: Mapped[int] = mapped_column(BigInteger)
    """What the authenticator counted at its last use; 0 for good where it does not count."""
    name: Mapped[str] = mapped_column(String(64))
    party_id: Mapped[str] = mapped_column(String(253))
    """The host name of the tower when it was made: it is good there only."""
    transports: Mapped[str] = mapped_column(String(64))
    """How a browser reaches it: their names in alphabetical order, with blanks between."""
    synced: Mapped[bool]
    """It is kept in more than one device."""
    created_at: Mapped[datetime] = mapped_column(UtcDateTime)
    last_used_at: Mapped[datetime | None] = mapped_column(UtcDateTime)


class RecoveryCodeRow(Base):
    __tablename__ = "recovery_codes"

    id: Mapped[int] = mapped_column(primary_key=True)
    user_id: Mapped[int] = mapped_column(ForeignKey("users.id", ondelete="CASCADE"), index=True)
    code_hash: Mapped[str] = mapped_column(String(64))


class SessionRow(Base):
    __tablename__ = "sessions"
    __table_args__ = ({"sqlite_autoincrement": True},)

    id: Mapped[int] = mapped_column(primary_key=True)
    token_hash: Mapped[str] = mapped_column(String(64), unique=True)
    user_id: Mapped[int] = mapped_column(ForeignKey("users.id", ondelete="CASCADE"), index=True)
    created_at: Mapped[datetime] = mapped_column(UtcDateTime)
    last_seen_at: Mapped[datetime] = mapped_column(UtcDateTime)
    proved_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    """When its person last proved who they are, with every factor of the account; None: prove it again first."""
    address: Mapped[str] = mapped_column(String(64))
    user_agent: Mapped[str] = mapped_column(String(256))


class ApiTokenRow(Base):
    __tablename__ = "api_tokens"
    # An id is a token in the audit trail: it is never handed out a second time.
    __table_args__ = ({"sqlite_autoincrement": True},)

    id: Mapped[int] = mapped_column(primary_key=True)
    token_hash: Mapped[str] = mapped_column(String(64), unique=True)
    user_id: Mapped[int] = mapped_column(ForeignKey("users.id", ondelete="CASCADE"), index=True)
    name: Mapped[str] = mapped_column(String(64))
    scopes: Mapped[str] = mapped_column(String(64))
    """Their names in alphabetical order, with blanks between."""
    created_at: Mapped[datetime] = mapped_column(UtcDateTime)
    expires_at: Mapped[datetime] = mapped_column(UtcDateTime)
    last_used_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    last_used_address: Mapped[str] = mapped_column(String(64), default="", server_default="")


class PreferenceRow(Base):
    __tablename__ = "user_preferences"

    user_id: Mapped[int] = mapped_column(ForeignKey("users.id", ondelete="CASCADE"), primary_key=True)
    name: Mapped[str] = mapped_column(String(32), primary_key=True)
    document: Mapped[dict[str, Any]] = mapped_column(JSON)
    changed_at: Mapped[datetime] = mapped_column(UtcDateTime)
