"""The parts of one running tower, as `app.py` put them together. Routes find them with `tower_of(request)`."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, cast

from starlette.requests import HTTPConnection

from server.beats import Looks

if TYPE_CHECKING:  # the capabilities know `tower_of`, so this file must not import them in earnest
    from datetime import datetime

    from server.accounts.passkey_sign_in import PasskeyDoor
    from server.accounts.password_policy import PasswordPolicy
    from server.accounts.passwords import Passwords
    from server.accounts.sessions import Sessions
    from server.accounts.sign_in import Door
    from server.accounts.tokens import ApiTokens
    from server.anonymous.budget import AnonymousBudget
    from server.clock import Clock
    from server.control.desk import ControlDesk
    from server.control.loss_checks import LossChecks
    from server.control.rehearsal import Rehearsals
    from server.control.stays import Stays
    from server.control.watchman import Watchman
    from server.database import Database
    from server.fleet.enrolment_news import EnrolmentNews
    from server.fleet.loans import LoanKeeper
    from server.fleet.roster import Roster
    from server.flight_logs.receiving import LogReceiver
    from server.flight_logs.shelf import LogShelf
    from server.operations.clerk import OperationClerk
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
    door: Door
    passkey_door: PasskeyDoor
    hub: Hub
    desk: ControlDesk
    roster: Roster
    loan_keeper: LoanKeeper
    loss_checks: LossChecks
    rehearsals: Rehearsals
    stays: Stays
    watchman: Watchman
    enrolment_news: EnrolmentNews
    sign_in_rules: SignInRules
    clerk: OperationClerk
    log_shelf: LogShelf
    log_receiver: LogReceiver
    recordings: Recordings
    loop_lag: LoopLag
    anonymous: AnonymousBudget
    started_at: datetime
    looks: Looks = field(default_factory=Looks)
    before_shutdown: list[Callable[[], Awaitable[None]]] = field(default_factory=list)
    """Run, in order, while connections are still open: the place to say good-bye on them."""


def tower_of(connection: HTTPConnection) -> Tower:
    return cast("Tower", connection.app.state.tower)


def address_of(connection: HTTPConnection) -> str:
    """The network address of the other side, for the audit trail and the throttle."""
    return connection.client.host if connection.client else ""
