"""The files that must survive a restart of the agent: the plan journal, and what is known of the autopilot."""

import errno
import fcntl
import os
from pathlib import Path

from wire.ids import DroneId


def state_directory(given: Path | None, drone_id: DroneId) -> Path:
    """This drone's own folder: agents of several drones may run on one machine. It need not exist yet.

    `given`: by the command line or by systemd. Else where programs of a user keep such things.
    """
    if given is None:
        home = os.environ.get("XDG_STATE_HOME")
        given = Path(home) / "tower-agent" if home else Path("~/.local/state/tower-agent").expanduser()
    return given / f"drone-{drone_id}"


def claim(directory: Path) -> str | None:
    """Creates the folder and locks it for this process, until it ends. Returns why not, in one line, or None.

    Two agents of one drone would remove each other's journal. A read-only disk is usable, because nobody writes.
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
    """The descriptor is never closed: the lock is this process's, and goes with it."""
    descriptor = os.open(file, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    try:
        fcntl.lockf(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(descriptor)
        raise
