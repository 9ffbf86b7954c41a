"""A camera and the vehicle that carries it: where it looks from, and when it is unplugged."""

from __future__ import annotations

from collections.abc import Sequence

from simulator.camera.marks import Mark
from simulator.camera.scene import Scene
from simulator.camera.server import Camera, CameraEndpoint
from simulator.camera.view import Pose
from simulator.failure_modes import Failure, PlannedFailure
from simulator.geodesy import LocalFrame, Place
from simulator.vehicle import Vehicle


class VehicleCamera:
    """`stands_at`: north and east of the squad's home, metres, where the vehicle was switched on."""

    def __init__(self, camera: Camera, stands_at: tuple[float, float]) -> None:
        self.camera = camera
        self._stands_at = stands_at

    def start(self) -> None:
        """Raises OSError if the port cannot be had."""
        self.camera.start()

    def close(self) -> None:
        self.camera.close()

    def follow(self, vehicle: Vehicle, now_s: float) -> None:
        """After each step of the flight. Never waits, and costs next to nothing while nobody looks."""
        camera = self.camera
        while camera.unplug_wishes:
            until_s = now_s + camera.unplug_wishes.popleft()
            vehicle.plan_failure(PlannedFailure(now_s, Failure.CAMERA_UNPLUGGED, until_s))
        camera.plug(Failure.CAMERA_UNPLUGGED not in vehicle.failures)
        if camera.is_watched:
            body = vehicle.flight.body
            north_m, east_m = self._stands_at
            quaternion = (body.qw, body.qx, body.qy, body.qz)
            camera.look_from(Pose(north_m + body.north_m, east_m + body.east_m, body.alt_m, quaternion), now_s)


def make_cameras(
    endpoints: Sequence[CameraEndpoint], vehicles: Sequence[Vehicle], home: Place, seed: int
) -> list[VehicleCamera | None]:
    """One for each of the first vehicles, in one world around `home`; the others have none. Raises ValueError."""
    if len(endpoints) > len(vehicles):
        raise ValueError(f"{len(endpoints)} times --camera for {len(vehicles)} vehicles: give one for each at most")
    frame = LocalFrame(home)
    places = [vehicle.settings.flight.place for vehicle in vehicles]
    stands = [frame.to_local(place.lat_deg, place.lon_deg) for place in places]
    scene = Scene(seed, [Mark(north, east, str(number)) for number, (north, east) in enumerate(stands, start=1)])
    made = [
        VehicleCamera(Camera(endpoint, scene, f"vehicle {number}"), stand)
        for number, (endpoint, stand) in enumerate(zip(endpoints, stands, strict=False), start=1)
    ]
    return [*made, *[None] * (len(vehicles) - len(made))]
