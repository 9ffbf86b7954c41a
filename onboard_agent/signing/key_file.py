"""The signing keys in the drone's state folder, for the agent's user only. A thread writes them, because a memory card
may take a second and sticks must not wait."""

import logging
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

from onboard_agent.link.identity_file import write_private
from onboard_agent.signing.signed_line import UNSIGNED, Keys
from wire.frame_signing import KEY_BYTES

_log = logging.getLogger("onboard_agent")
_NONE = "unsigned"


class KeyFile:
    """One key a line, in hexadecimal digits: the one in use, then the one that was offered to the autopilot, if any."""

    def __init__(self, folder: Path) -> None:
        self.path = folder / "signing-key"
        self._worker = ThreadPoolExecutor(1, thread_name_prefix="signing-key")

    def read(self) -> Keys:
        """Returns the keys. None where there is no file, or one that cannot be used, which is logged."""
        try:
            return tuple(read_key(line) for line in self.path.read_text("ascii")[:256].splitlines()[:2])
        except FileNotFoundError:
            return ()
        except (OSError, ValueError) as error:
            _log.error("%s cannot be used (%s): nothing is signed", self.path, error)
            return ()

    def write(self, keys: Keys) -> None:
        """Writes the keys before it returns. Raises OSError."""
        if keys in ((), (UNSIGNED,)):
            self.path.unlink(missing_ok=True)
            return
        self.path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        write_private(self.path, "".join(f"{key.hex() or _NONE}\n" for key in keys))

    def keep(self, keys: Keys) -> Callable[[], bool]:
        """Begins to write. What it returns says whether that is done, and raises OSError if it failed."""
        future: Future[None] = self._worker.submit(self.write, keys)

        def is_kept() -> bool:
            if not future.done():
                return False
            future.result()
            return True

        return is_kept

    def close(self) -> None:
        """Waits for what is being written."""
        self._worker.shutdown(wait=True)


def read_key(line: str) -> bytes:
    """Reads a line of the file. Raises ValueError without the line: it may be a key."""
    if line == _NONE:
        return UNSIGNED
    try:
        key = bytes.fromhex(line)
    except ValueError:
        key = b""
    if len(key) != KEY_BYTES:
        raise ValueError(f"a key must be {KEY_BYTES} bytes in hexadecimal digits")
    return key
