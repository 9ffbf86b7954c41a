"""Shared by the programs that the tower starts for long work: lines of JSON on standard output, progress about once a
second, and an end with the parent, whose pipe is the standard input."""

import json
import os
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Final

SAY_EVERY_S: Final = 1.0
_MAX_PROBLEM: Final = 150


def say(what: dict[str, Any]) -> None:
    sys.stdout.write(json.dumps(what) + "\n")
    sys.stdout.flush()


def say_problem(error: Exception) -> None:
    """In the words of the system or library, if it has any."""
    words = getattr(error, "strerror", None) or str(error) or type(error).__name__
    say({"problem": words[:_MAX_PROBLEM]})


def progress_writer() -> Callable[[int], None]:
    """Returns what the work calls with the number of pictures done, as often as it likes."""
    said = time.monotonic()

    def report(done: int) -> None:
        nonlocal said
        if time.monotonic() - said >= SAY_EVERY_S:
            said = time.monotonic()
            say({"done": done})

    return report


def end_with_parent() -> None:
    """From now on. A tower that was killed starts the work again."""
    threading.Thread(target=_wait_for_end, daemon=True).start()


def _wait_for_end() -> None:
    with suppress(OSError):
        while os.read(0, 1024):
            pass
    os._exit(3)
