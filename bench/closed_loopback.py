"""Runs one program in a network namespace with only loopback, and passes sockets of that namespace out.

There only the starter, which has the sockets, reaches a program that listens on every address of its host.
`bench.real_autopilot` starts it as `python -m bench.closed_loopback FD COMMAND...`: each `{port0}`, `{port1}` in the
command becomes the port of a UDP socket that is sent over the Unix socket FD; `{free}` is an unused port for the
program to listen on. The text of the message, sent first, contains it. Then the command replaces this process.

For a program with fixed ports (PX4), `FD:14540,14550,0` binds the sockets to those, 0 for any.
"""

from __future__ import annotations

import ctypes
import fcntl
import os
import signal
import socket
import struct
import sys
from typing import Final

SOCKETS: Final = 3
"""Two that the program sends to, and one that sends to the program."""
REFUSED: Final = b"refused "

_CLONE_NEWNET: Final = 0x40000000
_CLONE_NEWUSER: Final = 0x10000000
_PR_SET_PDEATHSIG: Final = 1
_SIOCSIFFLAGS: Final = 0x8914
_IFF_UP: Final = 0x1


def main(words: list[str]) -> None:
    """Does not return. If no network namespace can be created, sends the reason as a text that begins with REFUSED."""
    descriptor, _, fixed = words[0].partition(":")
    starter = socket.socket(fileno=int(descriptor))
    try:
        _enter_network_of_our_own()
        _raise_loopback()
    except OSError as error:
        starter.send(REFUSED + str(error).encode())
        sys.exit(1)
    wanted = [int(port) for port in fixed.split(",")] if fixed else [0] * SOCKETS
    sockets = [_bound(port) for port in wanted]
    with _bound() as probe:
        free = probe.getsockname()[1]
    socket.send_fds(starter, [str(free).encode()], [one.fileno() for one in sockets])
    starter.close()
    ports = {f"port{number}": one.getsockname()[1] for number, one in enumerate(sockets)}
    command = [word.format(**ports, free=free) for word in words[1:]]
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)  # the simulator ends if its starter is killed
    os.execv(command[0], command)


def _enter_network_of_our_own() -> None:
    """Raises OSError if the kernel does not permit it."""
    flags = _CLONE_NEWNET if os.geteuid() == 0 else _CLONE_NEWUSER | _CLONE_NEWNET
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.unshare(flags) != 0:
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number))


def _raise_loopback() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sock:
        fcntl.ioctl(sock, _SIOCSIFFLAGS, struct.pack("16sh22x", b"lo", _IFF_UP))


def _bound(port: int = 0) -> socket.socket:
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    sock.bind(("127.0.0.1", port))
    return sock


if __name__ == "__main__":
    main(sys.argv[1:])
