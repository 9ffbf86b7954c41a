"""What a controller on board has found: a typed message to the tower (no I/O).

Only for a tower that has listed FINDINGS in its welcome: any other would not know the message, and close the channel.
"""

from typing import Annotated, Final

import msgspec

FINDINGS: Final = "findings"
"""The entry in `takes` of a welcome for this message."""

MAX_THUMBNAIL_BYTES: Final = 8_000


class TargetFound(msgspec.Struct, frozen=True, tag="target_found", tag_field="type", kw_only=True):
    """Agent to tower. `id`: the transaction of the controller. `letter`: empty if it was not read. `confidence`: a
    rank, no probability. `thumbnail`: a JPEG, or empty."""

    id: Annotated[int, msgspec.Meta(ge=0, le=0xFFFFFFFF)]
    letter: Annotated[str, msgspec.Meta(max_length=8)]
    confidence: Annotated[float, msgspec.Meta(ge=0.0, le=1.0)]
    lat_deg: Annotated[float, msgspec.Meta(ge=-90.0, le=90.0)]
    lon_deg: Annotated[float, msgspec.Meta(ge=-180.0, le=180.0)]
    thumbnail: Annotated[bytes, msgspec.Meta(max_length=MAX_THUMBNAIL_BYTES)] = b""
