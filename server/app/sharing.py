"""Assembles the parts of a tower that shares a bus with others. Nothing of it is imported without a bus."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from fastapi import FastAPI
from prometheus_client import CollectorRegistry

from server.api.authentication import Authenticator
from server.domain.clock import Clock
from server.domain.fleet import SignInRecord
from server.domain.people import SignInId
from server.live.hub import Hub
from server.live.towers.messages import BUS_VERSION
from server.runtime.settings import Settings
from server.runtime.vault import Vault
from server.store.control.hub_event_handler import HubEventHandler
from server.store.control.lease_store import DatabaseLeaseStore
from server.store.control.loss_checks import LossChecks
from server.store.control.service import ControlService
from server.store.database import Database
from server.store.fleet.snapshot import sessions_after, sessions_among
from server.store.tower_lock import TowerLock
from server.store.towers.membership import TowerMembership

if TYPE_CHECKING:
    from server.api.bus.several_towers import SeveralTowers


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
    from server.api.bus.several_towers import SeveralTowers
    from server.store.towers.claims import Claims
    from server.store.towers.drone_homes import DroneHomes

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
    from server.api.bus.to_the_home import ToTheHome
    from server.api.metrics.towers import TowersCollector

    registry.register(TowersCollector(several, hub))
    several.asking.application = app
    several.asking.vouch = authenticator.vouch
    app.add_middleware(ToTheHome, hub=hub, towers=several.towers, claims=several.claims, asking=several.asking)
