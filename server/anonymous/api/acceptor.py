"""Accepts connections from the listening socket in small batches, so that frames need not wait for them.

An event loop's own server accepts all pending connections at once: a thousand of them cost a tenth of a second. This
one closes connections that exceed the budget before it creates anything for them.
"""

from __future__ import annotations

import asyncio
import contextlib
import errno
import socket
import struct
import time
from collections.abc import Callable
from functools import partial
from typing import Any, Final

from server.anonymous.core.budget import AnonymousBudget, Over, origin_of_anonymous
from server.anonymous.core.connections import AnonymousConnection
from server.anonymous.core.slices import Slices

NO_MORE_FILES_REST_S: Final = 0.1
"""Pause when the process may open no more files: pending connections stay in the kernel until some are closed."""
OPENING_COST: Final = 2.5
"""What a connection costs in all, as a multiple of accepting it: transport and protocol are made in later turns of the
loop (measured: 37 us, then 58)."""
_RESET: Final = struct.pack("ii", 1, 0)
"""SO_LINGER: closes at once, so that the peer's connections do not stay in the kernel's tables."""


class Acceptor:
    """Accepts connections of one listening socket. `make` returns the protocol of a connection."""

    def __init__(
        self,
        listener: socket.socket,
        budget: AnonymousBudget,
        make: Callable[[AnonymousConnection], asyncio.BaseProtocol],
    ) -> None:
        limits = budget.limits
        self._loop = asyncio.get_running_loop()
        self._listener = listener
        self._budget = budget
        self._make = make
        self._slices = Slices(limits.accept_slice_s, limits.accept_rest_s)
        self._timer: asyncio.TimerHandle | None = None
        self._opening: set[asyncio.Task[Any]] = set()
        listener.setblocking(False)
        self._loop.add_reader(listener, self._ready)

    def close(self) -> None:
        """Stops accepting connections, and drops those that are not set up yet. Calling it twice is harmless."""
        for opening in self._opening:
            opening.cancel()
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if self._listener.fileno() >= 0:
            self._loop.remove_reader(self._listener)

    def _ready(self) -> None:
        while (wait_s := self._slices.wait_s(time.monotonic())) <= 0:
            began = time.perf_counter()
            try:
                opened, address = self._listener.accept()
            except OSError as error:
                if error.errno in (errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM):
                    self._rest(NO_MORE_FILES_REST_S)
                return  # no connection is pending, or it closed while pending
            is_opening = self._came(opened, address)
            self._slices.used((time.perf_counter() - began) * (OPENING_COST if is_opening else 1.0))
        self._rest(wait_s)

    def _rest(self, wait_s: float) -> None:
        self._loop.remove_reader(self._listener)
        self._timer = self._loop.call_later(wait_s, self._rested)

    def _rested(self) -> None:
        self._timer = None
        self._loop.add_reader(self._listener, self._ready)

    def _came(self, opened: socket.socket, address: tuple[Any, ...]) -> bool:
        """Returns whether the connection is opened. Otherwise it is closed."""
        host = str(address[0])
        is_proxy = self._budget.is_proxy(host)
        origin = origin_of_anonymous(host, int(address[1]), is_proxy=is_proxy)
        anonymous = self._budget.connections.come(origin, is_proxy=is_proxy, cut=_nothing)
        if anonymous is None:
            self._budget.refused[Over.CONNECTIONS] += 1
            with contextlib.suppress(OSError):
                opened.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _RESET)
            opened.close()
            return False
        opened.setblocking(False)
        with contextlib.suppress(OSError):
            opened.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        if not is_proxy:
            limits = self._budget.limits
            anonymous.on_admitted = partial(_set_receive_buffer, opened, limits.admitted_receive_buffer_bytes)
            _set_receive_buffer(opened, limits.receive_buffer_bytes)
        opening = self._loop.create_task(self._loop.connect_accepted_socket(lambda: self._make(anonymous), opened))
        self._opening.add(opening)
        opening.add_done_callback(partial(self._opened, opened, anonymous))
        return True

    def _opened(self, opened: socket.socket, anonymous: AnonymousConnection, opening: asyncio.Task[Any]) -> None:
        self._opening.discard(opening)
        if opening.cancelled() or opening.exception() is not None:  # it closed before it was set up, or the tower did
            self._budget.connections.gone(anonymous)
            opened.close()


def _nothing() -> None:
    pass


def _set_receive_buffer(opened: socket.socket, size_bytes: int) -> None:
    with contextlib.suppress(OSError):  # it closed meanwhile
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, size_bytes)
