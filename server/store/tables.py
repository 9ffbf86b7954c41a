"""Every table of the tower, for migrations and the start-up check."""

from typing import Final

from server.store import tower_lock_table as tower_lock
from server.store.accounts import tables as accounts
from server.store.alert_channels import tables as alert_channels
from server.store.alerts import tables as alerts
from server.store.audit import chain_tables as audit_chain
from server.store.audit import tables as audit
from server.store.control import tables as control
from server.store.database import Base
from server.store.fleet import tables as fleet
from server.store.flights import tables as flights
from server.store.maintenance import tables as maintenance
from server.store.maps import tables as maps
from server.store.missions import tables as missions
from server.store.preflight import tables as preflight
from server.store.recordings import tables as recordings
from server.store.teams import tables as teams
from server.store.towers import tables as towers
from server.store.zones import tables as zones

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
