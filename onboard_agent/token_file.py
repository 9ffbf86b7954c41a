"""Reads the drone's credential from its file. Its text is never logged and never part of an error."""

import stat
from pathlib import Path
from typing import Final

from onboard_agent.unusable import Unusable
from wire.credential import Credential, MalformedCredential, parse_credential

_LONGEST_BYTES: Final = 1024


def read_token(path: Path) -> Credential:
    """The credential in the file. Raises Unusable with the reason in one line."""
    try:
        with path.open("rb") as file:
            raw = file.read(_LONGEST_BYTES)
    except OSError as error:
        raise Unusable(f"the token file {path} cannot be read: {error.strerror}") from None
    try:
        return parse_credential(raw.decode("ascii"))
    except (UnicodeDecodeError, MalformedCredential):
        raise Unusable(
            f"the token file {path} does not contain a drone's credential (twd_<drone id>_<43 characters>)"
        ) from None


def token_file_warning(path: Path) -> str | None:
    """What is wrong with the file's permissions, or None. A warning only: the agent can still work."""
    mode = stat.S_IMODE(path.stat().st_mode)
    if mode & stat.S_IROTH:
        return f"the token file {path} can be read by everyone on this machine: chmod 600 it"
    return None
