"""Runs one program in a network of its own that has nothing but loopback, and hands sockets of that network out.

A program that listens on every address of its host is there heard by nobody but its starter, who holds the sockets.
Started by `bench.real_autopilot` as `python -m bench.closed_loopback FD COMMAND...`: each `{port0}`, `{port1}` of the
command becomes the port of a UDP socket that goes out over the Unix socket FD; `{free}` is a port that nobody has, for
the program to listen on. It is told first, in the message's text. Then the command takes this process's place.

A program whose ports are fixed (PX4) is met there: `FD:14540,14550,0` binds the sockets at those, 0 for any.
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
    """Does not return. What keeps a network of its own from being made goes out as a text that begins with REFUSED."""
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
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)  # nothing flies on whose starter was killed
    os.execv(command[0], command)


def _enter_network_of_our_own() -> None:
    """Raises OSError where the kernel does not allow it."""
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
