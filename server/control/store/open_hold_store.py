"""Drones whose hold must be ordered again on their next link: stored beside the lease, across restarts."""

from sqlalchemy import select, update

from server.control.store.tables import ControlLeaseRow
from server.live.hub import Hub
from server.storage.database import Database
from wire.ids import DroneId


async def load_open_holds(hub: Hub, database: Database) -> None:
    """At start, after the hub knows the drones and before agents get responses."""
    async with database.reading() as session:
        kept = select(ControlLeaseRow.drone_id).where(ControlLeaseRow.hold_open)
        for drone_id in await session.scalars(kept):
            hub.holds.keep(DroneId(drone_id))


async def write_open_hold(hub: Hub, database: Database, drone_id: DroneId) -> None:
    """Writes the present value until it no longer changes. A drone that never had a holder has no row, and no order to
    hold."""
    while (drone := hub.state.drones.get(drone_id)) is not None:
        written = drone.hold_noted
        async with database.writing() as session:
            row = update(ControlLeaseRow).where(ControlLeaseRow.drone_id == drone_id)
            await session.execute(row.values(hold_open=written))
        if drone.hold_noted == written:
            return
