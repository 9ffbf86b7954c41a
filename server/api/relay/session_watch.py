"""Watches whether the sign-in of an open connection still stands."""

import time
from collections.abc import Callable
from typing import Final

from server.api.relay.viewer_sign_in import StillSignedIn
from server.domain.clock import Clock
from server.domain.people import Principal
from server.runtime.aligned_timers import SharedChecks

ASK_DATABASE_EVERY_S: Final = 60.0


async def watch_session(
    viewer: Principal,
    *,
    clock: Clock,
    shared_checks: SharedChecks,
    still_signed_in: StillSignedIn,
    over: Callable[[str], None],
) -> None:
    """Returns when it has ended, after `over` was called with the reason in words.

    Asks the database once a minute, when the sign-in should end by itself, and within a second of a change of accounts
    after which it may be gone.
    """
    asked, expires_at = time.monotonic(), viewer.expires_at

    def is_due() -> bool:
        in_doubt = still_signed_in.comes_into_doubt()
        return in_doubt or clock() >= expires_at or time.monotonic() - asked >= ASK_DATABASE_EVERY_S

    while True:
        await shared_checks.until(is_due)
        asked = time.monotonic()
        found = await still_signed_in.ask(clock())
        if isinstance(found, str):
            over(found)
            return
        expires_at = found.expires_at
