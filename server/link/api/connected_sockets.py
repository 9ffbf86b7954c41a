"""Separate sockets for peers whose datagrams must not wait for others, on the port that all peers use.

Only the kernel knows the sender of a datagram before it is read. A UDP socket that is bound to the same port and
connected to one address receives that peer's datagrams; the shared socket receives the rest. So a drone that is flown
by hand wakes the process at once, while the others are read in rounds.

SO_REUSEPORT is set only while such a socket is opened: no other process can take over the port, and a second tower
still learns that it is in use. Datagrams of other peers that arrive there meanwhile are read like all others.
"""

import asyncio
import contextlib
import socket
from collections.abc import Callable, Set
from typing import Final

import structlog

_log = structlog.get_logger(__name__)

Address = tuple[str, int]
_REUSE: Final[int | None] = getattr(socket, "SO_REUSEPORT", None)


class ConnectedSockets:
    """Calls `ready` with a readable socket, which `ready` must read. Call `close` before the shared socket is
    closed."""

    def __init__(self, shared: socket.socket, ready: Callable[[socket.socket], None]) -> None:
        self._loop = asyncio.get_running_loop()
        self._shared = shared
        self._ready = ready
        self._sockets: dict[Address, socket.socket] = {}
        self._failed: set[Address] = set()

    def follow(self, wanted: Set[Address]) -> bool:
        """Opens sockets for these peers and closes all others. False: some peers have none, and use the shared
        socket."""
        for address in self._sockets.keys() - wanted:
            self._close(address)
        self._failed &= wanted
        for address in wanted - self._sockets.keys() - self._failed:
            try:
                self._sockets[address] = self._open(address)
            except OSError as error:
                self._failed.add(address)
                _log.warning("no_connected_socket", port=address[1], reason=str(error))
        return not self._failed

    def _open(self, address: Address) -> socket.socket:
        if _REUSE is None:
            raise OSError("this system has no SO_REUSEPORT")
        shared = self._shared
        opened = socket.socket(shared.family, shared.type)
        try:
            opened.setblocking(False)
            for one in (shared, opened):
                one.setsockopt(socket.SOL_SOCKET, _REUSE, 1)
            try:
                opened.bind(shared.getsockname())
                opened.connect(address)
            finally:
                for one in (shared, opened):
                    one.setsockopt(socket.SOL_SOCKET, _REUSE, 0)
            self._loop.add_reader(opened, self._ready, opened)
        except OSError:
            opened.close()
            raise
        return opened

    def _close(self, address: Address) -> None:
        closed = self._sockets.pop(address)
        self._loop.remove_reader(closed)
        with contextlib.suppress(OSError):
            self._ready(closed)  # datagrams received until now
        closed.close()

    def __len__(self) -> int:
        return len(self._sockets)

    def close(self) -> None:
        """Closes all of them."""
        for address in list(self._sockets):
            self._close(address)
