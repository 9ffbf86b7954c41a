"""Limits how fast passwords can be tried: a few at once, then delays that double. A core: takes `now`.

An address is an IPv4 address or an IPv6 /64 (server.anonymous.core.networks). Each try counts four times:

- for the name at this address, against typing errors and simple guessing;
- for the address, whatever the name, against trying one password on many names;
- for the name at all addresses unknown to it, against guessing from many addresses. The owner is not locked out: known
  addresses and passkeys still work;
- for the network around the address. This count refuses nobody, but its passwords are hashed after the others.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from server.anonymous.core.fair_queue import Priority
from server.anonymous.core.hashing import Caller
from server.anonymous.core.known_addresses import KnownAddresses
from server.anonymous.core.limits import LIMITS, AnonymousLimits
from server.anonymous.core.networks import Origin, origin_of
from server.link.core.token_bucket import TokenBucket

FREE_TRIES: Final = 5
"""Failures without a delay, because people mistype."""
FREE_TRIES_OF_ADDRESS: Final = 50
"""A whole office may come from one address, in the morning."""
FIRST_WAIT_S: Final = 1.0
MAX_WAIT_S: Final = 300.0
FORGOTTEN_AFTER_S: Final = 900.0
"""Longer than the longest wait: waiting it out does not clear the count."""
MAX_ENTRIES: Final = 30_000
"""Whoever sprays names can push the oldest out, not grow the memory."""
SUSPECT_FROM: Final = 2
"""Failures in a network from which on those who come from there wait until the others have hashed."""
MAX_NAMES: Final = 10_000
"""Whose guesses are counted. Beyond it, the half with most guesses left is forgotten."""
_HOUR_S: Final = 3600.0

_Key = tuple[str, str]


@dataclass
class _Tries:
    failures: int
    last_s: float
    open_at_s: float


class SignInThrottle:
    """Counts a try as failed when it begins, so that a hundred at the same moment are a hundred failures."""

    def __init__(
        self,
        known: KnownAddresses | None = None,
        limits: AnonymousLimits = LIMITS,
        *,
        on_refused: Callable[[], None] = lambda: None,
    ) -> None:
        """`known`: which names have signed in from where; without it all addresses are unknown."""
        self._on_refused = on_refused
        self._tries: OrderedDict[_Key, _Tries] = OrderedDict()
        self._known = known
        self._guesses: dict[str, TokenBucket] = {}
        self._guesses_per_s = limits.guesses_per_name_per_hour / 2 / _HOUR_S
        # Half of an hour's guesses saved up, and the other half as they grow: never more than all of them in an hour.
        self._guesses_at_once = limits.guesses_per_name_per_hour // 2

    def __len__(self) -> int:
        return len(self._tries)

    def begin(self, *, name: str, address: str, now_s: float) -> float:
        """0 when the try may go on (it is then counted), else how many seconds to wait."""
        origin = origin_of(address)
        bounds = (
            ((name, origin.address), FREE_TRIES, MAX_WAIT_S),
            (("", origin.address), FREE_TRIES_OF_ADDRESS, MAX_WAIT_S),
        )
        wait_s = max(self._wait_s(key, now_s) for key, _, _ in bounds)
        if wait_s <= 0 and not self._is_known(name, origin):
            wait_s = self._wait_of_name_s(name, now_s)
        if wait_s > 0:
            self._on_refused()
            return wait_s
        for key, free, longest_s in bounds:
            self._count(key, free, longest_s, now_s)
        self._count(_network_key(origin), MAX_ENTRIES, 0.0, now_s)
        while len(self._tries) > MAX_ENTRIES:
            self._tries.popitem(last=False)
        return 0.0

    def caller(self, *, name: str, address: str, now_s: float) -> Caller:
        """For whom a password is hashed, after `begin`."""
        origin = origin_of(address)
        if self._is_known(name, origin):
            return Caller(origin, Priority.KNOWN)
        tries = self._tries.get(_network_key(origin))
        recent = tries is not None and now_s - tries.last_s < FORGOTTEN_AFTER_S
        suspect = tries is not None and recent and tries.failures > SUSPECT_FROM
        return Caller(origin, Priority.SUSPECT if suspect else Priority.FRESH)

    def succeeded(self, *, name: str, address: str) -> None:
        """Clears the name, but for the address only this try: an account must not clear the address for others."""
        origin = origin_of(address)
        self._tries.pop((name, origin.address), None)
        if not self._is_known(name, origin):
            bucket = self._guesses.get(name)
            if bucket is not None:
                bucket.give_back(1.0)
        if self._known is not None:
            self._known.remember(origin, name)
        of_network = self._tries.get(_network_key(origin))
        if of_network is not None:
            of_network.failures = max(0, of_network.failures - 1)
        of_address = self._tries.get(("", origin.address))
        if of_address is not None:
            of_address.failures = max(0, of_address.failures - 1)
            if of_address.failures < FREE_TRIES_OF_ADDRESS:
                of_address.open_at_s = float("-inf")

    def _is_known(self, name: str, origin: Origin) -> bool:
        return self._known is not None and self._known.knows(origin, name)

    def _wait_of_name_s(self, name: str, now_s: float) -> float:
        bucket = self._guesses.get(name)
        if bucket is None:
            if len(self._guesses) >= MAX_NAMES:
                self._forget_names(now_s)
            bucket = self._guesses[name] = TokenBucket(self._guesses_per_s, self._guesses_at_once, now_s)
        return 0.0 if bucket.take(1.0, now_s) else bucket.wait_s(1.0)

    def _forget_names(self, now_s: float) -> None:
        """Never those that were guessed at most: spraying other names must not give back the guesses at one."""
        by_guesses_left = sorted(self._guesses.items(), key=lambda one: one[1].level(now_s))
        self._guesses = dict(by_guesses_left[: MAX_NAMES // 2])

    def _wait_s(self, key: _Key, now_s: float) -> float:
        tries = self._tries.get(key)
        if tries is None or now_s - tries.last_s >= FORGOTTEN_AFTER_S:
            return 0.0
        return tries.open_at_s - now_s

    def _count(self, key: _Key, free: int, longest_s: float, now_s: float) -> None:
        tries = self._tries.get(key)
        if tries is None or now_s - tries.last_s >= FORGOTTEN_AFTER_S:
            tries = _Tries(failures=0, last_s=now_s, open_at_s=now_s)
        tries.failures += 1
        tries.last_s = now_s
        beyond = tries.failures - free
        if beyond >= 0:
            tries.open_at_s = now_s + min(FIRST_WAIT_S * 2.0 ** min(beyond, 20), longest_s)
        self._tries[key] = tries
        self._tries.move_to_end(key)


def _network_key(origin: Origin) -> _Key:
    return "\nnetwork", origin.network
