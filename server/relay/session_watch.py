"""Watches whether the sign-in of an open connection still stands."""

import time
from collections.abc import Callable
from typing import Final

from server.accounts.sessions import Principal
from server.beats import Looks
from server.clock import Clock
from server.relay.viewer_sign_in import StillSignedIn

ASK_DATABASE_EVERY_S: Final = 60.0


async def watch_session(
    viewer: Principal, *, clock: Clock, looks: Looks, still_signed_in: StillSignedIn, over: Callable[[], None]
) -> None:
    """Returns when it has ended, after `over` was called."""
    asked, expires_at = time.monotonic(), viewer.expires_at

    def is_due() -> bool:
        return clock() >= expires_at or time.monotonic() - asked >= ASK_DATABASE_EVERY_S

    while True:
        await looks.until(is_due)
        asked = time.monotonic()
        principal = await still_signed_in(clock())
        if principal is None:
            over()
            return
        expires_at = principal.expires_at
