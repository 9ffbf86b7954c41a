"""Watches whether the sign-in of an open connection still stands."""

import time
from collections.abc import Callable
from typing import Final

from server.accounts.sessions import Principal
from server.beats import rest
from server.clock import Clock
from server.relay.viewer_sign_in import StillSignedIn

SESSION_CHECK_EVERY_S: Final = 1.0
ASK_DATABASE_EVERY_S: Final = 60.0


async def watch_session(
    viewer: Principal, *, clock: Clock, still_signed_in: StillSignedIn, over: Callable[[], None]
) -> None:
    """Returns when it has ended, after `over` was called."""
    asked, expires_at = time.monotonic(), viewer.expires_at
    while True:
        await rest(SESSION_CHECK_EVERY_S)
        expired = clock() >= expires_at
        if expired or time.monotonic() - asked >= ASK_DATABASE_EVERY_S:
            asked = time.monotonic()
            principal = await still_signed_in(clock())
            if principal is None:
                over()
                return
            expires_at = principal.expires_at
