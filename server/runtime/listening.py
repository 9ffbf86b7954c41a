"""Opens the tower's TCP port, with actionable errors."""

from __future__ import annotations

import errno
import socket
from typing import Final

UNSENT_BYTES: Final = 16 * 1024
"""Bytes that the kernel may buffer for a connection beyond those in flight. More would become stale where nothing can
discard it; connections inherit it from the listening socket."""


class CannotListen(Exception):
    """A port is not available. The message names it, and the variable that chooses another."""

    def __init__(self, variable: str, host: str, port: int, error: OSError) -> None:
        number = _errno(error)
        if number == errno.EADDRINUSE:
            words = f"port {port} on {host} is in use: set {variable} to another one"
        elif number == errno.EACCES:
            words = f"port {port} on {host} needs privileges: set {variable} to one above 1023"
        else:
            words = f"cannot listen on {host} port {port} ({variable}): {error.strerror or error}"
        super().__init__(words)


def _errno(error: BaseException | None) -> int | None:
    """Event loops often wrap the system's error in one without an errno."""
    while error is not None:
        if isinstance(error, OSError) and error.errno is not None:
            return error.errno
        error = error.__cause__ or error.__context__
    return None


def listen(host: str, port: int) -> socket.socket:
    """Returns a listening TCP socket; port 0 lets the kernel choose. Raises CannotListen."""
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        opened = socket.socket(family, kind, protocol)
        try:
            opened.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            opened.setsockopt(socket.IPPROTO_TCP, socket.TCP_NOTSENT_LOWAT, UNSENT_BYTES)
            opened.bind(address)
            opened.listen(1024)
        except OSError:
            opened.close()
            raise
    except OSError as error:
        raise CannotListen("TOWER_PORT", host, port, error) from error
    return opened


def address_in_words(opened: socket.socket) -> str:
    """The URL for a listening socket, as people type it."""
    host, port = opened.getsockname()[:2]
    if host in {"0.0.0.0", "::"}:  # noqa: S104 - recognised here, not bound
        host = "localhost"
    return f"http://[{host}]:{port}" if ":" in host else f"http://{host}:{port}"
