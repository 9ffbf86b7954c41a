"""An autopilot's end of a line with signatures, by another implementation than the agent's."""

from simulator.dialect import Codec
from wire.dialect import mavlink
from wire.frame_stream import FrameStream


class SigningAutopilot:
    """Takes a key by SETUP_SIGNING, answers TIMESYNC, and sends a heartbeat when told. `armed`, `takes_keys`: as is."""

    def __init__(self, *, system_id: int = 1) -> None:
        self.codec = Codec(system_id)
        self.takes_keys = True
        self.answers = True
        self.armed = False
        self.heard: list[str] = []
        self.keys: list[bytes] = []
        self._stream = FrameStream()

    def sign(self, key: bytes, ticks: int = 1) -> None:
        self.codec.sign(key, ticks)

    def heartbeat(self) -> list[bytes]:
        mode = 0x81 if self.armed else 0x01
        return [self.codec.encode(mavlink.MAVLink_heartbeat_message(2, 3, mode, 5, 4, 3))]

    def receive(self, frames: list[bytes]) -> list[bytes]:
        """Returns its answers."""
        out = []
        for message in (one for frame in frames for one in self.codec.decode(frame)):
            self.heard.append(message.get_type())
            if message.get_type() == "SETUP_SIGNING" and self.takes_keys and not self.armed:
                key = bytes(message.secret_key)
                self.keys.append(key)
                self.codec.sign(key if any(key) else b"", message.initial_timestamp)
            if message.get_type() == "TIMESYNC" and self.answers:
                out.append(self.codec.encode(mavlink.MAVLink_timesync_message(77, message.ts1)))
        return out
