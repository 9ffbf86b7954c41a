"""Where on flat ground a pixel lies, from attitude and height; and how a direction in the picture lies there. Pure."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from onboard_agent.vision.camera_model import Attitude, CameraModel, Vector, applied

MIN_DIP_DEG: Final = 3.0
"""Flatter rays give no place: at 3 degrees one degree of attitude error moves it by a third of the distance."""

EARTH_RADIUS_M: Final = 6_378_137.0


@dataclass(frozen=True, slots=True)
class GroundPlace:
    """From the vehicle's reference point: north and east in metres; `distance_m` from the lens; `bearing_deg` from
    north, clockwise, 0 to 360."""

    north_m: float
    east_m: float
    distance_m: float

    @property
    def bearing_deg(self) -> float:
        return math.degrees(math.atan2(self.east_m, self.north_m)) % 360.0


def ground_place(
    camera: CameraModel, pixel: tuple[float, float], attitude: Attitude, height_m: float
) -> GroundPlace | None:
    """Intersects the ray through a pixel with level ground `height_m` below the vehicle's reference point. None if the
    ray meets it at less than `MIN_DIP_DEG`, not at all, or if the lens is not above it."""
    world_from_body = attitude.world_from_body()
    mounting = camera.mounting
    lens = applied(world_from_body, (mounting.forward_m, mounting.right_m, mounting.down_m))
    north, east, down = applied(world_from_body, camera.body_direction(*pixel))
    lens_height_m = height_m - lens[2]
    if down < math.sin(math.radians(MIN_DIP_DEG)) or lens_height_m <= 0.0:
        return None
    distance_m = lens_height_m / down
    return GroundPlace(lens[0] + distance_m * north, lens[1] + distance_m * east, distance_m)


def body_place(camera: CameraModel, place: GroundPlace, pixel: tuple[float, float]) -> Vector:
    """Returns the same place in body axes, metres from the lens."""
    x, y, z = camera.body_direction(*pixel)
    return x * place.distance_m, y * place.distance_m, z * place.distance_m


def ground_heading_deg(
    camera: CameraModel, pixel: tuple[float, float], heading_deg: float, attitude: Attitude, height_m: float
) -> float | None:
    """Converts a direction in the picture at a pixel (from its top, clockwise) to one on the ground (from north,
    clockwise, 0 to 360). None where the ground is not seen."""
    step_px = 1.0
    angle = math.radians(heading_deg)
    ahead = (pixel[0] + step_px * math.sin(angle), pixel[1] - step_px * math.cos(angle))
    here = ground_place(camera, pixel, attitude, height_m)
    there = ground_place(camera, ahead, attitude, height_m)
    if here is None or there is None:
        return None
    return math.degrees(math.atan2(there.east_m - here.east_m, there.north_m - here.north_m)) % 360.0


def moved_deg(lat_deg: float, lon_deg: float, place: GroundPlace) -> tuple[float, float]:
    """Returns latitude and longitude of a place seen from a vehicle; good to centimetres within a kilometre, away from
    the poles."""
    lat = lat_deg + math.degrees(place.north_m / EARTH_RADIUS_M)
    return lat, lon_deg + math.degrees(place.east_m / (EARTH_RADIUS_M * math.cos(math.radians(lat_deg))))
