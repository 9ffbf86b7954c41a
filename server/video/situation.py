"""How it is with the video of one drone, in one word for programs and one sentence for people. Pure."""

from enum import StrEnum
from typing import NamedTuple

from wire.video import Codec


class VideoCondition(StrEnum):
    """What a viewer is told (docs/wire-protocol.md, 5)."""

    WAITING = "waiting"
    """Pictures are asked for, and none has come yet."""
    LIVE = "live"
    NO_CAMERA = "no-camera"
    CAMERA_LOST = "camera-lost"
    OFFLINE = "offline"
    THIN_LINK = "thin-link"
    NO_AGENT_VIDEO = "no-agent-video"
    """There is a camera, and no pictures come: the agent's video process does not reach the tower."""


class VideoSituation(NamedTuple):
    """`words` names the drone and says what is wrong; empty where nothing is. `codecs`: what can be asked for."""

    condition: VideoCondition
    words: str = ""
    codecs: tuple[Codec, ...] = ()
