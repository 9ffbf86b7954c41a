"""Free ports for programs that must know a port before they open it.

A port that is free now must stay so until its program opens it. So each worker of a run has ports of its own, which the
others do not even try, and gives none of them twice.
"""

import os
import random
import socket
from pathlib import Path
from typing import Final

LOWEST: Final = 15_000
ANYBODYS: Final = Path("/proc/sys/net/ipv4/ip_local_port_range")
"""The Linux range of ephemeral ports."""

MAX_WORKERS: Final = 16

_random: Final = random.SystemRandom()
_given: Final[set[int]] = set()


def free_udp_ports(count: int) -> list[int]:
    """Returns ports that are free now and outside the ephemeral range, so that the kernel does not assign them."""
    return _free(socket.SOCK_DGRAM, count)


def free_tcp_port() -> int:
    """Returns a free TCP port, as `free_udp_ports` does for UDP."""
    return _free(socket.SOCK_STREAM, 1)[0]


def _free(kind: socket.SocketKind, count: int) -> list[int]:
    lowest_of_anybody = int(ANYBODYS.read_text().split()[0]) if ANYBODYS.exists() else 32_768
    worker = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw")) % MAX_WORKERS
    ours = range(LOWEST + worker, max(lowest_of_anybody, LOWEST + 1_000), MAX_WORKERS)
    if len(_given) > len(ours) // 2:
        _given.clear()  # the first ones are long free again
    found: list[int] = []
    while len(found) < count:
        port = _random.choice(ours)
        if port in _given:
            continue
        with socket.socket(socket.AF_INET, kind) as probe:
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                continue
        _given.add(port)
        found.append(port)
    return found
