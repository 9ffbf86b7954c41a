"""How much of the tower a signed-in person may ask for, over all sessions and tokens: in processor time, because
requests differ a thousandfold, and in changes of the database. Whatever flies or commands a drone is never refused
here, and costs nothing."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Final

from server.kernel.access import Action
from server.kernel.refusal import RetryLater
from server.kernel.shares import MAX_NAMED, ShareName, Shares
from server.link.core.token_bucket import TokenBucket
from wire.ids import UserId

REFILLED_IN_S: Final = {ShareName.REQUEST_TIME: 30.0, ShareName.WRITES: 10.0}
FIXED_MS: Final = 1
"""Of each request: what the server does before it is known whose it is, and after its answer."""
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

    def admit(self, user_id: UserId, action: Action, method: str) -> bool:
        """Whether the time of this request counts. Raises TooManyRequests."""
        if action in FLIES:
            return False
        now = self._monotonic()
        self._take(ShareName.REQUEST_TIME, user_id, FIXED_MS, now)
        if method not in READS:
            self._take(ShareName.WRITES, user_id, 1, now)
        self._shares.note(ShareName.REQUEST_TIME, user_id, FIXED_MS)
        return True

    def spent(self, user_id: int, seconds: float) -> None:
        """Processor time that went into an admitted request. What is beyond the share is owed, and delays the next."""
        now, took_ms = self._monotonic(), 1e3 * seconds
        self._account(ShareName.REQUEST_TIME, UserId(user_id), now).owe(took_ms, now)
        self._shares.note(ShareName.REQUEST_TIME, user_id, round(took_ms))

    def _take(self, share: ShareName, user_id: UserId, count: int, now: float) -> None:
        account = self._account(share, user_id, now)
        if not account.take(count, now):
            raise TooManyRequests(account.wait_s(count))

    def _account(self, share: ShareName, user_id: UserId, now: float) -> TokenBucket:
        limit = self._shares.limit(share)
        made_by, account = self._accounts.get((share, user_id), (0, None))
        if account is None or made_by != limit:
            if len(self._accounts) >= MAX_NAMED:
                self._accounts = {key: one for key, one in self._accounts.items() if not one[1].is_full(now)}
            account = TokenBucket(limit / REFILLED_IN_S[share], limit, now)
            self._accounts[share, user_id] = limit, account
        return account
