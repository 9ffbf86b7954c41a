"""Following a leader: the tower's request to a follower's agent, and the leader positions it sends (no I/O).

Only for an agent that has sent FOLLOW in its hello: any other would not know the work, and close the channel.
"""

from typing import Annotated, Final

import msgspec

FOLLOW: Final = "follow"
"""The entry in `takes` of a hello for these messages."""

FOLLOW_PERSON: Final = "follow_person"
"""The same for `patience_s`: without it the agent would keep losing a person, whose fix arrives once per second."""

PATIENCE_S: Final = 2.0
"""For a flying leader: its position arrives five times per second."""

PERSON_PATIENCE_S: Final = 3.0
"""For a person."""

NEAR_M: Final = 5.0
"""A follower nearer to its leader than this, horizontally and vertically, holds."""

APART_M: Final = 8.0
"""Minimum distance from the leader to a position in a formation, horizontally or vertically: more than NEAR_M, by a
drone's position error in wind."""

FARTHEST_M: Final = 200.0
"""From the leader: beyond it following ends."""

MAX_OFFSET_M: Final = 100.0

_U32 = Annotated[int, msgspec.Meta(ge=0, le=0xFFFFFFFF)]
_E7 = Annotated[int, msgspec.Meta(ge=-1_800_000_000, le=1_800_000_000)]
_Mm = Annotated[int, msgspec.Meta(ge=-10_000_000, le=100_000_000)]
_CmS = Annotated[int, msgspec.Meta(ge=-32768, le=32767)]
_Offset = Annotated[float, msgspec.Meta(ge=-MAX_OFFSET_M, le=MAX_OFFSET_M)]


class FollowWork(msgspec.Struct, frozen=True, tag="follow", tag_field="work"):
    """Keep this position relative to the leader, metres north, east and up, until something ends it.

    The position does not turn with the leader's nose: a leader that turns on the spot would swing its followers around.
    `patience_s`: older positions of the leader do not count.
    """

    leader_name: Annotated[str, msgspec.Meta(max_length=80)]
    north_m: _Offset
    east_m: _Offset
    up_m: _Offset
    patience_s: Annotated[float, msgspec.Meta(ge=PATIENCE_S, le=PERSON_PATIENCE_S)] = PATIENCE_S


class LeaderPosition(msgspec.Struct, frozen=True, tag="leader_position", tag_field="type", kw_only=True):
    """Tower to agent, on the data channel, five times per second while a FollowWork runs. The newest wins.

    `id`: of the transaction. `number` grows. `sent_ms`: the tower's clock, as in its datagrams. Height above sea level,
    velocity north, east and down. `age_ms`: age of the position at the tower when sent. `airborne` False: the leader is
    known to be on the ground. A followed person is reported as flying at the height of the follower at the start.
    """

    id: _U32
    number: _U32
    sent_ms: _U32
    lat_e7: _E7
    lon_e7: _E7
    alt_amsl_mm: _Mm
    north_cm_s: _CmS
    east_cm_s: _CmS
    down_cm_s: _CmS
    age_ms: _U32
    airborne: bool


def is_apart(north_m: float, east_m: float, up_m: float) -> bool:
    """Returns whether two positions with this offset are far enough apart for a formation."""
    return north_m * north_m + east_m * east_m >= APART_M * APART_M or abs(up_m) >= APART_M
