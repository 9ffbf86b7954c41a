"""Free ports for programs that must know a port before they open it."""

import random
import socket
from pathlib import Path
from typing import Final

LOWEST: Final = 15_000
ANYBODYS: Final = Path("/proc/sys/net/ipv4/ip_local_port_range")
"""The Linux range of ephemeral ports."""

_random: Final = random.SystemRandom()


def free_udp_ports(count: int) -> list[int]:
    """Returns ports that are free now and outside the ephemeral range, so that the kernel does not assign them."""
    return _free(socket.SOCK_DGRAM, count)


def free_tcp_port() -> int:
    """Returns a free TCP port, as `free_udp_ports` does for UDP."""
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
