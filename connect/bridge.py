"""Frames between local programs and the tower. No I/O; takes `now`.

Frames are neither changed nor stored for later. A frame from a program goes up with the drone's tag and the time of its
reception, so the tower can measure delays. A frame from the drone goes to every program.
"""

from collections.abc import Hashable
from typing import Final

from wire.dialect import mavlink
from wire.frame_stream import FrameStream
from wire.frames import MalformedFrame, message_id
from wire.ids import DroneId
from wire.lateness import stamp_ms
from wire.tagged import MAX_UPWARD_MESSAGE_BYTES, split_tagged, stamp, tag

PROGRAM_GONE_AFTER_S: Final = 5.0
"""Ground stations send a heartbeat each second; autopilots, too, treat five missing ones as a loss."""

MAX_PROGRAMS: Final = 32
"""Streams remembered at a time; the one that was silent for longest makes room."""

CHATTER: Final = frozenset({mavlink.MAVLINK_MSG_ID_HEARTBEAT, mavlink.MAVLINK_MSG_ID_REQUEST_DATA_STREAM})
"""Messages that every ground station repeats. Without the controls the tower would refuse each of them, and a heartbeat
that got through would tell the autopilot of a pilot who is not there."""


class Bridge:
    """One drone, any number of programs."""

    def __init__(self, drone_id: DroneId) -> None:
        self.has_controls = False
        """Set by the follower of the tower's events."""
        self.skipped_bytes = 0
        self._drone_id = drone_id
        self._streams: dict[Hashable, FrameStream] = {}
        self._heard_at: dict[Hashable, float] = {}
        self._ever_heard = False

    def from_program(self, program: Hashable, data: bytes, now: float) -> list[bytes]:
        """What came from a local program; returns binary messages for the live channel."""
        frames = self._stream_of(program, now).feed(data)
        if not frames:
            return []
        self._heard_at[program] = now
        self._ever_heard = True
        if not self.has_controls:
            frames = [frame for frame in frames if message_id(frame) not in CHATTER]
        head = stamp(stamp_ms(now))
        messages: list[bytes] = []
        message = head
        for frame in frames:
            tagged = tag(self._drone_id, frame)
            if len(message) + len(tagged) > MAX_UPWARD_MESSAGE_BYTES:
                messages.append(message)
                message = head
            message += tagged
        if len(message) > len(head):
            messages.append(message)
        return messages

    def program_gone(self, program: Hashable) -> None:
        """Its connection has ended."""
        self._streams.pop(program, None)
        self._heard_at.pop(program, None)

    def from_tower(self, message: bytes) -> list[bytes]:
        """The drone's frames in a binary message of the live channel; those of the rest of the squad are left out."""
        try:
            return [frame for drone_id, frame in split_tagged(message) if drone_id == self._drone_id]
        except MalformedFrame:
            self.skipped_bytes += len(message)
            return []

    def has_programs(self, now: float) -> bool:
        """Whether a program was heard recently. Before the first one it is the user who has just typed the command."""
        if not self._ever_heard:
            return True
        return any(now - heard_at < PROGRAM_GONE_AFTER_S for heard_at in self._heard_at.values())

    def _stream_of(self, program: Hashable, now: float) -> FrameStream:
        stream = self._streams.get(program)
        if stream is None:
            if len(self._streams) >= MAX_PROGRAMS:
                self.program_gone(min(self._streams, key=lambda one: self._heard_at.get(one, 0.0)))
            stream = self._streams[program] = FrameStream()
            self._heard_at.setdefault(program, now - PROGRAM_GONE_AFTER_S)
        return stream
