"""Following a leader: the tower's request to a follower's agent, and the leader's positions meanwhile (no I/O).

Only for an agent with FOLLOW in its hello: another one would not know the work, and end the channel.
"""

from typing import Annotated, Final

import msgspec

FOLLOW: Final = "follow"
"""What `takes` of a hello has where this is understood."""

FOLLOW_PERSON: Final = "follow_person"
"""The same for `patience_s`: a person sends a fix once a second, and would otherwise be lost all the time."""

PATIENCE_S: Final = 2.0
"""With a leader that flies: its place comes five times a second."""

PERSON_PATIENCE_S: Final = 3.0
"""With a person."""

NEAR_M: Final = 5.0
"""A follower that is nearer to its leader than this, over ground and in height, holds."""

APART_M: Final = 8.0
"""A place in a formation is this far from the leader, over ground or in height: more than NEAR_M by what a drone is off
its place in the wind."""

FARTHEST_M: Final = 200.0
"""Distance from the leader beyond which following ends."""

MAX_OFFSET_M: Final = 100.0

_U32 = Annotated[int, msgspec.Meta(ge=0, le=0xFFFFFFFF)]
_E7 = Annotated[int, msgspec.Meta(ge=-1_800_000_000, le=1_800_000_000)]
_Mm = Annotated[int, msgspec.Meta(ge=-10_000_000, le=100_000_000)]
_CmS = Annotated[int, msgspec.Meta(ge=-32768, le=32767)]
_Offset = Annotated[float, msgspec.Meta(ge=-MAX_OFFSET_M, le=MAX_OFFSET_M)]


class FollowWork(msgspec.Struct, frozen=True, tag="follow", tag_field="work"):
    """Keep this place relative to the leader, metres north, east and above, until something ends it.

    Not turned with the leader's nose: one that turns on the spot would swing its followers round itself. `patience_s`:
    a place of the leader's that is older is none.
    """

    leader_name: Annotated[str, msgspec.Meta(max_length=80)]
    north_m: _Offset
    east_m: _Offset
    up_m: _Offset
    patience_s: Annotated[float, msgspec.Meta(ge=PATIENCE_S, le=PERSON_PATIENCE_S)] = PATIENCE_S


class LeaderPosition(msgspec.Struct, frozen=True, tag="leader_position", tag_field="type", kw_only=True):
    """Tower to agent, on the data channel, five times a second while a FollowWork runs. The newest wins.

    `id`: of the transaction. `number` grows. `sent_ms`: the tower's clock, as in its datagrams. Height above sea level;
    velocity north, east and down. `age_ms`: age of the position when sent. `airborne` False: the leader is known to be
    on the ground. For a person, the height is that of the follower when it began.
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
    """Whether two places this far from each other are far enough for a formation."""
    return north_m * north_m + east_m * east_m >= APART_M * APART_M or abs(up_m) >= APART_M
