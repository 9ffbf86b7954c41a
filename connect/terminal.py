"""What is typed while `tower connect --fly` runs: one word a line. Thin shell around standard input."""

import asyncio
import os
import sys
from collections.abc import Callable


def listen(typed: Callable[[str], None]) -> Callable[[], None]:
    """Calls `typed` with each line, trimmed. Returns what stops it. Without a usable standard input it does nothing."""
    loop = asyncio.get_running_loop()
    try:
        number = sys.stdin.fileno()
    except (AttributeError, ValueError, OSError):
        return lambda: None
    waiting = b""

    def stop() -> None:
        loop.remove_reader(number)

    def readable() -> None:
        nonlocal waiting
        if os.isatty(number) and os.tcgetpgrp(number) != os.getpgrp():
            return  # in the background: reading would stop us
        data = os.read(number, 4096)
        if not data:
            stop()
            return
        *lines, waiting = (waiting + data[:1024]).split(b"\n")
        for line in lines:
            typed(line.decode(errors="replace").strip())

    try:
        loop.add_reader(number, readable)
    except (OSError, ValueError, NotImplementedError):
        return lambda: None  # a file or /dev/null cannot be waited for
    return stop


async def ask(question: str) -> str:
    """One line from whoever sits there; empty where nobody does."""
    if not sys.stdin or not sys.stdin.isatty():
        return ""
    print(question, end=" ", flush=True)
    line: str = await asyncio.to_thread(sys.stdin.readline)
    return line.strip()
