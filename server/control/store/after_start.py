"""Ends all assistance before a restarted tower answers any request.

The old process knew whose turn it was. If the assistance continued under its epoch, the sticks of both holder and
assistant could pass in it; with a new epoch they cannot.
"""

from sqlalchemy import select

from server.audit.store.trail import TOWER, record
from server.control.core.lease import TOWER as THE_TOWER
from server.control.core.lease import Changed, Event, decide
from server.control.store.lease_store import lease_of_row
from server.control.store.tables import ControlLeaseRow
from server.kernel.clock import Clock
from server.storage.database import Database


async def end_assistance(database: Database, clock: Clock) -> None:
    """Runs before the hub is loaded, so that nobody has seen the old epoch in this process."""
    reason = "the tower was started again"
    async with database.writing() as session:
        assisted = select(ControlLeaseRow).where(ControlLeaseRow.assistant_id.is_not(None)).with_for_update()
        for row in await session.scalars(assisted):
            outcome = decide(lease_of_row(row), Event.ASSIST_END, THE_TOWER)
            if not isinstance(outcome, Changed):
                continue
            row.assistant_id, row.epoch = None, outcome.lease.epoch
            row.changed_at, row.reason = clock(), reason
            detail = {"reason": reason, "result": "done", "epoch": row.epoch}
            action = f"control.{Event.ASSIST_END.value}"
            record(session, at=clock(), actor=TOWER, action=action, drone_id=row.drone_id, detail=detail)
