"""A camera as a MAVLink component: information, settings, storage, captures, and its video stream."""

from __future__ import annotations

import math

from simulator.camera.request import LIMITS
from simulator.command_message import ACCEPTED, DENIED, UNSUPPORTED, Command
from simulator.commands_camera import CAMERA_HANDLERS
from simulator.dialect import Message, mavlink
from simulator.flight import Flight
from simulator.reports_common import ms

FIELD_OF_VIEW_DEG = 75.0
"""The same as in `simulator.camera.view`, which needs OpenCV."""
SENSOR_WIDTH_MM, SENSOR_HEIGHT_MM = 6.2, 4.65
PHOTO_WIDTH_PX, PHOTO_HEIGHT_PX = 4000, 3000
PHOTO_MIB = 8.0
STORAGE_MIB = 32_768.0
FIRMWARE = 1 | 0 << 8
"""Version 1.0, one byte each."""
ZOOM_RATE_PERCENT_S = 25.0
_UNKNOWN = math.nan
_CAPTURES = frozenset(
    {
        int(mavlink.MAV_CMD_IMAGE_START_CAPTURE),
        int(mavlink.MAV_CMD_IMAGE_STOP_CAPTURE),
        int(mavlink.MAV_CMD_DO_SET_CAM_TRIGG_DIST),
        int(mavlink.MAV_CMD_DO_DIGICAM_CONTROL),
    }
)


