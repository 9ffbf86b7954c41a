"""Failures to inject, by name: in tests, and with `tower-sim --fail NAME[@SECONDS[-SECONDS]]`."""

from __future__ import annotations

import math
from enum import StrEnum
from typing import NamedTuple


class Failure(StrEnum):
    FIRST_MISSION_REQUEST_IGNORED = "first-mission-request-ignored"
    """The first MISSION_COUNT, MISSION_REQUEST_LIST and MISSION_REQUEST(_INT) get no answer."""
    MISSION_FINAL_ACK_MISSING = "mission-final-ack-missing"
    """The mission is stored but the MISSION_ACK is never sent."""
    MISSION_WRITTEN_IN_PLACE = "mission-written-in-place"
    """As ArduPilot stores missions and rally points: MISSION_COUNT truncates the stored plan to that length, and each
    item is written as it arrives. An aborted upload leaves new items before old ones. Fences are exchanged whole."""
    MISSION_VERBATIM = "mission-verbatim"
    """Items are stored unchanged: every bit is read back as sent, which no real autopilot does."""
    MISSION_WRONG_SEQUENCE = "mission-wrong-sequence"
    """Half-way through an upload the vehicle requests the item after the next one, drops it, and then requests the
    right one."""
    MISSION_REQUESTS_TWICE = "mission-requests-twice"
    """Every item request is sent twice, and so is the final MISSION_ACK."""
    MISSION_ENDS_EARLY = "mission-ends-early"
    """After half of the items the upload is acknowledged as accepted: only that half is stored."""
    REBOOT_DURING_UPLOAD = "reboot-during-upload"
    """After half of the items of an upload the vehicle reboots, once; not while armed."""
    MISSION_FULL = "mission-full"
    """MISSION_COUNT is answered with MAV_MISSION_NO_SPACE."""
    OLD_MISSION_REQUESTS = "old-mission-requests"
    """Items are requested with MISSION_REQUEST instead of MISSION_REQUEST_INT."""
    COMMAND_ACK_MISSING = "command-ack-missing"
    """Commands are executed but not acknowledged."""
    MODE_CHANGE_IGNORED = "mode-change-ignored"
    """A mode change is acknowledged as accepted but not executed."""
    MODE_CHANGE_SLOW = "mode-change-slow"
    """A mode change is acknowledged at once and executed a second and a half later."""
    PARAMETERS_DROPPED = "parameters-dropped"
    """Every seventh value is missing from a parameter list."""
    PARAMETERS_LOCKED = "parameters-locked"
    """Board parameters (`BRD_`) cannot be written, as if locked by the manufacturer: the answer is the old value and a
    warning."""
    PARAMETERS_SLOW = "parameters-slow"
    """Single values are sent 50 times per second, at most 20 requests are queued; the list is sent at full speed."""
    FILES_DROPPED = "files-dropped"
    """Every seventh response of MAVLink FTP is lost."""
    FILES_REFUSED = "files-refused"
    """MAVLink FTP opens no file, although the capabilities include it."""
    METADATA_MISSING = "metadata-missing"
    """COMPONENT_METADATA is answered, but the parameter file does not exist."""
    METADATA_DAMAGED = "metadata-damaged"
    """One byte of the parameter file is wrong: its CRC does not match."""
    LOG_DATA_DROPPED = "log-data-dropped"
    """Every seventh chunk of a log is lost."""
    CALIBRATION_FAILS = "calibration-fails"
    """The accelerometer's calibration fails at its second position, the compass's at its end."""
    DROP_EVERY_TENTH = "drop-every-tenth"
    """Every tenth frame that the vehicle sends is lost."""
    SILENT = "silent"
    """The vehicle sends nothing at all, but continues to fly."""
    MAVLINK_MUTE = "mavlink-mute"
    """Nothing passes the MAVLink port in either direction, and the vehicle continues to fly."""
    DEAF = "deaf"
    """Nothing arrives at its MAVLink port: the way to it is cut, or it asks for signing. It sends as ever."""
    NEVER_READY = "never-ready"
    """There is never a position estimate: arming is always refused."""
    GPS_LOST = "gps-lost"
    RADIO_LOST = "radio-lost"
    """The receiver on board loses the transmitter (overrides still count)."""
    MOTOR_WEAK = "motor-weak"
    """Motor 1 gives 70 % of its thrust."""
    MOTOR_LOST = "motor-lost"
    """Motor 1 stops."""
    BATTERY_SAG = "battery-sag"
    """A bad plug: the voltage sags by three more volts in a hover."""
    WIND_GUST = "wind-gust"
    """Twelve metres a second more, from the south-west, for as long as the failure lasts."""
    GPS_JUMP = "gps-jump"
    """Positions of the GPS are off by 40 m north and east. This and the next three need `--model sensing`."""
    COMPASS_JUMP = "compass-jump"
    """A magnetic field appears beside the compass."""
    IMU_NOISE = "imu-noise"
    """Accelerometer and gyroscope are twelve times as noisy."""
    BARO_STUCK = "baro-stuck"
    """The barometer repeats its last height for ever."""
    BATTERY_LOW = "battery-low"
    """The battery drops to 12 % at once."""
    CAMERA_UNPLUGGED = "camera-unplugged"
    """Viewers of the camera (`tower-sim --camera`) are disconnected, and its port refuses new ones."""


class PlannedFailure(NamedTuple):
    """A failure that sets in and may end by itself, in seconds since power-on."""

    from_s: float
    failure: Failure
    until_s: float = math.inf
