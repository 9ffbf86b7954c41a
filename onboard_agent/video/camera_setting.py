"""The setting of the camera: checked in the flight process, which loads nothing for it."""

from typing import Final

from onboard_agent.video.sources.schemes import check_spec

NO_CAMERA: Final = "none"


def parse_camera(text: str) -> str:
    """NO_CAMERA, or the camera as `sources.schemes` knows it. Raises Unusable."""
    camera = text.strip() or NO_CAMERA
    if camera != NO_CAMERA:
        check_spec(camera)
    return camera
