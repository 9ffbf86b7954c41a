"""Who has something to write is written to at the end of the round, all of them, each once.

A round is one emptying of the data channel's socket. Whatever came in it goes out in one message to each browser and
in the same wake-up of the process: where it sleeps between datagrams, a wake-up costs more than all the work in it.
"""

import asyncio
from collections.abc import Callable


class WriteRound:
    """The endpoint calls `begin` and `end`; a writer calls `ask` when it has something, at any time."""

    def __init__(self) -> None:
        self._asked: list[Callable[[], None]] = []
        self._open = False

    def ask(self, write: Callable[[], None]) -> None:
        """Calls `write` at the end of the round, or soon if there is none. Ask once only."""
        self._asked.append(write)
        if not self._open and len(self._asked) == 1:
            asyncio.get_running_loop().call_soon(self.end)

    def begin(self) -> None:
        """From here on writers wait for `end`."""
        self._open = True

    def end(self) -> None:
        """Writes."""
        self._open = False
        if self._asked:
            asked, self._asked = self._asked, []
            for write in asked:
                write()
