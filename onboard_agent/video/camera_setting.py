"""The camera setting. The flight process checks it without loading video libraries."""

from typing import Final

from onboard_agent.video.sources.schemes import check_spec

NO_CAMERA: Final = "none"


def parse_camera(text: str) -> str:
    """Returns NO_CAMERA, or a camera that `sources.schemes` accepts. Raises Unusable."""
    camera = text.strip() or NO_CAMERA
    if camera != NO_CAMERA:
        check_spec(camera)
    return camera
