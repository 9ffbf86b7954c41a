"""Failures to inject, by name: in tests, and with `tower-sim --fail NAME[@SECONDS[-SECONDS]]`."""

from __future__ import annotations

import math
from enum import StrEnum
from typing import NamedTuple


class Failure(StrEnum):
    FIRST_MISSION_REQUEST_IGNORED = "first-mission-request-ignored"
    """The first MISSION_COUNT, MISSION_REQUEST_LIST and MISSION_REQUEST(_INT) get no answer."""
    MISSION_FINAL_ACK_MISSING = "mission-final-ack-missing"
    """The mission is stored but the MISSION_ACK never comes."""
    MISSION_WRITTEN_IN_PLACE = "mission-written-in-place"
    """As ArduPilot stores missions and rally points: MISSION_COUNT cuts the stored plan to that length, and each item
    is written as it comes. An upload that breaks off leaves new items before old ones. Fences are exchanged whole."""
    MISSION_VERBATIM = "mission-verbatim"
    """Items are stored as they came: what is read back is what was sent in every bit, as no autopilot does it."""
    MISSION_WRONG_SEQUENCE = "mission-wrong-sequence"
    """Half-way through an upload the item after the next one is asked for; what comes is dropped, and the right one
    asked for."""
    MISSION_REQUESTS_TWICE = "mission-requests-twice"
    """Every request for an item is sent twice, and so is the final MISSION_ACK."""
    MISSION_ENDS_EARLY = "mission-ends-early"
    """After half of the items the upload is acknowledged as accepted: what is stored is that half."""
    REBOOT_DURING_UPLOAD = "reboot-during-upload"
    """After half of the items of an upload the vehicle starts again, once; not while it is armed."""
    MISSION_FULL = "mission-full"
    """MISSION_COUNT is answered with MAV_MISSION_NO_SPACE."""
    OLD_MISSION_REQUESTS = "old-mission-requests"
    """Items are asked for with MISSION_REQUEST instead of MISSION_REQUEST_INT."""
    COMMAND_ACK_MISSING = "command-ack-missing"
    """Commands are carried out, but nobody is told."""
    MODE_CHANGE_IGNORED = "mode-change-ignored"
    """A mode change is acknowledged as accepted and does not happen."""
    MODE_CHANGE_SLOW = "mode-change-slow"
    """A mode change is acknowledged at once and happens a second and a half later."""
    PARAMETERS_DROPPED = "parameters-dropped"
    """Every seventh value is missing from a parameter list."""
    PARAMETERS_LOCKED = "parameters-locked"
    """Those of the board (`BRD_`) cannot be written, as where its maker has locked them: the answer is what they
    were, and a warning."""
    PARAMETERS_SLOW = "parameters-slow"
    """Single values are told 50 times a second, of 20 questions that wait at the most; the list as fast as ever."""
    FILES_DROPPED = "files-dropped"
    """Every seventh answer of MAVLink FTP is lost."""
    FILES_REFUSED = "files-refused"
    """MAVLink FTP opens no file, though the capabilities name it."""
    METADATA_MISSING = "metadata-missing"
    """COMPONENT_METADATA is answered, but the file of the parameters is not there."""
    METADATA_DAMAGED = "metadata-damaged"
    """One byte of the file of the parameters is another: its CRC does not hold."""
    LOG_DATA_DROPPED = "log-data-dropped"
    """Every seventh chunk of a log is lost."""
    DROP_EVERY_TENTH = "drop-every-tenth"
    """Each tenth frame that the vehicle sends is lost."""
    SILENT = "silent"
    """The vehicle sends nothing at all, but flies on."""
    NEVER_READY = "never-ready"
    """The position estimate never comes: arming is refused for ever."""
    GPS_LOST = "gps-lost"
    RADIO_LOST = "radio-lost"
    """The receiver on board hears no transmitter (overrides still count)."""
    MOTOR_WEAK = "motor-weak"
    """Motor 1 gives seven tenths of its thrust."""
    BATTERY_LOW = "battery-low"
    """The battery is at 12 % from one moment to the next."""
    CAMERA_UNPLUGGED = "camera-unplugged"
    """Whoever looks through the camera (`tower-sim --camera`) is cut off, and its port refuses."""


class PlannedFailure(NamedTuple):
    """One that sets in by itself and may end by itself, in seconds since switch-on."""

    from_s: float
    failure: Failure
    until_s: float = math.inf
