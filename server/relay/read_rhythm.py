"""When the data channel's socket is read: at once, or in rounds with a rest between them. Sans-I/O.

The deadline of batching on this side is LONGEST_REST_S: no datagram waits longer for being read together with others,
whatever is in it (it is sealed, so nobody can know). Downwards nothing waits.

A rest pays where company is to be expected. A datagram that comes alone after silence is read at once, and so is each
one of a single agent that sends every 10 ms: resting would delay them all and bring no two together. Where there is
so much that many would wait, rests get shorter: less memory of the kernel, less delay, and nothing more to be saved.
"""

from typing import Final

LONGEST_REST_S: Final = 0.010
"""As long as frames wait for company in the agent (wire.batching)."""

SHORTEST_REST_S: Final = 0.001

ENOUGH: Final = 16
"""Datagrams that are to be read together: what one costs does not get less with more of them."""

PATIENCE: Final = 8
"""Rounds without company after which each datagram is read at once again."""


class ReadRhythm:
    """Tell it what each round brought; it says how long to rest, or None: watch the socket."""

    def __init__(self) -> None:
        self._patience = 0
        self._rest_s = LONGEST_REST_S
        self._last_alone_at = float("-inf")

    def came_alone(self, now: float) -> float | None:
        """One datagram was read while the socket was watched."""
        if now - self._last_alone_at < LONGEST_REST_S / 2:
            self._patience = PATIENCE
        self._last_alone_at = now
        return self._rest_s if self._patience else None

    def rested(self, count: int) -> float | None:
        """So many datagrams were read after a rest."""
        if count > 1:
            self._patience = PATIENCE
            self._rest_s = min(max(self._rest_s * ENOUGH / count, SHORTEST_REST_S), LONGEST_REST_S)
            return self._rest_s
        self._patience -= 1
        self._rest_s = LONGEST_REST_S
        if count and self._patience:
            return self._rest_s
        self._last_alone_at = float("-inf")
        return None
