"""What there is on this computer: how the agent was installed, which serial ports and cameras exist. Only looks.

For `tower-agent doctor`, whose remedies must work here, and `install`.
"""

from __future__ import annotations

import grp
import os
import re
import sys
from pathlib import Path
from typing import Final, NamedTuple

from onboard_agent import VERSION
from onboard_agent.unusable import Unusable

ENVIRONMENT: Final = Path("/opt/tower-agent")
"""Of the package for Debian, and of the documents' wheel."""
PACKAGE_LIST: Final = Path("/var/lib/dpkg/info/control-tower-agent.list")
DEVICES: Final = Path("/dev")
_PORTS: Final = ("serial/by-id/*", "ttyACM*", "ttyUSB*", "ttyAMA*", "ttyTHS*", "serial[0-9]")
_CAMERAS: Final = ("video[0-9]*",)
_CHECKOUT: Final = Path(__file__).resolve().parents[1]
_PI_PORT: Final = "on a Raspberry Pi: `raspi-config`, Interface Options, Serial Port, without a login shell"


class Trouble(NamedTuple):
    """`found`: a sentence about a part. `remedy`: what to do on this computer."""

    found: str
    remedy: str


def video_remedy(prefix: Path = Path(sys.prefix), package_list: Path = PACKAGE_LIST, root: Path = _CHECKOUT) -> str:
    """How to add the video libraries to this installation. `prefix`: its environment; `root`: above its packages."""
    if (root / "deploy" / "tower-agent.service").exists():
        return "`make setup` in the checkout"
    if prefix == ENVIRONMENT and package_list.exists():
        return f"`apt install ./control-tower-agent-video_{VERSION}_ARCH.deb`, of the same release"
    return f"`{prefix}/bin/pip install 'control_tower_agent-{VERSION}-py3-none-any.whl[video]'`, of the same release"


def port_trouble(autopilot: str, devices: Path = DEVICES) -> Trouble | None:
    """What keeps this user from opening the serial device of the `autopilot` setting; None: nothing, or none is set."""
    scheme, _, rest = autopilot.strip().partition(":")
    if scheme not in ("serial", "msp") or not rest.startswith("/"):
        return None
    device = Path(rest.partition(":")[0])
    if not device.exists():
        there = found(_PORTS, devices)
        known = (
            f"this computer has {', '.join(there)}"
            if there
            else f"this computer has no port: plug it in, or {_PI_PORT}"
        )
        return Trouble(f"{device} is not there", known)
    return _closed(device)


def camera_trouble(camera: str, devices: Path = DEVICES) -> Trouble | None:
    """The same for the device of a `v4l2` camera."""
    scheme, _, rest = camera.strip().partition(":")
    if scheme != "v4l2":
        return None
    device = Path(rest.partition("@")[0])
    if not device.exists():
        there = found(_CAMERAS, devices)
        known = f"this computer has {', '.join(there)}" if there else "this computer has no camera: is it plugged in?"
        return Trouble(f"{device} is not there", known)
    return _closed(device)


def the_autopilot_on_usb(devices: Path = DEVICES) -> str:
    """The `autopilot` setting for the one serial device on USB. Raises Unusable unless there is just one.

    An autopilot may show several ports of one device (`-if00`, `-if02`): the first speaks MAVLink.
    """
    ports: dict[str, str] = {}
    for name in found(("serial/by-id/*",), devices):
        ports.setdefault(re.sub(r"-if\d+(-port\d+)?$", "", name), name)
    if len(ports) == 1:
        return f"serial:{next(iter(ports.values()))}"
    there = found(_PORTS, devices)
    known = f"this computer has {', '.join(there)}" if there else "this computer has no port"
    which = "no autopilot is on USB" if not ports else "several devices are on USB"
    raise Unusable(f"{which}: give --autopilot, for example serial:/dev/serial0:921600; {known}")


def found(patterns: tuple[str, ...], devices: Path = DEVICES) -> list[str]:
    """The devices of these names, a name that stays first."""
    return [str(path) for pattern in patterns for path in sorted(devices.glob(pattern))]


def _closed(device: Path) -> Trouble | None:
    if os.access(device, os.R_OK | os.W_OK):
        return None
    number = device.stat().st_gid
    try:
        group = grp.getgrgid(number).gr_name
    except KeyError:
        group = str(number)
    return Trouble(
        f"{device} may not be opened by this user",
        f"`usermod -aG {group} USER` and a new sign-in, or `sudo`; the service is in its groups already",
    )
