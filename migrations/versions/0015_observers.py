"""Accounts that only watch.

Revision 0015, after 0014. A downgrade disables them: the version before lacks this role, and would let them fly.
"""

import sqlalchemy as sa
from alembic import op

revision = "0015"
down_revision = "0014"
branch_labels = None
depends_on = None

_TWO = "role IN ('admin', 'operator')"
_THREE = "role IN ('admin', 'operator', 'observer')"


def upgrade() -> None:
    _change_check(_TWO, _THREE)


def downgrade() -> None:
    op.execute("UPDATE users SET role = 'operator', disabled = true WHERE role = 'observer'")
    _change_check(_THREE, _TWO)


def _change_check(before: str, after: str) -> None:
    if op.get_bind().dialect.name == "sqlite":
        _change_check_in_place(before, after)
        return
    op.drop_constraint(op.f("ck_users_role"), "users", type_="check")
    op.create_check_constraint(op.f("ck_users_role"), "users", after)


def _change_check_in_place(before: str, after: str) -> None:
    """Batch mode would copy the table and drop the old one, and with it sessions, tokens and owners (ON DELETE
    CASCADE). SQLite documents this method for a CHECK (lang_altertable.html, section 7)."""
    connection = op.get_bind()
    version = connection.exec_driver_sql("PRAGMA schema_version").scalar_one()
    connection.exec_driver_sql("PRAGMA writable_schema = ON")
    changed = connection.execute(
        sa.text(
            "UPDATE sqlite_master SET sql = replace(sql, :before, :after) "
            "WHERE type = 'table' AND name = 'users' AND instr(sql, :before)"
        ),
        {"before": before, "after": after},
    ).rowcount
    if changed != 1:
        raise RuntimeError(f"the table users has no CHECK ({before})")
    connection.exec_driver_sql(f"PRAGMA schema_version = {version + 1}")
    connection.exec_driver_sql("PRAGMA writable_schema = RESET")
    (found,) = connection.exec_driver_sql("PRAGMA quick_check(1)").one()
    if found != "ok":
        raise RuntimeError(f"the database is not sound after the change: {found}")
