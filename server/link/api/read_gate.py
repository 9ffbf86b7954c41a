"""Watches a socket until it is readable, then fires once and waits for the next call of `watch`.

An event loop needs about ten system calls to start and stop watching, many times a second with rounds (`read_pacer`).
Linux can do it with one: an epoll inside the loop's, which disarms itself when it has fired.
"""

import asyncio
import contextlib
import select
import socket
from collections.abc import Callable


class ReadGate:
    """Calls `ready` once, when the socket is readable. Call `watch` again afterwards, and `close` before the socket
    closes."""

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
        """Calls `ready` again when the socket is readable, or is so already."""
        if self._epoll is None:
            self._loop.add_reader(self._watched, self._fired)
        else:
            self._epoll.modify(self._watched, select.EPOLLIN | select.EPOLLONESHOT)

    def close(self) -> None:
        """Stops all calls."""
        if self._epoll is None:
            self._loop.remove_reader(self._watched)
        else:
            self._loop.remove_reader(self._epoll)
            with contextlib.suppress(OSError):
                self._epoll.close()
