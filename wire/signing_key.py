"""The key with which a drone's agent and its autopilot sign what they send each other: the order for it, and its state.

The key itself stays at the agent: neither the tower nor a message of the link ever has it.
"""

from enum import StrEnum
from typing import Final

import msgspec

SIGNING: Final = "signing"
"""The entry in `takes` of agents that can sign."""


class Signing(StrEnum):
    """Whether agent and autopilot sign what they send each other."""

    OFF = "off"
    ON = "on"
    WRONG_KEY = "wrong_key"
    """The agent has a key, and what comes from the autopilot is not signed with it: the agent takes none of it."""
    NO_KEY = "no_key"
    """The autopilot signs, and the agent has no key: the autopilot takes nothing from it."""


class SigningChange(StrEnum):
    NEW_KEY = "new_key"
    """Make a key, or another one, and give it to the autopilot."""
    REMOVE = "remove"
    """Sign no more."""


class SigningWork(msgspec.Struct, frozen=True, tag="signing", tag_field="work"):
    """Change the key, on the ground and disarmed."""

    change: SigningChange
