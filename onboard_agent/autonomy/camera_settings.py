"""The agent's setting `controller_cameras`. Loads no picture library."""

import re
from collections.abc import Sequence
from typing import Final

from onboard_agent.autonomy.core.lines import VIDEO, CameraKind, CameraSetting
from onboard_agent.unusable import Unusable
from onboard_agent.video.sources.schemes import check_spec

CAMERA_FORM: Final = "NAME[,kind=colour|infrared|depth][,tilt=DEG][,fov=DEG][,up=M] SOURCE"
_CAMERA: Final = re.compile(r"([a-z][a-z0-9_-]{0,19})((?:,[a-z]+=[\w.-]+)*) (\S.*)")
_LIMITS: Final = {"tilt": (0.0, 90.0), "fov": (1.0, 179.0), "up": (-5.0, 5.0)}


def parse_cameras(texts: Sequence[str]) -> tuple[CameraSetting, ...]:
    """Returns the cameras for controllers. SOURCE: as `camera`, or `video` for the pictures of the agent's own camera
    without opening it a second time. Raises Unusable."""
    found = tuple(_camera(text) for text in texts)
    if len({one.name for one in found}) < len(found):
        raise Unusable("controller_cameras: a name is there twice")
    return found


def _camera(text: str) -> CameraSetting:
    match = _CAMERA.fullmatch(text.strip())
    if match is None:
        raise Unusable(f"controller_cameras: {text!r} is not of the form {CAMERA_FORM}")
    name, options, source = match.groups()
    if source != VIDEO:
        check_spec(source)
    given = dict(one.split("=", 1) for one in options.split(",")[1:])
    kind, numbers = given.pop("kind", CameraKind.COLOUR), {"tilt": 90.0, "fov": 75.0, "up": 0.0}
    try:
        numbers |= {key: float(value) for key, value in given.items()}
        inside = all(least <= numbers[key] <= most for key, (least, most) in _LIMITS.items())
        if not inside or len(numbers) > len(_LIMITS):
            raise ValueError
        return CameraSetting(name, source, CameraKind(kind), numbers["tilt"], numbers["fov"], numbers["up"])
    except ValueError:
        limits = ", ".join(f"{key} {least:g} to {most:g}" for key, (least, most) in _LIMITS.items())
        raise Unusable(f"controller_cameras: {text!r}: {CAMERA_FORM}, with {limits}") from None
