"""`tower-agent signing`: the key that autopilot and agent sign with, for the person at the companion computer."""

import sys
from pathlib import Path

from onboard_agent.signing.key_file import KeyFile, read_key
from onboard_agent.signing.signed_line import UNSIGNED
from onboard_agent.state_directory import claim
from onboard_agent.unusable import Unusable


def signing(folder: Path, *, show: bool, take: bool, forget: bool) -> None:
    """Prints whether there is a key; shows, takes or forgets it. Raises Unusable."""
    file = KeyFile(folder)
    keys = file.read() or (UNSIGNED,)
    if show:
        if not keys[0]:
            raise Unusable("there is no key")
        print(keys[0].hex())
        return
    if not take and not forget:
        print(f"signed with the key in {file.path}" if keys[0] else "not signed")
        return
    why_not = claim(folder)
    if why_not is not None:
        raise Unusable("the agent of this drone is running: `systemctl stop tower-agent`, on the ground, and again")
    try:
        file.write((read_key(sys.stdin.readline().strip()),) if take else (UNSIGNED,))
    except ValueError as error:
        raise Unusable(str(error)) from None
    except OSError as error:
        raise Unusable(f"{file.path}: {error.strerror or error}") from None
    print(f"signed with the key in {file.path}" if take else "not signed: the agent has no key now")
