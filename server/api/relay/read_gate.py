"""Watches a socket until it can be read, once; then waits to be armed again.

Arming and disarming an event loop's watch takes some ten system calls, many times a second while rounds rest
(`read_rhythm`). Linux can do it with one: an epoll inside the loop's, which disarms itself when it fires.
"""

import asyncio
import contextlib
import select
import socket
from collections.abc import Callable


class ReadGate:
    """Calls `ready` once, when the socket has something. `watch` again afterwards; `close` before the socket is."""

    def __init__(self, watched: socket.socket, ready: Callable[[], None]) -> None:
        self._loop = asyncio.get_running_loop()
        self._watched = watched
        self._ready = ready
        self._epoll: select.epoll | None = None
        if hasattr(select, "epoll"):
            self._epoll = select.epoll()
            self._epoll.register(watched, select.EPOLLIN | select.EPOLLONESHOT)
            self._loop.add_reader(self._epoll, self._fired)
        else:
            self._loop.add_reader(watched, self._fired)

    def _fired(self) -> None:
        if self._epoll is None:
            self._loop.remove_reader(self._watched)
        elif not self._epoll.poll(0, 1):
            return
        self._ready()

    def watch(self) -> None:
        """`ready` is called again when there is something, or is so already."""
        if self._epoll is None:
            self._loop.add_reader(self._watched, self._fired)
        else:
            self._epoll.modify(self._watched, select.EPOLLIN | select.EPOLLONESHOT)

    def close(self) -> None:
        """Never calls again."""
        if self._epoll is None:
            self._loop.remove_reader(self._watched)
        else:
            self._loop.remove_reader(self._epoll)
            with contextlib.suppress(OSError):
                self._epoll.close()
