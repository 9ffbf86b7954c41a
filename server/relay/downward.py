"""What a browser may send to a drone: the checks of one frame, in order, each with its drop reason."""

from typing import Final

from server.relay.browser import Browser
from server.relay.live_drone import LiveDrone
from wire.dialect import mavlink
from wire.drops import Dropped, DropReason
from wire.frames import checksum_holds, is_known, message_id

NEVER_FORWARDED: Final = frozenset({mavlink.MAVLINK_MSG_ID_SETUP_SIGNING})
"""In neither direction: SETUP_SIGNING carries a key in the clear."""


def check_downward(drone: LiveDrone | None, browser: Browser, frame: bytes, now: float) -> None:
    """Raises Dropped with the first check that a whole frame fails.

    A drone that is not there and one that is not theirs fail the same check, before anything else is looked at.
    """
    if drone is None or browser.number not in drone.watchers:
        raise Dropped(DropReason.UNKNOWN_DRONE)
    if is_known(frame) and not checksum_holds(frame):
        raise Dropped(DropReason.BAD_FRAME)
    if message_id(frame) in NEVER_FORWARDED:
        raise Dropped(DropReason.NOT_ALLOWED)
    if drone.holder_id != browser.viewer.user_id:
        raise Dropped(DropReason.NOT_IN_CONTROL)
    if drone.link is None or not drone.link.is_heard(now):
        raise Dropped(DropReason.OFFLINE)
