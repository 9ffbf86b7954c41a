"""Dependencies of routes, one per part of the tower: a route's signature lists everything it uses.

Nothing else reads `app.state`; a test checks that. `server/app/composition.py` puts the parts there (`provide`).

Every provider is `async def` because FastAPI runs others in a thread pool. It takes an `HTTPConnection`, so that it
serves WebSockets as well as requests. Rules and helpers receive the part itself, never a request.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from typing import Annotated, Any, cast

from fastapi import Depends, FastAPI
from prometheus_client import CollectorRegistry
from starlette.requests import HTTPConnection

from server.accounts.store.passkey_sign_in import PasskeySignInService
from server.accounts.store.password_policy import PasswordPolicy
from server.accounts.store.passwords import Passwords
from server.accounts.store.sessions import Sessions
from server.accounts.store.sign_in import SignInService
from server.accounts.store.tokens import ApiTokens
from server.alerts.core.announcer import Announcer
from server.alerts.store.channels.deliverer import AlertDeliverer
from server.alerts.store.writer import AlertWriter
from server.anonymous.core.budget import AnonymousBudget
from server.audit.store.action import AuditAction
from server.audit.store.trail import NamedUser
from server.control.store.hub_event_handler import HubEventHandler
from server.control.store.loss_checks import LossChecks
from server.control.store.rehearsal import Rehearsals
from server.control.store.service import ControlService
from server.fleet.store.enrolment_notifier import EnrolmentNotifier
from server.fleet.store.roster import Roster
from server.flights.store.flights import Flights
from server.http.authentication import Authenticator
from server.http.part import Services
from server.http.peer_address import address_of
from server.kernel.clock import Clock
from server.link.api.agent_sign_in import SignInRules
from server.link.api.data_endpoint import DataEndpoint
from server.live.hub import Hub
from server.logs.store.quota import FlightLogQuota
from server.logs.store.receiving import LogReceiver
from server.runtime.aligned_timers import SharedChecks
from server.runtime.loop_watch import LoopWatch
from server.runtime.settings import Settings
from server.runtime.side_thread import SideThread
from server.runtime.vault import Vault
from server.storage.database import Database
from server.storage.retention import Retention
from server.towers.store.membership import TowerMembership
from server.towers.store.tower_lock import TowerLock
from server.video.store.recordings import Recordings


@dataclass(frozen=True, kw_only=True)
class Parts:
    """The parts of one application."""

    settings: Settings
    clock: Clock
    started_at: datetime
    database: Database
    lock: TowerLock | TowerMembership
    vault: Vault
    passwords: Passwords
    password_policy: PasswordPolicy
    sessions: Sessions
    api_tokens: ApiTokens
    authenticator: Authenticator
    sign_in: SignInService
    passkey_sign_in: PasskeySignInService
    hub: Hub
    alert_writer: AlertWriter
    announcer: Announcer
    alert_deliverer: AlertDeliverer
    roster: Roster
    control: ControlService
    event_handler: HubEventHandler
    loss_checks: LossChecks
    rehearsals: Rehearsals
    enrolment_notifier: EnrolmentNotifier
    sign_in_rules: SignInRules
    flight_log_quota: FlightLogQuota
    log_receiver: LogReceiver
    recordings: Recordings
    flights: Flights
    retention: Retention
    loop_watch: LoopWatch
    side_thread: SideThread
    anonymous: AnonymousBudget
    shared_checks: SharedChecks
    services: Services
    """Those of the parts of the capabilities (`part.py`)."""


def provide(app: FastAPI, parts: Parts, metrics_registry: CollectorRegistry) -> None:
    """Call it before the first request."""
    app.state.parts = parts
    app.state.metrics_registry = metrics_registry


def provide_data_endpoint(app: FastAPI, endpoint: DataEndpoint) -> None:
    """Call it once its socket is open."""
    app.state.data_endpoint = endpoint


def _parts(connection: HTTPConnection) -> Parts:
    return cast("Parts", connection.app.state.parts)


async def _address(connection: HTTPConnection) -> str:
    return address_of(connection)


AddressDep = Annotated[str, Depends(_address)]
"""The network address of the client."""


@dataclass(frozen=True)
class AuditContext:
    """The clock and the client address of a request."""

    clock: Clock
    address: str

    def action(self, by: NamedUser) -> AuditAction:
        """Returns an action of this person now, for the audit trail."""
        return AuditAction(by=by, at=self.clock(), address=self.address)


async def _audit(connection: HTTPConnection) -> AuditContext:
    return AuditContext(_parts(connection).clock, address_of(connection))


AuditDep = Annotated[AuditContext, Depends(_audit)]


def _part(choose: Callable[[Parts], object]) -> Any:
    async def provider(connection: HTTPConnection) -> object:
        return choose(_parts(connection))

    return Depends(provider)


def provided(kind: type[object]) -> Any:
    """The service of this type that the part of a capability makes: `Annotated[Notes, provided(Notes)]`."""
    return _part(lambda parts: parts.services.of(kind))


SettingsDep = Annotated[Settings, _part(lambda parts: parts.settings)]
ClockDep = Annotated[Clock, _part(lambda parts: parts.clock)]
StartedAtDep = Annotated[datetime, _part(lambda parts: parts.started_at)]
DatabaseDep = Annotated[Database, _part(lambda parts: parts.database)]
TowerLockDep = Annotated[TowerLock | TowerMembership, _part(lambda parts: parts.lock)]
VaultDep = Annotated[Vault, _part(lambda parts: parts.vault)]
PasswordsDep = Annotated[Passwords, _part(lambda parts: parts.passwords)]
PasswordPolicyDep = Annotated[PasswordPolicy, _part(lambda parts: parts.password_policy)]
SessionsDep = Annotated[Sessions, _part(lambda parts: parts.sessions)]
ApiTokensDep = Annotated[ApiTokens, _part(lambda parts: parts.api_tokens)]
AuthenticatorDep = Annotated[Authenticator, _part(lambda parts: parts.authenticator)]
SignInDep = Annotated[SignInService, _part(lambda parts: parts.sign_in)]
PasskeySignInDep = Annotated[PasskeySignInService, _part(lambda parts: parts.passkey_sign_in)]
HubDep = Annotated[Hub, _part(lambda parts: parts.hub)]
AlertDelivererDep = Annotated[AlertDeliverer, _part(lambda parts: parts.alert_deliverer)]
AnnouncerDep = Annotated[Announcer, _part(lambda parts: parts.announcer)]
AlertWriterDep = Annotated[AlertWriter, _part(lambda parts: parts.alert_writer)]
RosterDep = Annotated[Roster, _part(lambda parts: parts.roster)]
ControlDep = Annotated[ControlService, _part(lambda parts: parts.control)]
EventHandlerDep = Annotated[HubEventHandler, _part(lambda parts: parts.event_handler)]
LossChecksDep = Annotated[LossChecks, _part(lambda parts: parts.loss_checks)]
RehearsalsDep = Annotated[Rehearsals, _part(lambda parts: parts.rehearsals)]
EnrolmentNotifierDep = Annotated[EnrolmentNotifier, _part(lambda parts: parts.enrolment_notifier)]
SignInRulesDep = Annotated[SignInRules, _part(lambda parts: parts.sign_in_rules)]
FlightLogQuotaDep = Annotated[FlightLogQuota, _part(lambda parts: parts.flight_log_quota)]
LogReceiverDep = Annotated[LogReceiver, _part(lambda parts: parts.log_receiver)]
RecordingsDep = Annotated[Recordings, _part(lambda parts: parts.recordings)]
FlightsDep = Annotated[Flights, _part(lambda parts: parts.flights)]
LoopWatchDep = Annotated[LoopWatch, _part(lambda parts: parts.loop_watch)]
SideThreadDep = Annotated[SideThread, _part(lambda parts: parts.side_thread)]
AnonymousBudgetDep = Annotated[AnonymousBudget, _part(lambda parts: parts.anonymous)]
SharedChecksDep = Annotated[SharedChecks, _part(lambda parts: parts.shared_checks)]


async def _metrics_registry(connection: HTTPConnection) -> CollectorRegistry:
    return cast("CollectorRegistry", connection.app.state.metrics_registry)


MetricsRegistryDep = Annotated[CollectorRegistry, Depends(_metrics_registry)]


async def _data_endpoint(connection: HTTPConnection) -> DataEndpoint:
    return cast("DataEndpoint", connection.app.state.data_endpoint)


DataEndpointDep = Annotated[DataEndpoint, Depends(_data_endpoint)]