class CameraReports:
    """`gimbal_device_id`: the gimbal that carries it, 0 if none. `video_uri`: empty without video."""

    heartbeat_type = int(mavlink.MAV_TYPE_CAMERA)
    intervals_s: dict[int, float] = {}  # noqa: RUF012 - of the protocol; nobody writes it

    def __init__(self, gimbal_device_id: int) -> None:
        self._gimbal_device_id = gimbal_device_id
        self.video_uri = ""
        self.zoom_percent = 0.0
        self._zooms = 0.0
        """Percent a second."""
        self.records_since_s: float | None = None
        self._ticked_s = 0.0

    def report(self, message_id: int, flight: Flight) -> Message | None:
        match message_id:
            case mavlink.MAVLINK_MSG_ID_CAMERA_INFORMATION:
                return self._information(flight)
            case mavlink.MAVLINK_MSG_ID_CAMERA_SETTINGS:
                mode = mavlink.CAMERA_MODE_IMAGE
                return mavlink.MAVLink_camera_settings_message(ms(flight), mode, self.zoom_percent, _UNKNOWN)
            case mavlink.MAVLINK_MSG_ID_STORAGE_INFORMATION:
                return self._storage(flight)
            case mavlink.MAVLINK_MSG_ID_CAMERA_CAPTURE_STATUS:
                return self._capture(flight)
            case mavlink.MAVLINK_MSG_ID_VIDEO_STREAM_INFORMATION if self.video_uri:
                return self._stream()
            case mavlink.MAVLINK_MSG_ID_VIDEO_STREAM_STATUS if self.video_uri:
                return mavlink.MAVLink_video_stream_status_message(1, *_stream_fields())
        return None

    def carry_out(self, flight: Flight, command: Command) -> int:
        """The flight handles captures: its missions take photographs with the same camera."""
        if command.number in _CAPTURES:
            return CAMERA_HANDLERS[command.number](flight, command)
        if command.number == mavlink.MAV_CMD_SET_CAMERA_ZOOM:
            return self._zoom(command)
        if command.number == mavlink.MAV_CMD_VIDEO_START_CAPTURE:
            self.records_since_s = flight.now_s if self.records_since_s is None else self.records_since_s
            return ACCEPTED
        if command.number == mavlink.MAV_CMD_VIDEO_STOP_CAPTURE:
            self.records_since_s = None
            return ACCEPTED
        return UNSUPPORTED

    def _zoom(self, command: Command) -> int:
        kind, value = command.params[0], command.params[1]
        if kind == mavlink.ZOOM_TYPE_RANGE and 0.0 <= value <= 100.0:
            self.zoom_percent, self._zooms = value, 0.0
            return ACCEPTED
        if kind == mavlink.ZOOM_TYPE_CONTINUOUS and value in (-1.0, 0.0, 1.0):
            self._zooms = value * ZOOM_RATE_PERCENT_S
            return ACCEPTED
        return DENIED

    def tick(self, flight: Flight) -> None:
        """The flight takes the photographs."""
        passed_s, self._ticked_s = max(flight.now_s - self._ticked_s, 0.0), flight.now_s
        self.zoom_percent = min(max(self.zoom_percent + self._zooms * passed_s, 0.0), 100.0)

    def _information(self, flight: Flight) -> Message:
        flags = mavlink.CAMERA_CAP_FLAGS_CAPTURE_IMAGE | mavlink.CAMERA_CAP_FLAGS_CAPTURE_VIDEO
        flags |= mavlink.CAMERA_CAP_FLAGS_HAS_BASIC_ZOOM
        if self.video_uri:
            flags |= mavlink.CAMERA_CAP_FLAGS_HAS_VIDEO_STREAM
        focal_mm = SENSOR_WIDTH_MM / 2.0 / math.tan(math.radians(FIELD_OF_VIEW_DEG) / 2.0)
        return mavlink.MAVLink_camera_information_message(
            ms(flight),
            _text(b"tower-sim"),
            _text(b"simulated camera"),
            FIRMWARE,
            focal_mm,
            SENSOR_WIDTH_MM,
            SENSOR_HEIGHT_MM,
            PHOTO_WIDTH_PX,
            PHOTO_HEIGHT_PX,
            0,
            flags,
            0,
            b"",
            self._gimbal_device_id,
        )

    def _storage(self, flight: Flight) -> Message:
        used = _used_mib(flight)
        return mavlink.MAVLink_storage_information_message(
            ms(flight),
            1,
            1,
            mavlink.STORAGE_STATUS_READY,
            STORAGE_MIB,
            used,
            STORAGE_MIB - used,
            _UNKNOWN,
            _UNKNOWN,
            mavlink.STORAGE_TYPE_MICROSD,
            b"",
            mavlink.STORAGE_USAGE_FLAG_SET | mavlink.STORAGE_USAGE_FLAG_PHOTO,
        )

    def _capture(self, flight: Flight) -> Message:
        camera = flight.camera
        interval_s = camera.interval_s
        status = 0 if interval_s is None else 2  # idle; idle between the photographs of an interval
        left = STORAGE_MIB - _used_mib(flight)
        recorded_s = None if self.records_since_s is None else flight.now_s - self.records_since_s
        recorded_ms = round((recorded_s or 0.0) * 1000)
        return mavlink.MAVLink_camera_capture_status_message(
            ms(flight), status, int(recorded_s is not None), interval_s or 0.0, recorded_ms, left, camera.taken
        )

    def _stream(self) -> Message:
        """The pictures are JPEG over HTTP, for which there is no VIDEO_STREAM_TYPE: the nearest is a TCP stream."""
        return mavlink.MAVLink_video_stream_information_message(
            1,
            1,
            mavlink.VIDEO_STREAM_TYPE_TCP_MPEG,
            *_stream_fields(),
            b"ahead",
            self.video_uri.encode()[:160],
            mavlink.VIDEO_STREAM_ENCODING_UNKNOWN,
        )


def _stream_fields() -> tuple[int, float, int, int, int, int, int]:
    """Returns flags, rate, width, height, bits per second (unknown: 0), rotation, field of view in degrees."""
    (_, _, rate), (_, _, width), (_, _, height) = LIMITS["rate"], LIMITS["width"], LIMITS["height"]
    return (int(mavlink.VIDEO_STREAM_STATUS_FLAGS_RUNNING), float(rate), width, height, 0, 0, round(FIELD_OF_VIEW_DEG))


def _used_mib(flight: Flight) -> float:
    return min(flight.camera.taken * PHOTO_MIB, STORAGE_MIB)


def _text(text: bytes) -> list[int]:
    return list(text.ljust(32, b"\0"))
