"""The budget of one running tower: its counts and lines, which all adapters share. Metrics read it. Opens nothing."""

from __future__ import annotations

import ipaddress
import secrets
from collections import Counter
from collections.abc import Callable
from enum import StrEnum

from server.anonymous.core.connections import AnonymousConnection, ConnectionBudget
from server.anonymous.core.fair_queue import Priority
from server.anonymous.core.known_addresses import KnownAddresses
from server.anonymous.core.limits import LIMITS, AnonymousLimits
from server.anonymous.core.log_lines import LogBudget
from server.anonymous.core.networks import Origin, origin_of
from server.link.core.token_bucket import TokenBucket


class Over(StrEnum):
    """What of the table was used up: the label of `tower_anonymous_refused_total`."""

    HEAD = "head"
    HEAD_TIME = "head-time"
    PIPELINE = "pipeline"
    BODY = "body"
    BODY_TIME = "body-time"
    CONNECTIONS = "connections"
    UNREAD = "unread"
    REQUESTS = "requests"
    REQUEST_TIME = "request-time"
    HANDSHAKES = "handshakes"
    HANDSHAKE_BYTES = "handshake-bytes"
    HASHES = "hashes"
    HASH_TIME = "hash-time"
    GUESSES = "guesses"
    LOG_LINES = "log-lines"
    DATAGRAMS = "datagrams"


class AnonymousBudget:
    """One for a tower. `now`: monotonic seconds. `trusted_proxies`: addresses and networks, with commas between."""

    def __init__(self, *, now: float, trusted_proxies: str = "", limits: AnonymousLimits = LIMITS) -> None:
        self.limits = limits
        self.known = KnownAddresses(secrets.token_bytes(32), limits.max_known_addresses)
        self.connections = ConnectionBudget(limits, self.known)
        self.refused: Counter[Over] = Counter(dict.fromkeys(Over, 0))
        self.log = LogBudget(limits.log_lines_per_s, limits.log_lines_burst, now)
        self.junk = TokenBucket(limits.junk_datagrams_per_s, limits.junk_datagrams_per_s, now)
        self.handshakes: Counter[str] = Counter()
        """In progress, by address."""
        self.waiting: dict[str, int] = {"reading": 0, "requests": 0, "hashes": 0}
        """How many wait for their turn; kept current by the adapters."""
        self._proxies = [ipaddress.ip_network(one.strip()) for one in trusted_proxies.split(",") if one.strip()]

    def is_proxy(self, address: str) -> bool:
        """Whether connections from there may name their client."""
        try:
            ip = ipaddress.ip_address(address)
        except ValueError:
            return False
        return any(ip in one for one in self._proxies)

    def may_log(self, now: float) -> bool:
        """Whether a stranger may cause one more log line."""
        if self.log.admits(now):
            return True
        self.refused[Over.LOG_LINES] += 1
        return False

    def standing(self, origin: Origin) -> Priority:
        """Priority of a request from there."""
        return Priority.KNOWN if self.known.knows(origin) else Priority.FRESH

    def begin_handshake(self, origin: Origin, *, is_known: bool) -> bool:
        """One more WebSocket that has not signed in. False: there are too many."""
        limits = self.limits
        factor = limits.known_address_factor if is_known else 1
        many = self.handshakes.total() >= limits.max_handshakes * factor
        if many or self.handshakes[origin.address] >= limits.max_handshakes_per_address * factor:
            self.refused[Over.HANDSHAKES] += 1
            return False
        self.handshakes[origin.address] += 1
        return True

    def end_handshake(self, origin: Origin) -> None:
        """It has signed in, or ended."""
        self.handshakes[origin.address] -= 1
        if self.handshakes[origin.address] <= 0:
            del self.handshakes[origin.address]


class AnonymousRequest:
    """One request or WebSocket, from its beginning until it has signed in or ended."""

    def __init__(
        self,
        budget: AnonymousBudget,
        origin: Origin,
        anonymous: AnonymousConnection | None,
        *,
        is_handshake: bool,
        on_admitted: Callable[[], None] = lambda: None,
    ) -> None:
        """`on_admitted`: tells a WebSocket that it has signed in."""
        self._budget = budget
        self._on_admitted = on_admitted
        self._origin = origin
        self._anonymous = anonymous
        """None where the connection carries requests of others too, as a proxy's does."""
        self._is_handshake = is_handshake

    def admit(self) -> None:
        """It has signed in; and so has its connection, unless that is a proxy's."""
        if self._anonymous is not None and not self._anonymous.is_admitted:
            self._budget.connections.admit(self._anonymous)
        self._budget.known.remember(self._origin)
        self._on_admitted()
        self.end()

    def end(self) -> None:
        """A second time is harmless."""
        if self._is_handshake:
            self._is_handshake = False
            self._budget.end_handshake(self._origin)


def origin_of_anonymous(address: str, port: int, *, is_proxy: bool) -> Origin:
    """A proxy's connections take turns with each other: their clients are not known yet."""
    return Origin(f"{address}:{port}", f"{address}:{port}") if is_proxy else origin_of(address)
