"""How many requests a signed-in person may make, over all sessions and tokens. Whatever flies or commands a drone is
never refused here."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final

from server.kernel.access import Action
from server.kernel.refusal import RetryLater
from server.kernel.shares import MAX_NAMED, ShareName, Shares
from server.link.core.token_bucket import TokenBucket
from wire.ids import UserId

REFILLED_IN_S: Final = 10.0
FLIES: Final = frozenset({Action.FLY, Action.COMMAND, Action.HOLD_SEVERAL})
READS: Final = frozenset({"GET", "HEAD"})


class TooManyRequests(RetryLater):
    """Of one person."""

    def __init__(self, retry_after_s: float) -> None:
        super().__init__("too many requests in a short time: wait a few seconds", retry_after_s=retry_after_s)


class RequestShares:
    """One for a tower. `monotonic`: seconds."""

    def __init__(self, shares: Shares, monotonic: Callable[[], float] = time.monotonic) -> None:
        self._shares = shares
        self._monotonic = monotonic
        self._accounts: dict[tuple[ShareName, UserId], tuple[int, TokenBucket]] = {}
        """With the limit by which each was made."""

    def admit(self, user_id: UserId, action: Action, method: str) -> None:
        """Accounts for a request. Raises TooManyRequests."""
        if action in FLIES:
            return
        now = self._monotonic()
        for share in (ShareName.REQUESTS,) if method in READS else (ShareName.REQUESTS, ShareName.WRITES):
            account = self._account(share, user_id, now)
            if not account.take(1.0, now):
                raise TooManyRequests(account.wait_s(1.0))

    def _account(self, share: ShareName, user_id: UserId, now: float) -> TokenBucket:
        limit = self._shares.limit(share)
        made_by, account = self._accounts.get((share, user_id), (0, None))
        if account is None or made_by != limit:
            if len(self._accounts) >= MAX_NAMED:
                self._accounts = {key: one for key, one in self._accounts.items() if not one[1].is_full(now)}
            account = TokenBucket(limit / REFILLED_IN_S, limit, now)
            self._accounts[share, user_id] = limit, account
        return account
