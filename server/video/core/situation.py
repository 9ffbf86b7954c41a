"""How it is with the video of one drone, in one word for programs and one sentence for people. Pure."""

from enum import StrEnum
from typing import Final, NamedTuple

from wire.video import CameraState, Codec, VideoState

NO_PICTURES_AFTER_S: Final = 8.0
"""Time to start a process and open a camera. After this something is wrong."""


class VideoCondition(StrEnum):
    """The state reported to viewers (docs/wire-protocol.md, 4)."""

    WAITING = "waiting"
    """Pictures were requested, and none has arrived yet."""
    LIVE = "live"
    NO_CAMERA = "no-camera"
    CAMERA_LOST = "camera-lost"
    OFFLINE = "offline"
    THIN_LINK = "thin-link"
    NO_AGENT_VIDEO = "no-agent-video"
    """There is a camera, and no pictures come: the agent's video process does not reach the tower, or cannot make
    them."""


class VideoSituation(NamedTuple):
    """`words` names the drone and the fault; may be empty. `codecs`: those available."""

    condition: VideoCondition
    words: str = ""
    codecs: tuple[Codec, ...] = ()


class Known(NamedTuple):
    """What the tower knows of one stream. `linked`: the agent is connected; `takes_video`: it has a camera. `state`:
    its last report. `live`: pictures arrive. `asked_for_s`: time since they were requested."""

    name: str
    linked: bool
    takes_video: bool
    state: VideoState | None
    live: bool
    asked_for_s: float


def situation_of(known: Known, codec: Codec) -> VideoSituation:
    """For viewers who want this codec."""
    name, state = known.name, known.state
    if not known.linked:
        return VideoSituation(VideoCondition.OFFLINE, f"{name} is offline.")
    if not known.takes_video or (state is not None and state.camera is CameraState.NONE):
        return VideoSituation(VideoCondition.NO_CAMERA, f"{name} has no camera set up.")
    if state is None:
        if known.live:
            return VideoSituation(VideoCondition.LIVE)
        return VideoSituation(VideoCondition.WAITING, f"Waiting for the first picture of {name}.")
    codecs = state.codecs
    if state.camera is CameraState.LOST:
        return VideoSituation(VideoCondition.CAMERA_LOST, _with(f"The camera of {name} is lost", state.words), codecs)
    if codec not in codecs:
        return VideoSituation(
            VideoCondition.NO_AGENT_VIDEO, f"{name} does not send {NAMES[codec]}: choose another codec.", codecs
        )
    if state.thin:
        words = _with(f"The link of {name} is too thin for this video", state.words)
        return VideoSituation(VideoCondition.THIN_LINK, words, codecs)
    if known.live:
        return VideoSituation(VideoCondition.LIVE, _with(name, state.words) if state.words else "", codecs)
    if known.asked_for_s > NO_PICTURES_AFTER_S:
        words = _with(f"No pictures come from {name}", state.words)
        return VideoSituation(VideoCondition.NO_AGENT_VIDEO, words, codecs)
    return VideoSituation(VideoCondition.WAITING, f"Waiting for the first picture of {name}.", codecs)


NAMES: Final = {Codec.MPEG1: "MPEG-1", Codec.H264: "H.264"}
"""For people."""


def _with(sentence: str, words: str) -> str:
    return f"{sentence}: {words}" if words else f"{sentence}."
