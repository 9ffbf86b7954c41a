"""Ports for programs that have to be told one before they open it."""

import random
import socket
from pathlib import Path
from typing import Final

LOWEST: Final = 15_000
ANYBODYS: Final = Path("/proc/sys/net/ipv4/ip_local_port_range")
"""Of Linux: the range from which the kernel gives a port to whoever asks for any."""

_random: Final = random.SystemRandom()


def free_udp_ports(count: int) -> list[int]:
    """Nobody has them now, and nobody who asks for any port gets one of them in the moment before they are taken."""
    return _free(socket.SOCK_DGRAM, count)


def free_tcp_port() -> int:
    """The same for TCP."""
    return _free(socket.SOCK_STREAM, 1)[0]


def _free(kind: socket.SocketKind, count: int) -> list[int]:
    lowest_of_anybody = int(ANYBODYS.read_text().split()[0]) if ANYBODYS.exists() else 32_768
    found: list[int] = []
    while len(found) < count:
        port = _random.randrange(LOWEST, max(lowest_of_anybody, LOWEST + 1_000))
        with socket.socket(socket.AF_INET, kind) as probe:
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                continue
        if port not in found:
            found.append(port)
    return found
