"""Assembles the parts of a tower that shares a bus with others. Nothing of it is imported without a bus."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from fastapi import FastAPI
from prometheus_client import CollectorRegistry

from server.control.store.hub_event_handler import HubEventHandler
from server.control.store.lease_store import DatabaseLeaseStore
from server.control.store.loss_checks import LossChecks
from server.control.store.service import ControlService
from server.fleet.store.snapshot import sessions_after, sessions_among
from server.http.authentication import Authenticator
from server.kernel.clock import Clock
from server.kernel.fleet import SignInRecord
from server.kernel.people import SignInId
from server.live.hub import Hub
from server.runtime.settings import Settings
from server.runtime.vault import Vault
from server.storage.database import Database
from server.towers.core.messages import BUS_VERSION
from server.towers.store.membership import TowerMembership
from server.towers.store.tower_lock import TowerLock

if TYPE_CHECKING:
    from server.towers.api.several_towers import SeveralTowers


def new_lock(settings: Settings, clock: Clock) -> TowerLock | TowerMembership:
    """The exclusive lock of one tower, or the place of one among several."""
    if settings.bus_url:
        membership = TowerMembership(settings.database_url, clock=clock)
        membership.own_url, membership.bus_version = settings.own_url, BUS_VERSION
        return membership
    return TowerLock(settings.database_url, clock=clock)


def share_bus(
    settings: Settings,
    lock: TowerLock | TowerMembership,
    hub: Hub,
    leases: DatabaseLeaseStore,
    service: ControlService,
    database: Database,
    clock: Clock,
    loss_checks: LossChecks,
    event_handler: HubEventHandler,
    vault: Vault,
) -> SeveralTowers | None:
    """None without a bus."""
    if not isinstance(lock, TowerMembership):
        return None
    from server.towers.api.several_towers import SeveralTowers
    from server.towers.store.claims import Claims
    from server.towers.store.drone_homes import DroneHomes

    several = SeveralTowers(settings.bus_url, lock, hub, keys=vault.raw_keys, authority=settings.bus_authority)

    async def read_sessions(session_ids: Sequence[int]) -> Mapping[SignInId, SignInRecord]:
        async with database.reading() as session:
            return await sessions_among(session, session_ids)

    async def read_newer_sessions(after: int) -> Mapping[SignInId, SignInRecord]:
        async with database.reading() as session:
            return await sessions_after(session, after)

    several.read_sessions, several.read_newer_sessions = read_sessions, read_newer_sessions
    homes = DroneHomes(database, clock, lock.tower)
    leases.refuse_elsewhere = homes.refuse_elsewhere
    several.claims = Claims(
        homes=homes,
        towers=several.towers,
        hub=hub,
        service=service,
        loss_checks=loss_checks,
        event_handler=event_handler,
    )
    return several


def share_requests(
    app: FastAPI, hub: Hub, several: SeveralTowers, authenticator: Authenticator, registry: CollectorRegistry
) -> None:
    """Requests about drones of other towers go there."""
    from server.monitoring.api.towers import TowersCollector
    from server.towers.api.to_the_home import ToTheHome

    registry.register(TowersCollector(several, hub))
    several.asking.application = app
    several.asking.vouch = authenticator.vouch
    app.add_middleware(ToTheHome, hub=hub, towers=several.towers, claims=several.claims, asking=several.asking)
