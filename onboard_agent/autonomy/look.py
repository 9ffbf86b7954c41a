"""`python -m onboard_agent.autonomy.look`: looks for the target in the pictures of one camera, in a process of its own.

Of its own, because Python runs one thread of a process at a time: vision beside the steps of a controller would delay
them, on a busy computer beyond the time after which the drone holds. `target_watch` starts it; not meant for people.
"""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING, Annotated, Final

import msgspec

from onboard_agent.autonomy.core.lines import MAX_THUMBNAIL_BYTES, CameraSetting

if TYPE_CHECKING:
    from onboard_agent.autonomy.cameras import Frame
    from onboard_agent.vision.target_finder import TargetFinder
    from onboard_agent.vision.target_tracker import Track

NICE: Final = 10
"""Behind the controller's own process."""
THUMBNAIL_PX: Final = 160
WAIT_S: Final = 0.2
TELL_EVERY: Final = 5
"""Pictures without a target: each so manyth is reported, for the rate."""


class LookSetUp(msgspec.Struct, frozen=True):
    """The first line to the process. `target`: as `parse_kind` reads it. `frames_path`: shared pictures of the video
    process; empty: none."""

    camera: CameraSetting
    target: str
    alphabet: str
    frames_path: str = ""


class InPicture(msgspec.Struct, frozen=True):
    """A confirmed target, where it is in the picture. Pixels; `track` tells targets apart. `size_px`: width and height
    of the upright box around it."""

    track: int
    centre_px: tuple[float, float]
    letter: str | None
    confidence: float
    thumbnail: Annotated[bytes, msgspec.Meta(max_length=MAX_THUMBNAIL_BYTES)]
    size_px: tuple[float, float] = (0.0, 0.0)


class Looked(msgspec.Struct, frozen=True):
    """A line of the process: after a picture with a target, and now and then. `pictures`: looked at so far. `words`:
    the camera's problem."""

    pictures: int
    taken_s: float
    width_px: int
    height_px: int
    target: InPicture | None = None
    words: str = ""


def loaded_finder(target: str, alphabet: str) -> TargetFinder:
    """Returns what finds targets of this kind with these characters. Loads the picture libraries."""
    from onboard_agent.vision.target_finder import finder_of
    from onboard_agent.vision.target_kind import parse_kind

    return finder_of(parse_kind(target), alphabet)


def look_for_ever(set_up: LookSetUp, out: int) -> None:
    """Runs until the reader is gone."""
    from onboard_agent.autonomy.cameras import ControllerCameras

    finder = loaded_finder(set_up.target, set_up.alphabet)
    cameras = ControllerCameras((set_up.camera,), frames_path=set_up.frames_path)
    words = ""
    while True:
        frame = cameras.get_frames(WAIT_S).get(set_up.camera.name)
        problem = cameras.problems().get(set_up.camera.name, "")
        if frame is None:
            if problem != words:
                words = problem
                _say(out, Looked(cameras.taken, 0.0, 0, 0, words=words))
            continue
        words = ""
        target = target_in(finder, frame)
        if target is not None or cameras.taken % TELL_EVERY == 0:
            height_px, width_px = frame.pixels.shape[:2]
            _say(out, Looked(cameras.taken, frame.taken_s, width_px, height_px, target))


def target_in(finder: TargetFinder, frame: Frame) -> InPicture | None:
    """Returns the confirmed target that the picture shows, None without one."""
    from onboard_agent.vision.target_tracker import TrackState

    sighting = finder.look(frame.pixels, frame.taken_s)  # type: ignore[arg-type]
    track = sighting.track
    if track is None or track.state is not TrackState.CONFIRMED or track.seen_s != frame.taken_s:
        return None
    letter = None if sighting.letter is None else sighting.letter.words
    confidence = min(max(track.latest.confidence, 0.0), 1.0)
    xs, ys = zip(*track.latest.corners_px, strict=True)
    size = (max(xs) - min(xs), max(ys) - min(ys))
    return InPicture(track.number, track.latest.centre_px, letter, confidence, _thumbnail(frame, track), size)


def _thumbnail(frame: Frame, track: Track) -> bytes:
    """Returns a JPEG of the target and a little around it."""
    import cv2
    import numpy as np

    height, width = frame.pixels.shape[:2]
    xs, ys = zip(*track.latest.corners_px, strict=True)
    margin = 0.2 * max(max(xs) - min(xs), max(ys) - min(ys))
    left, top = max(int(min(xs) - margin), 0), max(int(min(ys) - margin), 0)
    right, bottom = min(int(max(xs) + margin) + 1, width), min(int(max(ys) + margin) + 1, height)
    part = np.asarray(frame.pixels[top:bottom, left:right], np.uint8)
    if part.size == 0:
        return b""
    shrink = min(THUMBNAIL_PX / max(part.shape[:2]), 1.0)
    size = (max(round(part.shape[1] * shrink), 1), max(round(part.shape[0] * shrink), 1))
    small = cv2.resize(part, size, interpolation=cv2.INTER_AREA)
    done, jpeg = cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, 70])
    data = jpeg.tobytes() if done else b""
    return data if len(data) <= MAX_THUMBNAIL_BYTES else b""


def _say(out: int, looked: Looked) -> None:
    os.write(out, msgspec.json.encode(looked) + b"\n")


def main() -> None:
    """Runs as the first line of standard input says."""
    out = os.dup(1)
    os.dup2(2, 1)  # a library's output must not be taken for a line
    set_up = msgspec.json.decode(sys.stdin.buffer.readline(), type=LookSetUp)
    try:
        look_for_ever(set_up, out)
    except BrokenPipeError:
        return


if __name__ == "__main__":
    from onboard_agent.step_back import step_back

    step_back(NICE)
    main()
