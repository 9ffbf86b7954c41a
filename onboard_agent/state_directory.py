"""The folder for files that must survive an agent restart: the plan journal, and data about the autopilot."""

import errno
import fcntl
import os
from pathlib import Path

from wire.ids import DroneId


def state_directory(given: Path | None, drone_id: DroneId) -> Path:
    """Returns this drone's own folder, because agents of several drones may run on one machine. It need not exist yet.

    `given`: from the command line or systemd. Default: the user's state folder (XDG_STATE_HOME or ~/.local/state).
    """
    if given is None:
        home = os.environ.get("XDG_STATE_HOME")
        given = Path(home) / "tower-agent" if home else Path("~/.local/state/tower-agent").expanduser()
    return given / f"drone-{drone_id}"


def claim(directory: Path) -> str | None:
    """Creates the folder and locks it until this process ends. Returns why that failed, in one line, or None.

    Two agents of one drone would remove each other's journal. A read-only disk is usable, because nobody writes to it.
    """
    try:
        directory.mkdir(mode=0o700, parents=True, exist_ok=True)
        list(directory.iterdir())
        _lock(directory / "in-use")
    except OSError as error:
        if error.errno == errno.EROFS:
            return None
        why = "another agent works with it" if isinstance(error, BlockingIOError) else error.strerror
        return f"{directory} cannot be used ({why}): no plan will be written to the autopilot"
    return None


def _lock(file: Path) -> None:
    """Locks the file. The descriptor stays open, so that the lock lasts as long as the process."""
    descriptor = os.open(file, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    try:
        fcntl.lockf(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(descriptor)
        raise
