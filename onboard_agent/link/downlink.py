"""Checks the tower's frames for the autopilot, in the order of docs/wire-protocol.md, 3.1. No I/O.

The datagram is already authenticated. It must be for this drone and not from a past holder, and each frame in it must
be intact. Frames that pass are forwarded byte for byte.
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
    """Admits or drops frames. `epoch` is the newest known one; it never decreases during a link."""

    def __init__(self) -> None:
        self.drone_id = DroneId(0)
        self.epoch = Epoch(0)
        self.counts: Counter[str] = Counter()
        """Dropped frames, by reason."""

    def new_link(self, drone_id: DroneId, epoch: Epoch) -> None:
        """Takes the epoch of a welcome, even if it is lower: keys are new, so no old frame can pass, and a tower with a
        restored database must still be able to fly its drones."""
        self.drone_id = drone_id
        self.epoch = epoch

    def raise_epoch(self, epoch: int) -> None:
        """Raises the epoch, because the tower reports a newer one. Frames of older epochs are refused from now on."""
        self.epoch = Epoch(max(self.epoch, epoch))

    def admit(self, content: Frames) -> list[bytes]:
        """Returns the frames that may go to the autopilot."""
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
