"""The rest of the squad as aircraft for a ground station: ADSB_VEHICLE made of their positions. Takes `now`.

The tower sends a program the positions of the drones that its user may see, and of no others. Each is told once a
second, MAX_A_SECOND of them, while it is in the air.
"""

from math import atan2, degrees, hypot
from struct import Struct
from typing import Final

from wire.dialect import build, mavlink
from wire.frames import message_id, payload, source
from wire.ids import DroneId

EVERY_S: Final = 1.0
MAX_A_SECOND: Final = 50
MIN_HEIGHT_M: Final = 2.0
"""Above home. What stands on the ground is no traffic."""
MAX_KNOWN: Final = 1_000
_POSITION: Final = mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT
_FIELDS: Final = Struct("<IiiiihhhH")
_OWN_ADDRESSES: Final = 0xF0_0000
"""ICAO addresses that no state has: these aircraft have none."""
_RECEIVER: Final = mavlink.MAV_COMP_ID_ADSB
_KNOWN: Final = (
    mavlink.ADSB_FLAGS_VALID_COORDS
    | mavlink.ADSB_FLAGS_VALID_ALTITUDE
    | mavlink.ADSB_FLAGS_VALID_HEADING
    | mavlink.ADSB_FLAGS_VALID_VELOCITY
    | mavlink.ADSB_FLAGS_VALID_CALLSIGN
)


class SquadTraffic:
    """`drone_id`: the one that is connected. Its own frames say which system the programs know."""

    def __init__(self, drone_id: DroneId) -> None:
        self._drone_id = drone_id
        self._system_id: int | None = None
        self._sequence = 0
        self._told_at: dict[DroneId, float] = {}
        self._second = float("-inf")
        self._in_second = 0

    def frame(self, drone_id: DroneId, frame: bytes, now: float) -> bytes | None:
        """Takes a frame of any drone of the squad. The ADSB_VEHICLE to tell of it now, or None."""
        if drone_id == self._drone_id:
            self._system_id = source(frame)[0]
            return None
        if message_id(frame) != _POSITION or self._system_id is None:
            return None
        if now - self._told_at.get(drone_id, float("-inf")) < EVERY_S or not self._has_room(now):
            return None
        fields = _FIELDS.unpack_from(payload(frame).ljust(_FIELDS.size, b"\0"))
        _, lat_e7, lon_e7, alt_mm, rel_mm, north, east, down, _ = fields
        if rel_mm < MIN_HEIGHT_M * 1000 or (lat_e7 == 0 and lon_e7 == 0):
            return None
        if len(self._told_at) >= MAX_KNOWN:
            self._told_at.clear()
        self._told_at[drone_id] = now
        self._in_second += 1
        self._sequence = (self._sequence + 1) & 0xFF
        message = mavlink.MAVLink_adsb_vehicle_message(
            _OWN_ADDRESSES | (drone_id & 0xF_FFFF),
            lat_e7,
            lon_e7,
            mavlink.ADSB_ALTITUDE_TYPE_GEOMETRIC,
            alt_mm,
            round(degrees(atan2(east, north)) % 360.0 * 100) % 36_000,
            round(hypot(north, east)),
            -down,
            f"TWR{drone_id}"[:8].encode(),
            mavlink.ADSB_EMITTER_TYPE_UAV,
            0,
            _KNOWN,
            0,
        )
        return build(message, system_id=self._system_id, component_id=_RECEIVER, sequence=self._sequence)

    def _has_room(self, now: float) -> bool:
        if now - self._second >= 1.0:
            self._second, self._in_second = now, 0
        return self._in_second < MAX_A_SECOND
