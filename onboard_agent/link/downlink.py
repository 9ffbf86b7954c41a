"""What the tower sends for the autopilot, checked in the order of docs/wire-protocol.md, 3.1. No I/O.

The datagram is authentic by now. Here it must be for our drone and not from a holder of the past, and each frame in it
must be whole. What passes goes on byte for byte.
"""

from collections import Counter
from typing import Final

from wire.content import Frames
from wire.drops import DropReason
from wire.frames import checksum_holds, is_known, message_id
from wire.ids import DroneId, Epoch

SETUP_SIGNING: Final = 256
"""Carries a signing key in the clear: never forwarded, in either direction."""


class Downlink:
    """The fence. `epoch` is the newest that is known; it never goes back while a link lives."""

    def __init__(self) -> None:
        self.drone_id = DroneId(0)
        self.epoch = Epoch(0)
        self.counts: Counter[str] = Counter()
        """Frames not passed on, by reason."""

    def new_link(self, drone_id: DroneId, epoch: Epoch) -> None:
        """A welcome arrived. Its epoch counts even if it is lower: keys are new, so no old frame can pass, and a tower
        with a restored database must still be able to fly its drones."""
        self.drone_id = drone_id
        self.epoch = epoch

    def raise_epoch(self, epoch: int) -> None:
        """The tower reports who has the controls: everything older is refused from now on."""
        self.epoch = Epoch(max(self.epoch, epoch))

    def admit(self, content: Frames) -> list[bytes]:
        """The frames that may go to the autopilot."""
        if content.drone_id != self.drone_id:
            self.counts[DropReason.FOREIGN_TAG] += len(content.frames)
            return []
        if content.epoch < self.epoch:
            self.counts[DropReason.STALE_EPOCH] += len(content.frames)
            return []
        self.epoch = content.epoch
        passed: list[bytes] = []
        for frame in content.frames:
            if is_known(frame) and not checksum_holds(frame):
                self.counts[DropReason.BAD_FRAME] += 1
            elif message_id(frame) == SETUP_SIGNING:
                self.counts["setup_signing"] += 1
            else:
                passed.append(frame)
        return passed
