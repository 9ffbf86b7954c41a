"""Storage of each drone's settings, and their transfer to the hub. The database stores only chosen values."""

from collections.abc import Sequence
from typing import Any

from sqlalchemy import select
from sqlalchemy.ext.asyncio import AsyncSession

from server.audit.store.action import AuditAction
from server.control.store.tables import DroneSettingsRow
from server.fleet.store.tables import DroneRow
from server.kernel.access import UnknownDrone
from server.kernel.drone_settings import DroneSettings, settings_from
from server.live.hub import Hub
from server.storage.database import Database, DatabaseSession
from wire.ids import DroneId


async def load_settings(session: AsyncSession) -> dict[DroneId, DroneSettings]:
    """Returns the settings of every drone that has any; all others have the defaults."""
    return {DroneId(row.drone_id): settings_from(row.chosen) for row in await session.scalars(select(DroneSettingsRow))}


async def read_settings_of(
    session: AsyncSession | DatabaseSession, drone_ids: Sequence[DroneId]
) -> dict[DroneId, DroneSettings]:
    """Returns the settings of those among these drones that have any; the others have the defaults."""
    rows = await session.scalars(select(DroneSettingsRow).where(DroneSettingsRow.drone_id.in_(drone_ids)))
    return {DroneId(row.drone_id): settings_from(row.chosen) for row in rows}


async def change_settings(
    session: AsyncSession, *, drone_id: int, change: dict[str, Any], action: AuditAction
) -> DroneSettings:
    """Merges `change` (checked values by name) into the chosen values. Raises UnknownDrone, BadDroneSettings."""
    drone = await session.get(DroneRow, drone_id, with_for_update=True)  # serialises changes by two admins
    if drone is None:
        raise UnknownDrone
    row = await session.get(DroneSettingsRow, drone_id)
    before = settings_from(row.chosen if row is not None else {}).as_values()
    chosen = {**(row.chosen if row is not None else {}), **change}
    settings = settings_from(chosen)
    if row is None:
        session.add(DroneSettingsRow(drone_id=drone_id, chosen=chosen, changed_at=action.at))
    else:
        row.chosen, row.changed_at = chosen, action.at
    changed = {name: [before[name], value] for name, value in settings.as_values().items() if before[name] != value}
    if changed:
        action.record(session, "drone.settings_changed", drone_id=drone_id, drone=drone.name, changed=changed)
    return settings


async def load_into(hub: Hub, database: Database) -> None:
    """At start, after the hub knows the drones."""
    async with database.reading() as session:
        loaded = await load_settings(session)
    for drone_id, settings in loaded.items():
        apply_to(hub, drone_id, settings)


def apply_to(hub: Hub, drone_id: DroneId, settings: DroneSettings) -> None:
    """Applies the settings now, for the tower and for the agent."""
    hub.changes.apply_safety(drone_id, settings.safety)
    hub.changes.apply_stream(drone_id, settings.stream)


def settings_in(hub: Hub, drone_id: DroneId) -> DroneSettings:
    """Returns the settings in effect for the drone."""
    drone = hub.state.drones.get(drone_id)
    if drone is None:
        return DroneSettings()
    return DroneSettings(safety=drone.safety, stream=drone.stream)
