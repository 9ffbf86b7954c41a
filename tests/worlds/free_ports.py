"""Free ports for programs that must know a port before they open it.

A port that is free now must stay so until its program opens it. So whoever takes a port from here holds its name, and
no other test process of this machine gets it meanwhile, of this run or another.
"""

import os
import random
import socket
from collections import deque
from pathlib import Path
from typing import Final

LOWEST: Final = 15_000
ANYBODYS: Final = Path("/proc/sys/net/ipv4/ip_local_port_range")
"""The Linux range of ephemeral ports."""
HELD: Final = 200
"""Ports whose programs have not opened them yet, at most."""

_random: Final = random.SystemRandom()
_names: Final[deque[int]] = deque()
"""File descriptors of the sockets that hold the names."""


def free_udp_ports(count: int) -> list[int]:
    """Returns ports that are free now and outside the ephemeral range, so that the kernel does not assign them."""
    return [_free(socket.SOCK_DGRAM) for _ in range(count)]


def free_tcp_port() -> int:
    """Returns a free TCP port, as `free_udp_ports` does for UDP."""
    return _free(socket.SOCK_STREAM)


def _free(kind: socket.SocketKind) -> int:
    lowest_of_anybody = int(ANYBODYS.read_text().split()[0]) if ANYBODYS.exists() else 32_768
    while True:
        port = _random.randrange(LOWEST, max(lowest_of_anybody, LOWEST + 1_000))
        name = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        try:
            # An abstract name: the kernel lets go of it with its process, however that ends.
            name.bind(f"\0control-tower-test-port-{port}")
            with socket.socket(socket.AF_INET, kind) as probe:
                probe.bind(("127.0.0.1", port))
        except OSError:
            name.close()
            continue
        _names.append(name.detach())
        while len(_names) > HELD:
            os.close(_names.popleft())
        return port
