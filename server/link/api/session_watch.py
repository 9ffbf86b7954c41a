"""Watches whether the sign-in of an open connection is still valid."""

import time
from collections.abc import Callable
from typing import Final

from server.kernel.clock import Clock
from server.kernel.people import Principal
from server.link.api.viewer_sign_in import StillSignedIn
from server.runtime.aligned_timers import SharedChecks
from server.storage.database import DatabaseUnavailable

ASK_DATABASE_EVERY_S: Final = 60.0


async def watch_session(
    viewer: Principal,
    *,
    clock: Clock,
    shared_checks: SharedChecks,
    still_signed_in: StillSignedIn,
    over: Callable[[str], None],
) -> None:
    """Returns when the sign-in has ended, after calling `over` with the reason.

    Asks the database once a minute, when the sign-in would expire, and within a second of a change of accounts that may
    have ended it.
    """
    asked, expires_at, in_doubt = time.monotonic(), viewer.expires_at, False

    def is_due() -> bool:
        nonlocal in_doubt
        in_doubt = still_signed_in.comes_into_doubt() or in_doubt
        return in_doubt or clock() >= expires_at or time.monotonic() - asked >= ASK_DATABASE_EVERY_S

    while True:
        await shared_checks.until(is_due)
        asked = time.monotonic()
        try:
            found = await still_signed_in.ask(clock())
        except DatabaseUnavailable:
            if clock() < expires_at:
                continue  # pilots keep flying; a doubt stays until the database has answered it
            found = "the session has ended"
        in_doubt = False
        if isinstance(found, str):
            over(found)
            return
        expires_at = found.expires_at
