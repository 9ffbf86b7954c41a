"""Which drones' flights a user may read, and of which time."""

from __future__ import annotations

from server.flights.core.refusals import UnknownFlight
from server.flights.store import catalogue
from server.flights.store.tables import FlightRow
from server.kernel.people import Principal
from server.kernel.relations import Right
from server.live.hub import Hub
from server.live.live_drone import LiveDrone
from server.operations.api.operation_requests import refuse_observers, watched_drone
from server.storage.database import Database


def readable_drones(hub: Hub, principal: Principal, drone_id: int | None = None) -> dict[int, LiveDrone]:
    """Returns the drones whose stored files this user may read now. Raises UnknownDrone, ViewTaken, OnlyWatches for a
    drone that was named."""
    if drone_id is not None:
        drone = watched_drone(hub, principal, drone_id)
        refuse_observers(drone, principal)
        return {drone.drone_id: drone}
    user_id, role = principal.user_id, principal.role
    return {
        drone.drone_id: drone
        for drone in hub.squads.drones(user_id, role)
        if drone.may(user_id, role, Right.READ) and user_id != drone.user_without_view
    }


async def known_flight(
    hub: Hub, database: Database, principal: Principal, flight_id: int
) -> tuple[FlightRow, LiveDrone]:
    """Raises UnknownFlight for every flight that this user may not read: others' look like none."""
    async with database.reading() as session:
        row = await catalogue.get(session, flight_id)
    drone = readable_drones(hub, principal).get(row.drone_id)
    if drone is None or not drone.knows_of(principal.user_id, principal.role, row.began_at):
        raise UnknownFlight
    return row, drone
