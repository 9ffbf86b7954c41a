"""Lines typed while `tower connect --fly` runs. Thin shell around standard input.

The event loop reads them, never a thread: a thread waiting for a line keeps the program from ending.
"""

import asyncio
import os
import sys
from collections.abc import Callable
from typing import Final

MAX_LINE_BYTES: Final = 1024


class Terminal:
    """`typed` gets each line, trimmed, unless a question waits for it. Without a standard input there are no lines."""

    def __init__(self, typed: Callable[[str], None]) -> None:
        self._typed = typed
        self._number: int | None = None
        self._half_line = b""
        self._answer: asyncio.Future[str] | None = None
        self._one_question = asyncio.Lock()

    def open(self) -> None:
        """Starts reading."""
        try:
            number = sys.stdin.fileno()
            asyncio.get_running_loop().add_reader(number, self._readable)
        except (AttributeError, ValueError, OSError, NotImplementedError):
            return  # no standard input; or a file, which the event loop cannot wait for
        self._number = number

    def close(self) -> None:
        """Harmless if it was not open."""
        if self._number is not None:
            asyncio.get_running_loop().remove_reader(self._number)
            self._number = None

    async def ask(self, question: str) -> str:
        """Returns the next line; empty without a terminal."""
        if self._number is None or not os.isatty(self._number):
            return ""
        async with self._one_question:
            print(question, end=" ", flush=True)
            self._answer = asyncio.get_running_loop().create_future()
            try:
                return await self._answer
            finally:
                self._answer = None

    def _readable(self) -> None:
        number = self._number
        assert number is not None
        if _in_the_background(number):
            return  # reading would stop the process
        data = os.read(number, MAX_LINE_BYTES)
        if not data:
            self.close()
            if self._answer is not None and not self._answer.done():
                self._answer.set_result("")
            return
        *lines, half = (self._half_line + data).split(b"\n")
        self._half_line = half[:MAX_LINE_BYTES]
        for line in lines:
            text = line.decode(errors="replace").strip()
            if self._answer is not None and not self._answer.done():
                self._answer.set_result(text)
            else:
                self._typed(text)


def _in_the_background(number: int) -> bool:
    """Returns whether this is the process's terminal, but another process group is in the foreground."""
    try:
        return os.tcgetpgrp(number) != os.getpgrp()
    except OSError:
        return False  # no terminal, or not this process's
