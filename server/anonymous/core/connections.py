"""How many connections that have not signed in there may be: of one address, of one network, of all. Pure."""

from __future__ import annotations

from collections import Counter, OrderedDict
from collections.abc import Callable
from dataclasses import dataclass

from server.anonymous.core.known_addresses import KnownAddresses
from server.anonymous.core.limits import AnonymousLimits
from server.anonymous.core.networks import Origin


def _nothing() -> None:
    pass


@dataclass(eq=False, slots=True)
class AnonymousConnection:
    """One connection, from its acceptance until it has signed in or ended."""

    origin: Origin
    is_known: bool
    is_proxy: bool
    """A trusted proxy's: it speaks for many, and is counted by request instead."""
    cut: Callable[[], None]
    is_admitted: bool = False
    """It has signed in: nothing of the table holds for it any more."""
    is_counted: bool = True
    on_admitted: Callable[[], None] = _nothing


class ConnectionBudget:
    """Call `come` for each accepted connection, `gone` at its end, `admit` after its sign-in."""

    def __init__(self, limits: AnonymousLimits, known: KnownAddresses) -> None:
        self._limits = limits
        self._known = known
        self._of_address: Counter[str] = Counter()
        self._of_network: dict[str, OrderedDict[AnonymousConnection, None]] = {}
        self._strangers = 0

    def __len__(self) -> int:
        return sum(self._of_address.values())

    def come(self, origin: Origin, *, is_proxy: bool, cut: Callable[[], None]) -> AnonymousConnection | None:
        """A new connection, or None where it must be closed. `cut` closes it when another one needs its place."""
        limits = self._limits
        if is_proxy:
            return AnonymousConnection(origin, is_known=True, is_proxy=True, cut=cut, is_counted=False)
        is_known = self._known.knows(origin)
        factor = limits.known_address_factor if is_known else 1
        if self._of_address[origin.address] >= limits.max_connections_per_address * factor:
            return None
        of_network = self._of_network.get(origin.network)
        if not is_known and of_network is not None and len(of_network) >= limits.max_connections_per_network:
            return None
        if not is_known and self._strangers >= limits.max_connections and not self._make_space(origin):
            return None
        anonymous = AnonymousConnection(origin, is_known=is_known, is_proxy=False, cut=cut)
        self._of_address[origin.address] += 1
        if not is_known:
            self._strangers += 1
            self._of_network.setdefault(origin.network, OrderedDict())[anonymous] = None
        return anonymous

    def admit(self, anonymous: AnonymousConnection) -> None:
        """It has signed in."""
        on_admitted = anonymous.on_admitted
        self.gone(anonymous)
        anonymous.is_admitted = True
        on_admitted()

    def gone(self, anonymous: AnonymousConnection) -> None:
        """It has ended. Harmless for one that was admitted, and a second time."""
        if not anonymous.is_counted:
            return
        anonymous.is_counted = False
        anonymous.cut = anonymous.on_admitted = _nothing
        address = anonymous.origin.address
        self._of_address[address] -= 1
        if not self._of_address[address]:
            del self._of_address[address]
        if not anonymous.is_known:
            self._strangers -= 1
            of_network = self._of_network[anonymous.origin.network]
            del of_network[anonymous]
            if not of_network:
                del self._of_network[anonymous.origin.network]

    def _make_space(self, origin: Origin) -> bool:
        """Ends the oldest connection of the network that has most, unless that is the newcomer's own."""
        most = max(self._of_network, key=lambda network: len(self._of_network[network]))
        mine = self._of_network.get(origin.network, ())
        if len(self._of_network[most]) <= len(mine) + 1:
            return False
        oldest = next(iter(self._of_network[most]))
        cut = oldest.cut
        self.gone(oldest)
        cut()
        return True
