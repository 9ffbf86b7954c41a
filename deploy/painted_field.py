"""What is painted on the ground of `make run`, and how its drones look at it: targets, a landing pad, cameras."""

from __future__ import annotations

import math
from typing import Final
from urllib.parse import quote

HOME: Final = "47.3977,8.5456,488,0"
_METRES: Final = 111_319.5
"""Of a degree of latitude."""
TARGETS: Final = (
    ("K", 10.0, 6.0, 30.0, 1.2),
    ("A", -9.0, -12.0, 75.0, 1.2),
    ("T", 6.0, 28.0, 200.0, 1.2),
    ("7:red", 27.0, -9.0, 110.0, 2.0),
)
"""As `tower-sim --target`: metres north and east of home, heading in degrees, side in metres. The squad stands around
the first one; the last one is a white square with a coloured one."""
PAD: Final = "aruco-4x4-50:0=1.0@0,0.85;1=0.16"
"""Of the first drone, where it stands."""
LENS: Final = "tilt=90,fov=75"
GROUND: Final = "tilt=90&width=640&height=480"
PAYLOAD: Final = ("--param", "GRIP_ENABLE=1", "--param", "SERVO9_FUNCTION=28")
PRECISION_LANDING: Final = ("--param", "PLND_ENABLED=1", "--param", "PLND_TYPE=1")


def _on_map(north_m: float, east_m: float) -> tuple[float, float]:
    lat_deg, lon_deg = (float(word) for word in HOME.split(",")[:2])
    return lat_deg + north_m / _METRES, lon_deg + east_m / (_METRES * math.cos(math.radians(lat_deg)))


def simulator_words() -> tuple[str, ...]:
    """Returns the options of `tower-sim` for the ground and for payloads."""
    words = [*PAYLOAD, *PRECISION_LANDING, "--landing-pad", ",".join(HOME.split(",")[:2])]
    for name, north_m, east_m, heading_deg, side_m in TARGETS:
        lat_deg, lon_deg = _on_map(north_m, east_m)
        words += ["--target", f"{name}@{lat_deg:.7f},{lon_deg:.7f},{heading_deg:g},{side_m:g}"]
    return tuple(words)


def agent_words(number: int, name: str, camera_port: int) -> tuple[str, ...]:
    """Returns the options of the agent of drone `number`, from 0, for its cameras.

    The first one's live video looks straight down: what its controller finds is framed there. It lands on the pad. The
    others look ahead, and a controller of theirs opens a second view, straight down.
    """
    at = f"http://127.0.0.1:{camera_port}/camera"
    if number > 0:
        ahead = f"{at}?width=640&height=480&rate=30&name={quote(name)}"
        return ("--camera", ahead, "--controller-camera", f"down,{LENS} {at}?{GROUND}&rate=10")
    return (
        *("--camera", f"{at}?{GROUND}&rate=20&name={quote(name)}", "--controller-camera", f"down,{LENS} video"),
        *("--landing-pad", PAD, "--landing-camera", f"{at}?{GROUND}&fov=100&rate=10#tilt=90&fov=100"),
    )
