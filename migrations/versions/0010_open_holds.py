"""A hold stays open across a restart of the tower; holds no longer expire, and "nothing" becomes "stay".

Revision 0010, after 0009.
"""

from collections.abc import Callable
from typing import Any

import sqlalchemy as sa
from alembic import op

revision = "0010"
down_revision = "0009"
branch_labels = None
depends_on = None

_SETTINGS = sa.table("drone_settings", sa.column("drone_id", sa.Integer), sa.column("chosen", sa.JSON))


def upgrade() -> None:
    with op.batch_alter_table("control_leases") as leases:
        leases.add_column(sa.Column("hold_open", sa.Boolean(), server_default=sa.false(), nullable=False))
    _change_settings(_without_the_bound)


def downgrade() -> None:
    _change_settings(lambda chosen: _renamed(chosen, "stay", "nothing"))
    with op.batch_alter_table("control_leases") as leases:
        leases.drop_column("hold_open")


def _change_settings(change: Callable[[dict[str, Any]], dict[str, Any]]) -> None:
    connection = op.get_bind()
    for drone_id, chosen in connection.execute(sa.select(_SETTINGS)).all():
        changed = change(chosen)
        if changed != chosen:
            row = sa.update(_SETTINGS).where(_SETTINGS.c.drone_id == drone_id)
            connection.execute(row.values(chosen=changed))


def _without_the_bound(chosen: dict[str, Any]) -> dict[str, Any]:
    kept = {name: value for name, value in chosen.items() if name != "hold_bound_s"}
    return _renamed(kept, "nothing", "stay")


def _renamed(chosen: dict[str, Any], old: str, new: str) -> dict[str, Any]:
    return chosen | {"lost_action": new} if chosen.get("lost_action") == old else chosen
