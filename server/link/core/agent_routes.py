"""The addresses of an agent. No I/O; takes `now`.

An address is accepted for two reasons only: the newest authentic datagram came from it (roaming), or an authentic ping
named it as one of the agent's uplinks. wire.sealed_link has checked both before.
"""

from collections import deque
from typing import Final

Address = tuple[str, int]

OVER_CHANNEL: Final[Address] = ("", 0)
"""Stands for the WebSocket of the control channel, where UDP is blocked."""

UPLINK_SILENT_S: Final = 2.0
"""An uplink that has been silent for this long is gone: four of its pings in a row are missing."""

MAX_UPLINKS: Final = 4
"""Bounds what one agent can make the tower send."""

MAX_REMEMBERED: Final = 16


class AgentRoutes:
    """One for each link."""

    def __init__(self) -> None:
        self.newest: Address | None = None
        """Where the newest authentic datagram came from; None until the first one."""
        self.targets: tuple[Address, ...] = ()
        """Where a datagram is to be sent: once to each. Nowhere before anything came."""
        self._uplinks: dict[int, tuple[Address, float]] = {}
        self._were_uplinks: deque[Address] = deque(maxlen=MAX_REMEMBERED)

    def follow(self, address: Address) -> None:
        """The newest datagram came from here."""
        if address != self.newest:
            self.newest = address
            self._aim()

    def uplink(self, number: int, address: Address, now: float) -> None:
        """An uplink reports its address."""
        if number in self._uplinks or len(self._uplinks) < MAX_UPLINKS:
            self._uplinks[number] = (address, now)
            if address not in self._were_uplinks:
                self._were_uplinks.append(address)
            self._aim()

    def may_be_copy(self, address: Address) -> bool:
        """Whether a datagram from there that was seen before is a copy that went another way, and not a replay: from
        one of several uplinks, or where UDP and the control channel are both in use."""
        if OVER_CHANNEL in (address, self.newest):
            return True
        return len(self._were_uplinks) > 1 and address in self._were_uplinks

    @property
    def count(self) -> int:
        """By how many ways the agent comes, 1 or more."""
        return max(1, len(self._uplinks))

    def forget_silent(self, now: float) -> None:
        """Time has passed."""
        silent = [number for number, (_, heard_at) in self._uplinks.items() if now - heard_at > UPLINK_SILENT_S]
        for number in silent:
            del self._uplinks[number]
        if silent:
            self._aim()

    def _aim(self) -> None:
        newest = self.newest
        if newest is None or newest == OVER_CHANNEL:
            self.targets = () if newest is None else (newest,)
        else:
            self.targets = tuple({newest: None} | {address: None for address, _ in self._uplinks.values()})
