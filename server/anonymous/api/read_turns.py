"""Parses the bytes of connections that have not signed in, in slices of time and in fair turns between networks.

An event loop delivers the bytes of all ready connections before anything else: a thousand request heads that arrive at
once would all be parsed before the next frame. A connection that waits here is not read meanwhile.
"""

from __future__ import annotations

import asyncio
import time
from typing import Protocol

from server.anonymous.core.budget import AnonymousBudget, Over
from server.anonymous.core.connections import AnonymousConnection
from server.anonymous.core.fair_queue import Bounds, FairQueue, Priority
from server.anonymous.core.slices import Slices

_AS_MANY_AS_CONNECTIONS = Bounds(per_address=1_000_000, per_network=1_000_000, total=1_000_000)


class AnonymousReader(Protocol):
    """A connection that has not signed in."""

    anonymous: AnonymousConnection | None
    unread: bytes
    """Received bytes that wait for their turn."""

    def hold_reading(self) -> None:
        """Stops reading from the connection."""

    def take_turn(self) -> None:
        """Parses the first bytes of `unread`, and resumes reading or asks for another turn (`ReadTurns.later`)."""

    def cut(self) -> None:
        """Ends the connection without a message."""


class ReadTurns:
    """One instance per tower."""

    def __init__(self, budget: AnonymousBudget) -> None:
        limits = budget.limits
        self._budget = budget
        self._line = FairQueue[AnonymousReader](_AS_MANY_AS_CONNECTIONS)
        self._slices = Slices(limits.read_slice_s, limits.read_rest_s)
        self._unread = 0
        self._timer: asyncio.TimerHandle | None = None

    def came(self, reader: AnonymousReader, data: bytes) -> None:
        """Passes `data` to this connection now if no connection waits, otherwise when its turn comes."""
        if reader.unread:  # already queued
            self._keep(reader, data)
        elif self._timer is None and self._slices.wait_s(time.monotonic()) <= 0:
            reader.unread = data
            self._serve(reader)
        else:
            self.later(reader, data)

    def later(self, reader: AnonymousReader, data: bytes) -> None:
        """Queues `data` of a connection that does not wait: also the rest of a turn that would have been too long."""
        anonymous = reader.anonymous
        assert anonymous is not None
        standing = Priority.KNOWN if anonymous.is_known else Priority.FRESH
        if self._keep(reader, data):
            reader.hold_reading()
            self._line.join(reader, anonymous.origin, standing)
            self._plan()

    def close(self) -> None:
        """Call it when the tower stops."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _keep(self, reader: AnonymousReader, data: bytes) -> bool:
        if self._unread + len(data) > self._budget.limits.max_unread_bytes:
            self._budget.refused[Over.UNREAD] += 1
            self._unread -= len(reader.unread)
            reader.cut()
            return False
        self._unread += len(data)
        reader.unread += data
        self._budget.waiting["reading"] = len(self._line)
        return True

    def _serve(self, reader: AnonymousReader) -> None:
        began = time.perf_counter()
        reader.take_turn()
        self._slices.used(time.perf_counter() - began)

    def _plan(self) -> None:
        if self._timer is None:
            wait_s = max(self._slices.wait_s(time.monotonic()), 0.0)
            self._timer = asyncio.get_running_loop().call_later(wait_s, self._turns)

    def _turns(self) -> None:
        self._timer = None
        while self._slices.wait_s(time.monotonic()) <= 0:
            ticket = self._line.call()
            if ticket is None:
                break
            self._unread -= len(ticket.item.unread)
            self._serve(ticket.item)
        self._budget.waiting["reading"] = len(self._line)
        if len(self._line):
            self._plan()
