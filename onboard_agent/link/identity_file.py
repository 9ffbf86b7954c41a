"""Stores the identity in its file, for its owner only, written atomically. Its text is never logged and never part of
an error.
"""

from __future__ import annotations

import contextlib
import logging
import os
import stat
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Final

from onboard_agent.link.identity import Identity, Kept, MalformedIdentity, NotKept, parse_kept
from onboard_agent.unusable import Unusable
from wire.ids import DroneId

_FOR_ENROLMENT: Final = "twe_"
_MAX_BYTES: Final = 1024
_SUPERUSER: Final = 0
_log = logging.getLogger("onboard_agent")


def read_identity(path: Path, state_of: Callable[[DroneId], Path] | None = None) -> Identity:
    """Reads this drone's identity from the file at `path`. Raises Unusable with the reason in one line.

    `state_of`: returns the state folder of a drone. The key is stored there if the agent may not change the file, as
    under systemd, which provides a copy.
    """
    found = _parse(path, _read(path))
    if found.key is not None:
        _check_private(path)
        return Identity(found, lambda kept: _keep_in(path, kept))
    beside = None if state_of is None else state_of(found.drone_id) / "key"
    if beside is not None and beside.exists():
        own = _parse(beside, _read(beside))
        _check_private(beside)
        if own.drone_id == found.drone_id and own.key is not None:
            return Identity(replace(own, credential=found.credential), lambda kept: _keep_beside(beside, path, kept))
    if beside is not None and not _is_ours(path):
        return Identity(found, lambda kept: _keep_beside(beside, path, kept))
    return Identity(found, lambda kept: _keep_in(path, kept))


def enrolment_token(path: Path) -> str | None:
    """Returns the enrolment token if the file contains one instead of an identity, or None."""
    text = _read(path).strip()
    return text if text.startswith(_FOR_ENROLMENT) and len(text.split()) == 1 else None


def token_file_warning(path: Path) -> str | None:
    """Returns what is wrong with the permissions of a file with a bearer credential, or None. Only a warning: the agent
    can still work, and the key that replaces the credential is stored for its owner only."""
    if stat.S_IMODE(path.stat().st_mode) & stat.S_IROTH:
        return f"the token file {path} can be read by everyone on this machine: chmod 600 it"
    return None


def write_private(path: Path, text: str) -> None:
    """Writes a file for its owner only. A crash of process or machine leaves the old file intact. Raises OSError."""
    fresh = path.with_name(f".{path.name}.{os.getpid()}")
    fresh.unlink(missing_ok=True)
    try:
        with os.fdopen(os.open(fresh, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as out:
            out.write(text)
            out.flush()
            os.fsync(out.fileno())
        fresh.replace(path)
    except OSError:
        with contextlib.suppress(OSError):
            fresh.unlink(missing_ok=True)
        raise
    folder = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)


def _read(path: Path) -> str:
    try:
        with path.open("rb") as file:
            return file.read(_MAX_BYTES).decode("ascii")
    except OSError as error:
        raise Unusable(f"the token file {path} cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        return ""


def _parse(path: Path, text: str) -> Kept:
    try:
        return parse_kept(text)
    except MalformedIdentity:
        raise Unusable(
            f"the token file {path} does not contain a drone's key (twk_<drone id>_<43 characters>), nor a credential "
            "or an enrolment token"
        ) from None


def _check_private(path: Path) -> None:
    """Refuses a key file that other users can access or own. Raises Unusable."""
    found = path.stat()
    mode = stat.S_IMODE(found.st_mode)
    # systemd lets the service read its copy by an access control list, which shows as the group's permission.
    allowed = 0o740 if _is_systemds(path) else 0o700
    if mode & ~allowed & 0o777:
        raise Unusable(
            f"the drone's key in {path} can be read by others on this machine (mode {mode:03o}): chmod 600 it, and "
            "enrol the drone again if anybody may have read it"
        )
    if found.st_uid not in (os.geteuid(), _SUPERUSER):
        raise Unusable(f"the drone's key in {path} belongs to another user of this machine: chown it to the agent's")


def _is_systemds(path: Path) -> bool:
    folder = os.environ.get("CREDENTIALS_DIRECTORY")
    return bool(folder) and path.resolve().is_relative_to(Path(str(folder)).resolve())


def _is_ours(path: Path) -> bool:
    return not _is_systemds(path) and os.access(path.parent, os.W_OK)


def _keep_in(path: Path, kept: Kept) -> None:
    try:
        write_private(path, str(kept))
    except OSError as error:
        raise NotKept(f"{path} cannot be written: {error.strerror}") from None


def _keep_beside(beside: Path, path: Path, kept: Kept) -> None:
    """Stores the key in `beside`. The credential stays where it is, because the agent may not change that file."""
    try:
        beside.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        write_private(beside, str(replace(kept, credential=None)))
    except OSError as error:
        raise NotKept(f"{beside} cannot be written: {error.strerror}") from None
    if kept.credential is None:
        _log.warning(
            "the drone's key in %s has taken the place of the credential in the token file %s, which is worth nothing "
            "any more",
            beside,
            path,
        )
