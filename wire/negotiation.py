"""What an agent understands: the messages of every agent, and the groups that its hello lists (no I/O).

The wire has no version number beside the sign-in's. Each side lists in `takes` of hello and welcome the groups of
messages that it understands, and is sent no others: an unknown type is dropped, and ends the channel of an agent
before 0.3. A new message belongs into a group of its own; a new field is ignored by whoever does not know it.
`tests/integration/test_release_before.py` reads every message that the tower sends to an agent of 0.2.0 with that
release's own code.
"""

import re
from collections.abc import Collection, Mapping
from typing import Final

from wire.agent_update import AGENT_UPDATE, AgentUpdateWork
from wire.black_box import BLACK_BOX, BlackBoxWanted
from wire.control_messages import ToAgent
from wire.controller_settings import CONTROLLER_SETTINGS
from wire.controllers import CONTROLLERS, ControllerWork
from wire.findings import FINDINGS, SIGHTINGS
from wire.following import FOLLOW, FollowWork, LeaderPosition
from wire.open_holds import OPEN_HOLDS, Stay
from wire.parameter_metadata import PARAMETER_METADATA, MetadataWanted
from wire.signing_key import SIGNING, SigningWork
from wire.tower_list import TOWERS, TowerList
from wire.transactions import TRANSACTIONS, CancelTransaction, Transaction
from wire.video import VIDEO, ClockProbe, VideoWanted
from wire.zones.nearby import ZONES, NearbyZones

TOWER_TAKES: Final = (
    *(TRANSACTIONS, VIDEO, OPEN_HOLDS, PARAMETER_METADATA, BLACK_BOX),
    *(FINDINGS, SIGHTINGS, CONTROLLER_SETTINGS),
)
"""The groups that the tower understands."""

GROUPS: Final[Mapping[type, str]] = {
    Transaction: TRANSACTIONS,
    CancelTransaction: TRANSACTIONS,
    LeaderPosition: FOLLOW,
    Stay: OPEN_HOLDS,
    VideoWanted: VIDEO,
    ClockProbe: VIDEO,
    MetadataWanted: PARAMETER_METADATA,
    TowerList: TOWERS,
    BlackBoxWanted: BLACK_BOX,
    NearbyZones: ZONES,
}
"""Messages to an agent that not every agent understands."""

WORK_GROUPS: Final[Mapping[type, str]] = {
    FollowWork: FOLLOW,
    AgentUpdateWork: AGENT_UPDATE,
    ControllerWork: CONTROLLERS,
    SigningWork: SIGNING,
}
"""Work of a transaction that not every agent with transactions can do."""

_VERSION: Final = re.compile(r"[0-9A-Za-z][0-9A-Za-z.+~-]{0,39}")


def understands(takes: Collection[str], message: ToAgent) -> bool:
    """Returns whether an agent whose hello listed `takes` understands this message."""
    group = GROUPS.get(type(message))
    if group is None:
        return True
    if isinstance(message, Transaction):
        work_group = WORK_GROUPS.get(type(message.work))
        if work_group is not None and work_group not in takes:
            return False
    return group in takes


def version_of(reported: str) -> str | None:
    """Returns the version that a peer reports of itself, if it looks like one: it comes from outside."""
    return reported if _VERSION.fullmatch(reported) else None
