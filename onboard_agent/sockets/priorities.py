"""Priorities of the agent's packets in queues. A thin shell over socket options.

Networks on the path may ignore the marks; the queue of this machine's own interface and Wi-Fi obey them. An option that
the kernel refuses is skipped.
"""

import contextlib
import socket
from typing import Final

EXPEDITED: Final = 46 << 2
"""DSCP EF (RFC 3246) as the header byte: for few packets, none of which may wait."""

_INTERACTIVE: Final = 6
_BULK: Final = 2
"""SO_PRIORITY: pfifo_fast and prio serve _INTERACTIVE before everything else, and _BULK after it."""


def goes_first(opened: socket.socket) -> None:
    """Gives a socket for sticks, telemetry and holds the highest priority."""
    with contextlib.suppress(OSError):
        if opened.family == socket.AF_INET6:
            opened.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_TCLASS, EXPEDITED)
        else:
            opened.setsockopt(socket.IPPROTO_IP, socket.IP_TOS, EXPEDITED)
    with contextlib.suppress(OSError):  # after the mark, which sets it too
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_PRIORITY, _INTERACTIVE)


def waits_for_others(opened: socket.socket) -> None:
    """Gives a socket for pictures low priority. Sets no mark: a cell or an access point may starve packets below best
    effort permanently."""
    with contextlib.suppress(OSError):
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_PRIORITY, _BULK)
