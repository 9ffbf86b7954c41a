"""When a link needs another control channel, and when it ends with the one that it had. No I/O; takes `now`.

The control channel is one TCP connection and goes by one uplink; the datagrams go by all. So a control channel that is
lost, or whose uplink is silent while another is not, need not be the end of the link: the agent opens another one and
proves that the link is its (wire.resuming).

    control channel   datagrams                           what
    ended             come over UDP                       look for another, for SEEK_S at most
    ended             none for SILENT_S, or not by UDP    the link ends
    ended by wish                                         the link ends
    there             come, but not by its uplink         look for another, the old one goes on meanwhile
"""

from enum import Enum
from typing import Final

from onboard_agent.link.backoff import Backoff

SEEK_S: Final = 10.0
"""As long as the tower keeps a link without a control channel (server.live.relay.orphans)."""

SILENT_S: Final = 1.5
"""The tower's datagrams are missing: three keep-alives in a row, and the answers to as many."""

FIRST_CHECK_AFTER_S: Final = 2.0
"""A control channel that was opened just now is not given up for another one. One that has ended is."""

BROKEN_OFF: Final = (None, 1005, 1006, 1011)
"""Close codes of unintended ends; a side that got no answer to its pings sends 1011."""


class Need(Enum):
    """What the link needs now."""

    NOTHING = "nothing"
    ANOTHER = "another control channel"
    END = "end"


class Succession:
    """One for each control channel of a link."""

    def __init__(self, backoff: Backoff, now: float) -> None:
        self._backoff = backoff
        self._next_try = now + FIRST_CHECK_AFTER_S
        self._ended_at: float | None = None
        self._intended = False

    def ended(self, code: int | None, now: float) -> None:
        """The control channel has ended, with this code; None: none came."""
        self._ended_at = now
        self._next_try = now
        self._intended = code not in BROKEN_OFF

    def failed(self, now: float) -> None:
        """An attempt to open another one came to nothing."""
        self._next_try = now + self._backoff.next_delay_s()

    def need(self, *, silent_s: float, over_udp: bool, uplink_silent: bool, now: float) -> Need:
        """`silent_s`: since the tower was last heard. `uplink_silent`: the control channel's uplink is silent, another
        one is not."""
        if self._ended_at is None:
            return Need.ANOTHER if uplink_silent and now >= self._next_try else Need.NOTHING
        if self._intended or not over_udp or silent_s > SILENT_S or now - self._ended_at > SEEK_S:
            return Need.END
        return Need.ANOTHER if now >= self._next_try else Need.NOTHING
