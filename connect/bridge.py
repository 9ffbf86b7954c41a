"""Frames between local programs and the tower. No I/O; takes `now`.

Frames are neither changed nor stored; the rest of the squad becomes traffic (`squad_traffic`). A frame from a program
goes to the tower with the drone's tag and the time of its reception, so that the tower can measure delays. A frame from
the drone goes to every program.
"""

from collections.abc import Hashable
from typing import Final

from connect.squad_traffic import SquadTraffic
from wire.dialect import mavlink
from wire.frame_stream import FrameStream
from wire.frames import MalformedFrame, message_id
from wire.ids import DroneId
from wire.lateness import stamp_ms
from wire.tagged import MAX_UPWARD_MESSAGE_BYTES, split_tagged, stamp, tag

PROGRAM_GONE_AFTER_S: Final = 5.0
"""Ground stations send a heartbeat every second: after five missing ones autopilots, too, consider them gone."""

MAX_PROGRAMS: Final = 32
"""Streams kept at a time; a new one evicts the one that has been silent longest."""

CHATTER: Final = frozenset({mavlink.MAVLINK_MSG_ID_HEARTBEAT, mavlink.MAVLINK_MSG_ID_REQUEST_DATA_STREAM})
"""Messages that every ground station repeats. The tower would refuse each of them from a user without the controls, and
a heartbeat that passed would report a pilot to the autopilot who is not there."""


class Bridge:
    """One drone, any number of programs. `is_alone`: the rest of the squad is traffic to them."""

    def __init__(self, drone_id: DroneId, *, is_alone: bool = True) -> None:
        self.has_controls = False
        """Set by the code that follows the tower's events."""
        self.skipped_bytes = 0
        self._drone_id = drone_id
        self._traffic = SquadTraffic(drone_id) if is_alone else None
        self._streams: dict[Hashable, FrameStream] = {}
        self._heard_at: dict[Hashable, float] = {}
        self._ever_heard = False

    def from_program(self, program: Hashable, data: bytes, now: float) -> list[bytes]:
        """Takes bytes from a local program; returns binary messages for the live channel."""
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
        """Forgets a program whose connection has ended."""
        self._streams.pop(program, None)
        self._heard_at.pop(program, None)

    def from_tower(self, message: bytes, now: float) -> list[bytes]:
        """Returns the drone's frames in a binary message of the live channel. If it is alone, the rest of the squad is
        traffic around it: an ADSB_VEHICLE for each of its drones in the air."""
        try:
            parts = split_tagged(message)
        except MalformedFrame:
            self.skipped_bytes += len(message)
            return []
        frames = [frame for drone_id, frame in parts if drone_id == self._drone_id]
        if self._traffic is None:
            return frames
        told = [self._traffic.frame(drone_id, frame, now) for drone_id, frame in parts]
        return frames + [frame for frame in told if frame is not None]

    def has_programs(self, now: float) -> bool:
        """Returns whether a program has sent frames recently. Before the first frame the user who typed the command
        counts."""
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
