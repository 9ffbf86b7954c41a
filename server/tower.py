"""The parts of one running tower, as `app.py` put them together. Routes find them with `tower_of(request)`."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from typing import cast

from starlette.requests import HTTPConnection

from server.accounts.passwords import Passwords
from server.accounts.sessions import Sessions
from server.accounts.throttle import SignInThrottle
from server.clock import Clock
from server.database import Database
from server.fleet.live_picture import LivePicture
from server.fleet.roster import Roster
from server.settings import Settings


@dataclass(frozen=True)
class Tower:
    settings: Settings
    clock: Clock
    database: Database
    passwords: Passwords
    sessions: Sessions
    throttle: SignInThrottle
    picture: LivePicture
    roster: Roster
    before_shutdown: list[Callable[[], Awaitable[None]]] = field(default_factory=list)
    """Run, in order, while connections are still open: the place to say good-bye on them."""


def tower_of(connection: HTTPConnection) -> Tower:
    return cast("Tower", connection.app.state.tower)


def address_of(connection: HTTPConnection) -> str:
    """The network address of the other side, for the audit trail and the throttle."""
    return connection.client.host if connection.client else ""
