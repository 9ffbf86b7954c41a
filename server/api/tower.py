"""The parts of one running tower, as `app.py` put them together. Routes find them with `tower_of(request)`."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, cast

from starlette.requests import HTTPConnection

from server.runtime.aligned_timers import SharedChecks

if TYPE_CHECKING:  # the capabilities know `tower_of`, so this file must not import them in earnest
    from datetime import datetime

    from server.api.relay.agent_sign_in import SignInRules
    from server.domain.clock import Clock
    from server.live.anonymous.budget import AnonymousBudget
    from server.live.hub import Hub
    from server.runtime.loop_lag import LoopLag
    from server.runtime.settings import Settings
    from server.runtime.vault import Vault
    from server.store.accounts.passkey_sign_in import PasskeySignInService
    from server.store.accounts.password_policy import PasswordPolicy
    from server.store.accounts.passwords import Passwords
    from server.store.accounts.sessions import Sessions
    from server.store.accounts.sign_in import SignInService
    from server.store.accounts.tokens import ApiTokens
    from server.store.control.hub_event_handler import HubEventHandler
    from server.store.control.loss_checks import LossChecks
    from server.store.control.rehearsal import Rehearsals
    from server.store.control.service import ControlService
    from server.store.control.stays import Stays
    from server.store.database import Database
    from server.store.fleet.enrolment_notifier import EnrolmentNotifier
    from server.store.fleet.loans import LoanExpiry
    from server.store.fleet.roster import Roster
    from server.store.flight_logs.quota import FlightLogQuota
    from server.store.flight_logs.receiving import LogReceiver
    from server.store.operations.audit_writer import OperationAuditWriter
    from server.store.recordings.recordings import Recordings


@dataclass(frozen=True)
class Tower:
    settings: Settings
    clock: Clock
    database: Database
    vault: Vault
    passwords: Passwords
    password_policy: PasswordPolicy
    sessions: Sessions
    tokens: ApiTokens
    door: SignInService
    passkey_sign_in: PasskeySignInService
    hub: Hub
    service: ControlService
    roster: Roster
    loan_expiry: LoanExpiry
    loss_checks: LossChecks
    rehearsals: Rehearsals
    stays: Stays
    event_handler: HubEventHandler
    enrolment_notifier: EnrolmentNotifier
    sign_in_rules: SignInRules
    audit_writer: OperationAuditWriter
    flight_log_quota: FlightLogQuota
    log_receiver: LogReceiver
    recordings: Recordings
    loop_lag: LoopLag
    anonymous: AnonymousBudget
    started_at: datetime
    looks: SharedChecks = field(default_factory=SharedChecks)
    before_shutdown: list[Callable[[], Awaitable[None]]] = field(default_factory=list)
    """Run, in order, while connections are still open: the place to say good-bye on them."""


def tower_of(connection: HTTPConnection) -> Tower:
    return cast("Tower", connection.app.state.tower)


def address_of(connection: HTTPConnection) -> str:
    """The network address of the other side, for the audit trail and the throttle."""
    return connection.client.host if connection.client else ""
