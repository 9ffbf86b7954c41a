"""Challenges for passkeys: random, single use, valid for five minutes and for one browser. A core.

Kept in memory: after a restart the browser requests another one. Bounded in number, and in rate per network. Nothing
here is slow, so that passkeys stay a way in while passwords are being guessed.
"""

from __future__ import annotations

import secrets
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from server.anonymous.core.networks import origin_of
from server.kernel.refusal import Refusal, RetryLater
from server.link.core.token_bucket import TokenBucket

CHALLENGE_BYTES: Final = 32
LIFETIME_S: Final = 300.0
"""People look for their telephone. A sign-in page that offers passkeys while one types waits as long."""
MAX_CHALLENGES: Final = 20_000
"""About 8 MB; then the oldest goes."""
ASKED_AT_ONCE: Final = 60
"""By one network: a whole office opens the sign-in page in the morning."""
ASKED_PER_S: Final = 1.0
MAX_NETWORKS: Final = 20_000


class Purpose(StrEnum):
    """A challenge for one is worth nothing for another."""

    SIGN_IN = "sign-in"
    ADD = "add"
    PROVE = "prove"


class ChallengeOver(Refusal):
    """Unknown, used, too old, or issued to another browser. The message does not say which, on purpose."""

    def __init__(self) -> None:
        super().__init__("this took too long or was already answered: try again")


class TooManyChallenges(RetryLater):
    def __init__(self) -> None:
        super().__init__("too many attempts from your network: wait before the next one", retry_after_s=1 / ASKED_PER_S)


@dataclass(frozen=True)
class _Given:
    purpose: Purpose
    asker: str
    until_s: float


class Challenges:
    """`asker`: the browser or session that a challenge is for, as text. `now_s`: seconds of any clock that goes on."""

    def __init__(self, random: Callable[[int], bytes] = secrets.token_bytes) -> None:
        self._random = random
        self._given: OrderedDict[bytes, _Given] = OrderedDict()  # the oldest first, and all live equally long
        self._networks: OrderedDict[str, TokenBucket] = OrderedDict()

    def __len__(self) -> int:
        return len(self._given)

    def give(self, *, purpose: Purpose, asker: str, address: str, now_s: float) -> bytes:
        """A new challenge of 32 bytes. Raises TooManyChallenges."""
        if not self._bucket_of(origin_of(address).address, now_s).take(1, now_s):
            raise TooManyChallenges
        self._forget_old(now_s)
        while len(self._given) >= MAX_CHALLENGES:
            self._given.popitem(last=False)
        challenge = self._random(CHALLENGE_BYTES)
        self._given[challenge] = _Given(purpose, asker, now_s + LIFETIME_S)
        return challenge

    def take(self, challenge: bytes, *, purpose: Purpose, asker: str, now_s: float) -> None:
        """Consumes the challenge, whoever presents it. Raises ChallengeOver if it is not valid for this."""
        given = self._given.pop(challenge, None)
        if given is None or now_s >= given.until_s or (given.purpose, given.asker) != (purpose, asker):
            raise ChallengeOver

    def _forget_old(self, now_s: float) -> None:
        while self._given and now_s >= next(iter(self._given.values())).until_s:
            self._given.popitem(last=False)

    def _bucket_of(self, network: str, now_s: float) -> TokenBucket:
        bucket = self._networks.get(network)
        if bucket is None:
            while len(self._networks) >= MAX_NETWORKS:
                self._networks.popitem(last=False)
            bucket = self._networks[network] = TokenBucket(ASKED_PER_S, ASKED_AT_ONCE, now_s)
        self._networks.move_to_end(network)
        return bucket
