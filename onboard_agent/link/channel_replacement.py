"""Decides when a link needs another control channel, and when it ends. No I/O; takes `now`.

The control channel is one TCP connection over one uplink; datagrams use all uplinks. So the link can continue if the
control channel is lost, or if its uplink is silent while another is not: the agent opens another control channel and
proves that the link is its own (wire.resuming).

    control channel   datagrams                            result
    ended             arrive over UDP                      open another one, for SEEK_S at most
    ended             none for SILENT_S, or not over UDP   the link ends
    ended             none for WITH_OTHERS_S, and there    the link ends
                      are other towers
    closed on purpose                                      the link ends
    open              arrive, but not over its uplink      open another one; the old one stays in use meanwhile
"""

from enum import Enum
from typing import Final

from onboard_agent.link.backoff import Backoff

SEEK_S: Final = 10.0
"""The tower keeps a link without a control channel for the same time (server.control.core.orphans)."""

SILENT_S: Final = 1.5
"""Silence of the tower: three keep-alives in a row, and the responses to as many, are missing."""

WITH_OTHERS_S: Final = 0.75
"""Where another tower can take the drone, one missing keep-alive suffices: the control channel has ended as well."""

FIRST_CHECK_AFTER_S: Final = 2.0
"""A control channel that was just opened is not replaced, unless it has ended."""

BROKEN_OFF: Final = (None, 1005, 1006, 1011)
"""Codes of a connection that neither side closed on purpose. A side sends 1011 when its pings got no response."""


class Need(Enum):
    """What the link needs now."""

    NOTHING = "nothing"
    ANOTHER = "another control channel"
    END = "end"


class ChannelReplacement:
    """One for each control channel of a link."""

    def __init__(self, backoff: Backoff, now: float) -> None:
        self._backoff = backoff
        self._next_try = now + FIRST_CHECK_AFTER_S
        self._ended_at: float | None = None
        self._intended = False

    def ended(self, code: int | None, now: float) -> None:
        """The control channel has ended with this code; None if it had none."""
        self._ended_at = now
        self._next_try = now
        self._intended = code not in BROKEN_OFF

    def failed(self, now: float) -> None:
        """An attempt to open another control channel has failed."""
        self._next_try = now + self._backoff.next_delay_s()

    def need(self, *, silent_s: float, over_udp: bool, uplink_silent: bool, now: float, others: bool = False) -> Need:
        """`silent_s`: time since the last datagram. `uplink_silent`: the channel's uplink is silent, another is not.
        `others`: there are other towers."""
        if self._ended_at is None:
            return Need.ANOTHER if uplink_silent and now >= self._next_try else Need.NOTHING
        if (
            self._intended
            or not over_udp
            or silent_s > (WITH_OTHERS_S if others else SILENT_S)
            or now - self._ended_at > SEEK_S
        ):
            return Need.END
        return Need.ANOTHER if now >= self._next_try else Need.NOTHING
