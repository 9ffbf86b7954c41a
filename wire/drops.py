"""Why a datagram or a frame was dropped. Every refusal on the wire has exactly one of these names."""

from collections import Counter
from enum import StrEnum


class DropReason(StrEnum):
    """In the order of the checks (docs/wire-protocol.md, 3.1)."""

    TOO_SHORT = "too_short"
    TOO_LONG = "too_long"
    BAD_VERSION = "bad_version"
    UNKNOWN_LINK = "unknown_link"
    BAD_KEY_PHASE = "bad_key_phase"
    NOT_AUTHENTIC = "not_authentic"
    REPLAYED = "replayed"
    DUPLICATE = "duplicate"  # also a copy that arrived by another uplink
    BAD_CONTENT = "bad_content"
    FOREIGN_TAG = "foreign_tag"
    STALE_EPOCH = "stale_epoch"
    BAD_FRAME = "bad_frame"
    NOT_UNDERSTOOD = "not_understood"  # a message of the tower that this agent does not know
    # frames from browsers
    MALFORMED = "malformed"
    UNKNOWN_DRONE = "unknown-drone"
    NOT_IN_CONTROL = "not-in-control"
    OFFLINE = "offline"
    NOT_ALLOWED = "not-allowed"
    OTHER_VEHICLE = "other-vehicle"  # of or for another system on the drone's line, in both directions
    SIGNATURE = "signature"  # from the autopilot's line, and not signed with the drone's key
    ASSISTED = "assisted"
    ASK_TWICE = "ask-twice"
    LOSS_CHECK = "loss-check"
    LOAN = "loan"
    ZONE = "zone"
    LATE = "late"
    OTHER_HANDS = "other-hands"
    FLOOD = "flood"


class Dropped(Exception):
    """A core refuses input from outside. Carries only the reason."""

    def __init__(self, reason: DropReason) -> None:
        super().__init__(reason.value)
        self.reason = reason


DropCounts = Counter[DropReason]
"""The number of drops by reason."""
