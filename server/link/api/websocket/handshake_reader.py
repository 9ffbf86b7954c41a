"""The bytes of a WebSocket that has not signed in: few altogether, and parsed in turns with those of other strangers.

An agent's socket is open before the agent has signed in. Tiny frames cost the parser microseconds each: a few dozen
sockets that send nothing but pings would keep the event loop from everybody's frames.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from server.anonymous.api.read_turns import ReadTurns
from server.anonymous.core.budget import AnonymousBudget, Over
from server.anonymous.core.connections import AnonymousConnection


class HandshakeSocket(Protocol):
    """The WebSocket, as far as its reader needs it."""

    def is_closing(self) -> bool: ...
    def pause(self) -> None: ...
    def resume(self) -> None: ...
    def abort(self) -> None: ...


class HandshakeReader:
    """An AnonymousReader. `parse` receives at most `handshake_turn_bytes` at a time."""

    def __init__(
        self,
        own_socket: HandshakeSocket,
        parse: Callable[[bytes], None],
        *,
        anonymous: AnonymousConnection,
        budget: AnonymousBudget,
        turns: ReadTurns,
    ) -> None:
        self.anonymous: AnonymousConnection | None = anonymous
        self.unread = b""
        self.is_admitted = False
        """The client has signed in: the size no longer counts, and what waits still comes first."""
        self._socket = own_socket
        self._parse = parse
        self._budget = budget
        self._turns = turns
        self._left = budget.limits.max_handshake_bytes

    @property
    def is_over(self) -> bool:
        """The socket may be read directly from now on."""
        return self.is_admitted and not self.unread

    def came(self, data: bytes) -> None:
        """Call it for every read until `is_over`."""
        self._left -= len(data)
        if self._left < 0 and not self.is_admitted:
            self._budget.refused[Over.HANDSHAKE_BYTES] += 1
            self._socket.abort()
        else:
            self._turns.came(self, data)

    def hold_reading(self) -> None:
        """See AnonymousReader."""
        self._socket.pause()

    def take_turn(self) -> None:
        """See AnonymousReader."""
        data, self.unread = self.unread, b""
        if self._socket.is_closing():
            return
        size = self._budget.limits.handshake_turn_bytes
        self._parse(data[:size])
        if self._socket.is_closing():
            return
        if len(data) > size:
            self._turns.later(self, data[size:])
        else:
            self._socket.resume()

    def cut(self) -> None:
        """See AnonymousReader."""
        self.unread = b""
        self._socket.abort()
