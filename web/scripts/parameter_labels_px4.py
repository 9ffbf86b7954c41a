"""PX4's labels of choices and bits that are sentences, in our words; those that differ by a number stand once."""

import re
from typing import Final

PX4: Final = {
    "- Turtle Mode enabled via AUX1": "Turtle mode by AUX1",
    "- Turtle Mode enabled via AUX2": "Turtle mode by AUX2",
    "3D Tracking: Track target's altitude (be aware that GPS altitude bias usually makes this useless)": (
        "Height above who is followed"
    ),
    "Autopilot estimator global position altitude (GPS)": "Height by the estimator",
    "Disable fallback to sensor-less estimation": "No estimate without a sensor",
    "Enable fallback to sensor-less estimation": "Estimates without a sensor",
    "Disabled during VTOL fast forward flight": "Off in fast flight of a VTOL",
    "Enabled in VTOL MC mode, listen to request from system in FW mode": "On while a VTOL hovers; else when asked",
    "Do not use airspeed in controller": "Without airspeed",
    "Fixed descent speed of MPC_LAND_SPEED": "Sinks at MPC_LAND_SPEED",
    "Get timestamp of mid exposure (active high)": "Time of mid exposure; active high",
    "Get timestamp of mid exposure (active low)": "Time of mid exposure; active low",
    "High Speed Long Range Mode": "Fast; long range",
    "High Speed Short Range Mode": "Fast; short range",
    "Hold Front Tangent to Circle": "Nose along the circle",
    "Normal helicopter with tail rotor": "Helicopter with tail rotor",
    "Pseudo-inverse with sequential desaturation technique": "Pseudo-inverse; one axis after the other",
    "RC and Joystick with fallback": "Either; the other one when lost",
    "RC or Joystick keep first": "Either; the first one stays",
    "Require GPS lock to arm": "Refused",
    "Require both a takeoff and a landing, or neither": "Both or neither",
    "Reset parameters to airframe defaults": "Defaults of the airframe",
    "Return to a planned mission landing, if available, using the mission path, else return to home via the reverse "
    "mission path. Do not consider rally points.": "Along the mission to its landing; else back along it",
    "Return to closest safe point (home or rally point) via direct path.": "Straight to home or a rally point",
    "Return to closest safe point other than home (mission landing pattern or rally point), via direct path. If no "
    "mission landing or rally points are defined return home via direct path. Always chose closest safe landing point "
    "if vehicle is a VTOL in hover mode.": "Straight to the mission's landing or a rally point",
    "Return to the planned mission landing, or to home via the reverse mission path, whichever is closer by counting "
    "waypoints. Do not consider rally points.": "Along the mission; on or back; by fewer waypoints",
    "Return via direct path to closest destination: home, start of mission landing pattern or safe point. If the "
    "destination is a mission landing pattern, follow the pattern to land.": "Straight to whatever is nearest",
    "Rover with Static Base on UART2 (similar to Default, except coming in on UART2)": "Rover; base at UART2",
    "Same as previous when landed, in-air require landing only if no valid VTOL approach is present": (
        "On the ground as before; in the air a landing or an approach"
    ),
    "Sensors and Actuators (ESCs) Automatic Config": "Sensors and ESCs; set up by itself",
    "Stabilize yaw for absolute/lock mode.": "Heading; where it is locked",
    "Start on default I2C addr(BATMON_ADDR_DFLT)": "At the address of BATMON_ADDR_DFLT",
    "Use the terrain estimate to trigger the flare (only)": "Flare by the ground in sight",
    "depending on AUX1 RC channel": "While AUX1 says so",
    "from 1st armed until shutdown": "From the first arming on",
    "while manual input AUX1 >30%": "While AUX1 is above 30 %",
    "Abort if terrain is not found (only applies to mission landings)": (
        "Aborts in missions without the ground in sight"
    ),
    "Abort if terrain times out (after a first successful measurement)": "Aborts when the ground is lost from sight",
    "Enable override during auto modes (except for in critical battery reaction)": "In missions and returns",
    "Enable override during offboard mode": "Offboard",
    "close the loop with gps speed": "By the speed of the GPS",
    "skip the controller and feedthrough the setpoints": "Goes past the controller",
    "pub agl as lpos down": "Height above ground as place",
    "use declination as an observation": "Declination as a measurement",
}

_PATTERNS: Final = (
    (r"Mask Channel (\d+) as a mode button", r"Channel \1"),
    (r"Put CH(\d+) to Duty-Cycle mode", r"Output \1 by duty cycle"),
    (r"[A-Z0-9 ]+ Output (?:ESC|PWM Channel) (\d+)", r"Output \1"),
    (r"Peripheral via Actuator Set (\d+)", r"Actuator \1 of a mission"),
    (r"Enable I2C (input|output) protocol (\w+)", r"I2C \1: \2"),
    (r"(\d+) degrees half cone angle\.?", "\\1\u00b0"),
)


def of_px4(published: str) -> str | None:
    """None: it is no such sentence."""
    ours = PX4.get(published)
    if ours is not None:
        return ours
    for pattern, words in _PATTERNS:
        found = re.fullmatch(pattern, published)
        if found:
            return found.expand(words)
    return None
