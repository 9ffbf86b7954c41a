"""Several towers of one fleet: which ones an agent may link to (docs/wire-protocol.md, 2).

An agent that lists TOWERS in the `takes` of its hello has the list in the welcome, and each change of it. It moves to
another tower only with its own key, and obeys only the tower key that it knows: all towers of a fleet have the same.
"""

from typing import Annotated, Final

import msgspec

TOWERS: Final = "towers"
MAX_TOWERS: Final = 16
MAX_ADDRESS_LENGTH: Final = 255

Addresses = Annotated[
    tuple[Annotated[str, msgspec.Meta(max_length=MAX_ADDRESS_LENGTH)], ...], msgspec.Meta(max_length=MAX_TOWERS)
]
"""`https://HOST[:PORT]` of each tower that takes links now, the sender's own included."""


class TowerList(msgspec.Struct, frozen=True, tag="tower_list", tag_field="type", kw_only=True):
    """Tower to agent: the towers that take links now, in place of all earlier ones. `leave`: the sender ends its work;
    the agent links to another one and only then leaves this one."""

    towers: Addresses
    leave: bool = False
