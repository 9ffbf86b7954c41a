"""Every table of the tower, for migrations and the start-up check."""

from typing import Final

from server.accounts.store import tables as accounts
from server.airspace.store import tables as zones
from server.alerts.store import tables as alerts
from server.alerts.store.channels import tables as alert_channels
from server.audit.store import chain_tables as audit_chain
from server.audit.store import tables as audit
from server.control.store import tables as control
from server.fleet.store import tables as fleet
from server.flights.store import tables as flights
from server.maps.store import tables as maps
from server.plans.store import tables as missions
from server.readiness.store import checklist_tables as preflight
from server.readiness.store import task_tables as maintenance
from server.storage.database import Base
from server.teams.store import tables as teams
from server.towers.store import tables as towers
from server.towers.store import tower_lock_table as tower_lock
from server.video.store import tables as recordings

ALL: Final = (
    accounts,
    alert_channels,
    alerts,
    audit,
    audit_chain,
    control,
    fleet,
    flights,
    maintenance,
    maps,
    missions,
    preflight,
    recordings,
    teams,
    tower_lock,
    towers,
    zones,
)
METADATA: Final = Base.metadata
