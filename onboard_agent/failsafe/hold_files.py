"""The record of an open hold as a file in the agent's state directory. A thread writes it, because a memory card may
take a second and sticks must not wait. A thin shell."""

import contextlib
import logging
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

_log = logging.getLogger(__name__)


class HoldFiles:
    """A HoldStore. `folder` must exist."""

    def __init__(self, folder: Path) -> None:
        self._path = folder / "open-hold.json"
        self._worker = ThreadPoolExecutor(1, thread_name_prefix="open-hold")

    def load(self) -> bytes | None:
        """Returns the previous process's record; None if there is none or it cannot be read."""
        with contextlib.suppress(OSError):
            return self._path.read_bytes()
        return None

    def save(self, record: bytes) -> None:
        """Starts to write. The file is renamed into place: a process that dies meanwhile leaves the previous record."""
        self._begin(lambda: self._write(record))

    def remove(self) -> None:
        """Starts to remove the file."""
        self._begin(lambda: self._path.unlink(missing_ok=True))

    def close(self) -> None:
        """Waits for pending changes, and accepts no more."""
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
