"""The uplink setting: interface names or local addresses, checked before anything is opened."""

import ipaddress
import re
from collections.abc import Sequence
from typing import Final

from onboard_agent.sockets.data_socket import ANY_UPLINK
from onboard_agent.unusable import Unusable

MAX_UPLINKS: Final = 4
"""The tower sends to no more uplinks than this."""

_INTERFACE: Final = re.compile(r"[^\s/:,]{1,15}")
"""Interface names that Linux accepts."""


def parse_uplinks(words: Sequence[str]) -> tuple[str, ...]:
    """Parses `words`: each an interface or a local address, or several separated by commas. Empty: the routes decide.

    Raises Unusable.
    """
    uplinks = tuple(part.strip() for word in words for part in word.split(",") if part.strip())
    for uplink in uplinks:
        if not _is_address(uplink) and not _INTERFACE.fullmatch(uplink):
            raise Unusable(f"the uplink {uplink!r} is neither the name of an interface nor an address")
    if len(set(uplinks)) != len(uplinks):
        raise Unusable("an uplink is named twice")
    if len(uplinks) > MAX_UPLINKS:
        raise Unusable(f"{len(uplinks)} uplinks are more than the {MAX_UPLINKS} that a tower sends to")
    return uplinks or (ANY_UPLINK,)


def _is_address(text: str) -> bool:
    try:
        ipaddress.ip_address(text)
    except ValueError:
        return False
    return True
