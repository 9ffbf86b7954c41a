"""The parts of one running tower, as `app.py` put them together. Routes find them with `tower_of(request)`."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, cast

from starlette.requests import HTTPConnection

from server.aligned_timers import SharedChecks

if TYPE_CHECKING:  # the capabilities know `tower_of`, so this file must not import them in earnest
    from datetime import datetime

    from server.accounts.passkey_sign_in import PasskeySignInService
    from server.accounts.password_policy import PasswordPolicy
    from server.accounts.passwords import Passwords
    from server.accounts.sessions import Sessions
    from server.accounts.sign_in import SignInService
    from server.accounts.tokens import ApiTokens
    from server.anonymous.budget import AnonymousBudget
    from server.control.hub_event_handler import HubEventHandler
    from server.control.loss_checks import LossChecks
    from server.control.rehearsal import Rehearsals
    from server.control.service import ControlService
    from server.control.stays import Stays
    from server.database import Database
    from server.domain.clock import Clock
    from server.fleet.enrolment_news import EnrolmentNews
    from server.fleet.loans import LoanExpiry
    from server.fleet.roster import Roster
    from server.flight_logs.quota import FlightLogQuota
    from server.flight_logs.receiving import LogReceiver
    from server.operations.audit_writer import OperationAuditWriter
    from server.recordings.recordings import Recordings
    from server.relay.agent_sign_in import SignInRules
    from server.relay.hub import Hub
    from server.settings import Settings
    from server.system.loop_lag import LoopLag
    from server.vault import Vault


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
    passkey_door: PasskeySignInService
    hub: Hub
    service: ControlService
    roster: Roster
    loan_keeper: LoanExpiry
    loss_checks: LossChecks
    rehearsals: Rehearsals
    stays: Stays
    event_handler: HubEventHandler
    enrolment_news: EnrolmentNews
    sign_in_rules: SignInRules
    audit_writer: OperationAuditWriter
    log_shelf: FlightLogQuota
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
