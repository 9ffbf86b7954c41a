"""What a controller on board has found: a typed message to the tower (no I/O).

Only for a tower that has listed FINDINGS in its welcome: any other would not know the message, and close the channel.
A sighting needs SIGHTINGS as well: any other tower would keep each as a finding.
"""

from typing import Annotated, Final

import msgspec

FINDINGS: Final = "findings"
"""The entry in `takes` of a welcome for this message."""

SIGHTINGS: Final = "sightings"
"""The same for one with `sighting`."""

MAX_THUMBNAIL_BYTES: Final = 8_000


_Share = Annotated[float, msgspec.Meta(ge=0.0, le=1.0)]


class InVideo(msgspec.Struct, frozen=True, kw_only=True):
    """Where a picture of the live video shows a target: the middle of its box and the box's size, as shares of the
    picture's width and height, from the upper left. `age_s`: of the picture when the message was made."""

    x: _Share
    y: _Share
    width: _Share
    height: _Share
    age_s: Annotated[float, msgspec.Meta(ge=0.0, le=60.0)]


class TargetFound(msgspec.Struct, frozen=True, tag="target_found", tag_field="type", kw_only=True):
    """Agent to tower. `id`: the transaction of the controller. `letter`: empty if it was not read. `confidence`: a
    rank, no probability. `thumbnail`: a JPEG, or empty. `in_video`: None if the live video does not show it.
    `sighting`: the target is in view at this moment, for the eye; nobody keeps it."""

    id: Annotated[int, msgspec.Meta(ge=0, le=0xFFFFFFFF)]
    letter: Annotated[str, msgspec.Meta(max_length=8)]
    confidence: Annotated[float, msgspec.Meta(ge=0.0, le=1.0)]
    lat_deg: Annotated[float, msgspec.Meta(ge=-90.0, le=90.0)]
    lon_deg: Annotated[float, msgspec.Meta(ge=-180.0, le=180.0)]
    thumbnail: Annotated[bytes, msgspec.Meta(max_length=MAX_THUMBNAIL_BYTES)] = b""
    in_video: InVideo | None = None
    sighting: bool = False
