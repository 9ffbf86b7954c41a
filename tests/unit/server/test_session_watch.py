"""The watch over an open connection's sign-in while the database does not respond."""

import asyncio
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest

from server.kernel.people import Principal, Role
from server.link.api.session_watch import watch_session
from server.storage.database import DatabaseUnavailable
from wire.ids import UserId

NOW = datetime(2026, 1, 1, tzinfo=UTC)
ALICE = Principal(UserId(1), "Alice", Role.OPERATOR, 7, NOW + timedelta(hours=1))


class SharedChecks:
    """Every check runs at once. A watch that sends no query in 50 of them has forgotten."""

    async def until(self, is_due: Callable[[], bool]) -> None:
        for _ in range(50):
            await asyncio.sleep(0)
            if is_due():
                return
        raise TimeoutError("nobody asks any more")


class SignIn:
    """In doubt once. The database fails some times before it reports the end of the sign-in."""

    def __init__(self, *, failures: int) -> None:
        self.doubts, self.failures = 1, failures

    def comes_into_doubt(self) -> bool:
        self.doubts -= 1
        return self.doubts == 0

    async def ask(self, now: datetime) -> Principal | str:
        self.failures -= 1
        if self.failures >= 0:
            raise DatabaseUnavailable("it does not answer")
        return "the session has ended"


async def _ended(still: SignIn, clock: Callable[[], datetime]) -> list[str]:
    over: list[str] = []
    checks: Any = SharedChecks()
    signed_in: Any = still
    await watch_session(ALICE, clock=clock, shared_checks=checks, still_signed_in=signed_in, over=over.append)
    return over


async def test_a_doubt_stays_until_the_database_has_answered_it() -> None:
    assert await _ended(SignIn(failures=3), lambda: NOW) == ["the session has ended"]


async def test_without_a_doubt_the_connection_goes_on() -> None:
    still = SignIn(failures=0)
    still.doubts = 0
    with pytest.raises(TimeoutError, match="nobody asks"):
        await _ended(still, lambda: NOW)


async def test_a_sign_in_that_is_over_by_the_clock_ends_without_the_database() -> None:
    assert await _ended(SignIn(failures=100), lambda: NOW + timedelta(hours=2)) == ["the session has ended"]
