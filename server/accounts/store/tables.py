"""The tables of accounts: users, their passkeys, sessions, API tokens, recovery codes and preferences."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from sqlalchemy import JSON, BigInteger, CheckConstraint, ForeignKey, LargeBinary, String, false
from sqlalchemy.orm import Mapped, mapped_column

from server.storage.database import Base, UtcDateTime


class UserRow(Base):
    __tablename__ = "users"
    __table_args__ = (
        CheckConstraint("role IN ('admin', 'operator', 'observer')", name="role"),
        # An id identifies a person in the audit trail: SQLite must not assign it twice.
        {"sqlite_autoincrement": True},
    )

    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(String(64))
    name_key: Mapped[str] = mapped_column(String(256), unique=True)
    """The name in its form for comparison: see `server/kernel/names.py`."""
    password_hash: Mapped[str] = mapped_column(String(256))
    role: Mapped[str] = mapped_column(String(16))
    disabled: Mapped[bool] = mapped_column(default=False, server_default=false())
    created_at: Mapped[datetime] = mapped_column(UtcDateTime)
    must_change_password: Mapped[bool] = mapped_column(default=False, server_default=false())
    """Another person knows it: the one who created the account or reset it."""
    password_changed_at: Mapped[datetime | None] = mapped_column(UtcDateTime)
    """None: still the first one."""
    totp_sealed: Mapped[str | None] = mapped_column(String(255))
    """The secret of the second factor, sealed by `server/runtime/vault.py`; None: no authenticator."""
    totp_pending_sealed: Mapped[str | None] = mapped_column(String(255))
    """A secret that was shown to the user, who has not confirmed it yet."""
    totp_last_step: Mapped[int | None]
    """The newest time step whose code was used: it and all earlier ones are invalid."""
    passkey_handle: Mapped[bytes | None] = mapped_column(LargeBinary(64))
    """The random id by which authenticators know the account; it reveals nothing. None: never had a passkey."""
    passkey_count: Mapped[int] = mapped_column(default=0, server_default="0")
    """The number of the user's rows in `passkeys`: changed together with them, under a lock of this row."""

    @property
    def has_second_factor(self) -> bool:
        """Whether a password alone is not enough to sign in."""
        return self.totp_sealed is not None or self.passkey_count > 0


class PasskeyRow(Base):
    __tablename__ = "passkeys"
    # An id identifies a passkey in the audit trail: it is never assigned twice.
    __table_args__ = ({"sqlite_autoincrement": True},)

    id: Mapped[int] = mapped_column(primary_key=True)
    user_id: Mapped[int] = mapped_column(ForeignKey("users.id", ondelete="CASCADE"), index=True)
    credential_id: Mapped[bytes] = mapped_column(LargeBinary(1023), unique=True)
    public_key: Mapped[bytes] = mapped_column(LargeBinary(1024))
    """In COSE format. Nothing in this table allows a sign-in."""
    sign_count: Mapped[int] = mapped_column(BigInteger)
    """The authenticator's counter at its last use; always 0 if it does not count."""
    name: Mapped[str] = mapped_column(String(64))
    party_id: Mapped[str] = mapped_column(String(253))
    """The host name of the tower when it was created: the passkey is valid only there."""
    transports: Mapped[str] = mapped_column(String(64))
    """How a browser reaches it: names in alphabetical order, separated by spaces."""
    synced: Mapped[bool]
    """Whether it is stored on more than one device."""
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
    """When its user last proved their identity, with every factor of the account; None: a new proof is needed."""
    address: Mapped[str] = mapped_column(String(64))
    user_agent: Mapped[str] = mapped_column(String(256))


class ApiTokenRow(Base):
    __tablename__ = "api_tokens"
    # An id identifies a token in the audit trail: it is never assigned twice.
    __table_args__ = ({"sqlite_autoincrement": True},)

    id: Mapped[int] = mapped_column(primary_key=True)
    token_hash: Mapped[str] = mapped_column(String(64), unique=True)
    user_id: Mapped[int] = mapped_column(ForeignKey("users.id", ondelete="CASCADE"), index=True)
    name: Mapped[str] = mapped_column(String(64))
    scopes: Mapped[str] = mapped_column(String(64))
    """Names in alphabetical order, separated by spaces."""
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
