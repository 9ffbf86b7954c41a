"""Seals the secrets of second factors with a key that is not in the database.

Revision 0006, after 0005.
"""

import os

import sqlalchemy as sa
from alembic import context, op

from server.runtime.settings import read_settings
from server.runtime.vault import Vault

revision = "0006"
down_revision = "0005"
branch_labels = None
depends_on = None

_USERS = sa.table(
    "users",
    sa.column("id", sa.Integer),
    *(sa.column(name, sa.String) for name in ("totp_secret", "totp_pending", "totp_sealed", "totp_pending_sealed")),
)
_PAIRS = (("totp_secret", "totp_sealed"), ("totp_pending", "totp_pending_sealed"))


def _vault() -> Vault:
    given = context.config.attributes.get("vault")
    return given if isinstance(given, Vault) else read_settings(os.environ).vault()


def _about(user_id: int) -> str:
    return f"second factor of user {user_id}"


def _overwrite_what_is_deleted() -> None:
    if op.get_bind().dialect.name == "sqlite":
        op.execute("PRAGMA secure_delete = ON")


def upgrade() -> None:
    op.add_column("users", sa.Column("totp_sealed", sa.String(255), nullable=True))
    op.add_column("users", sa.Column("totp_pending_sealed", sa.String(255), nullable=True))
    if not context.is_offline_mode():
        _overwrite_what_is_deleted()
        for plain, sealed in _PAIRS:
            rows = op.get_bind().execute(sa.select(_USERS.c.id, _USERS.c[plain]).where(_USERS.c[plain].is_not(None)))
            for user_id, secret in rows.all():
                vault = _vault()
                if not vault.find_keys():
                    vault.make_key()
                value = vault.seal(secret, about=_about(user_id))
                op.get_bind().execute(sa.update(_USERS).where(_USERS.c.id == user_id).values({sealed: value}))
    op.drop_column("users", "totp_secret")
    op.drop_column("users", "totp_pending")


def downgrade() -> None:
    op.add_column("users", sa.Column("totp_secret", sa.String(64), nullable=True))
    op.add_column("users", sa.Column("totp_pending", sa.String(64), nullable=True))
    if not context.is_offline_mode():
        for plain, sealed in _PAIRS:
            rows = op.get_bind().execute(sa.select(_USERS.c.id, _USERS.c[sealed]).where(_USERS.c[sealed].is_not(None)))
            for user_id, value in rows.all():
                vault = _vault()
                vault.find_keys()
                secret = vault.open(value, about=_about(user_id))
                op.get_bind().execute(sa.update(_USERS).where(_USERS.c.id == user_id).values({plain: secret}))
    op.drop_column("users", "totp_pending_sealed")
    op.drop_column("users", "totp_sealed")
