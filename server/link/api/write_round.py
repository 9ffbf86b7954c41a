"""Calls each writer that has something to write once, at the end of the round.

A round empties the socket of the data channel once. Everything it received goes to each browser in one message and in
the same wake-up of the process: where the process sleeps between datagrams, a wake-up costs more than all the work in
it.
"""

import asyncio
from collections.abc import Callable


class WriteRound:
    """The endpoint calls `begin` and `end`; a writer calls `ask` at any time when it has something to write."""

    def __init__(self) -> None:
        self._asked: list[Callable[[], None]] = []
        self._open = False

    def ask(self, write: Callable[[], None]) -> None:
        """Calls `write` at the end of the round, or soon if there is none. A writer must ask only once per round."""
        self._asked.append(write)
        if not self._open and len(self._asked) == 1:
            asyncio.get_running_loop().call_soon(self.end)

    def begin(self) -> None:
        """Starts a round: writers wait for `end`."""
        self._open = True

    def end(self) -> None:
        """Ends the round and calls the writers."""
        self._open = False
        if self._asked:
            asked, self._asked = self._asked, []
            for write in asked:
                write()
