"""The vehicles' poses in memory that the flight writes and the camera process reads, without locks.

A row for each camera: a count, north, east and height in metres, quaternion, simulated seconds, the count again. A
reader that finds two different counts has read during a write, and reads again.
"""

from __future__ import annotations

import mmap
import struct
import tempfile
from typing import IO

from simulator.camera.view import Pose

ROW = struct.Struct("=Q8dQ")
MAX_READ_TRIES = 100
"""Enough even at an unlucky moment: a write is much shorter."""


class SharedPoses:
    """`fd`: a file of `size(count)` bytes that both processes map."""

    def __init__(self, fd: int, count: int) -> None:
        self._memory = mmap.mmap(fd, self.size(count))
        self._written = 0

    @staticmethod
    def size(count: int) -> int:
        return ROW.size * count

    def write(self, row: int, pose: Pose, now_s: float) -> None:
        self._written += 1
        position = (pose.north_m, pose.east_m, pose.height_m)
        ROW.pack_into(self._memory, row * ROW.size, self._written, *position, *pose.quaternion, now_s, self._written)

    def read(self, row: int) -> tuple[Pose, float]:
        """Returns the newest pose and its time in simulated seconds."""
        for _ in range(MAX_READ_TRIES):
            before, north_m, east_m, height_m, w, x, y, z, now_s, after = ROW.unpack_from(self._memory, row * ROW.size)
            if before == after:
                break
        return Pose(north_m, east_m, height_m, (w, x, y, z)), now_s

    def close(self) -> None:
        self._memory.close()


def make_shared_poses(count: int) -> tuple[IO[bytes], SharedPoses]:
    """All poses begin at the origin. The file has no name and vanishes when the last process closes it."""
    file = tempfile.TemporaryFile()  # noqa: SIM115 - it is handed on
    file.truncate(SharedPoses.size(count))
    poses = SharedPoses(file.fileno(), count)
    for row in range(count):
        poses.write(row, Pose(0.0, 0.0, 0.0), 0.0)
    return file, poses
