"""The message that reports a photograph, for each autopilot."""

from __future__ import annotations

import math

from simulator.dialect import Message, mavlink
from simulator.flight import Flight
from simulator.geodesy import e7, heading_deg
from simulator.photographs import Photo
from simulator.reports_common import us


def camera_feedback(flight: Flight, photo: Photo) -> Message:
    roll, pitch, yaw = flight.body.attitude()
    place = photo.place
    return mavlink.MAVLink_camera_feedback_message(
        us(flight),
        0,
        0,
        photo.number & 0xFFFF,
        e7(place.lat_deg),
        e7(place.lon_deg),
        place.alt_amsl_m,
        photo.alt_over_home_m,
        math.degrees(roll),
        math.degrees(pitch),
        heading_deg(yaw),
        0.0,
        mavlink.CAMERA_FEEDBACK_PHOTO,
        photo.number & 0xFFFF,
    )


def camera_trigger(flight: Flight, photo: Photo) -> Message:
    return mavlink.MAVLink_camera_trigger_message(us(flight), photo.number)
