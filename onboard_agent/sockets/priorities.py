"""Which of the agent's packets go first where they wait for one another. A thin shell over socket options.

What the network in between does with the marks is its own affair; the queue of this machine's own interface, and Wi-Fi,
heed them. An option that the kernel does not take is left.
"""

import contextlib
import socket
from typing import Final

EXPEDITED: Final = 46 << 2
"""DSCP EF (RFC 3246) in the header byte: few packets, none of which may wait."""

_INTERACTIVE: Final = 6
_BULK: Final = 2
"""SO_PRIORITY: pfifo_fast and prio serve the first before everything else, and the other after it."""


def goes_first(opened: socket.socket) -> None:
    """Sticks, telemetry, holds."""
    with contextlib.suppress(OSError):
        if opened.family == socket.AF_INET6:
            opened.setsockopt(socket.IPPROTO_IPV6, socket.IPV6_TCLASS, EXPEDITED)
        else:
            opened.setsockopt(socket.IPPROTO_IP, socket.IP_TOS, EXPEDITED)
    with contextlib.suppress(OSError):  # after the mark, which sets it too
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_PRIORITY, _INTERACTIVE)


def waits_for_others(opened: socket.socket) -> None:
    """Pictures. No mark: what there is below best effort, a cell or an access point may starve for good."""
    with contextlib.suppress(OSError):
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_PRIORITY, _BULK)
