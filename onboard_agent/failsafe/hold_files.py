"""The record of an open hold as a file in the agent's state directory, written by a thread: a memory card may take a
second for it, and sticks must not wait. A thin shell."""

import contextlib
import logging
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

_log = logging.getLogger(__name__)


class HoldFiles:
    """A HoldStore. The folder exists."""

    def __init__(self, folder: Path) -> None:
        self._path = folder / "open-hold.json"
        self._worker = ThreadPoolExecutor(1, thread_name_prefix="open-hold")

    def load(self) -> bytes | None:
        """The record of the process before; None if it left none, or it cannot be read."""
        with contextlib.suppress(OSError):
            return self._path.read_bytes()
        return None

    def save(self, record: bytes) -> None:
        """Begins to. Renamed into place: a process that dies meanwhile leaves the record before."""
        self._begin(lambda: self._write(record))

    def remove(self) -> None:
        """Begins to."""
        self._begin(lambda: self._path.unlink(missing_ok=True))

    def close(self) -> None:
        """Carries out what was begun, and takes nothing more."""
        self._worker.shutdown(wait=True)

    def _write(self, record: bytes) -> None:
        beside = self._path.with_suffix(".new")
        beside.write_bytes(record)
        beside.replace(self._path)

    def _begin(self, change: Callable[[], None]) -> None:
        def carry_out() -> None:
            try:
                change()
            except OSError as error:
                _log.error("%s cannot be written (%s): an agent that starts again will not know", self._path, error)

        self._worker.submit(carry_out)
