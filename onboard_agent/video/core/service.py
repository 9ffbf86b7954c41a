"""The flight process's side of video: the watched streams, whether the video process runs, reports to the tower.
No I/O.

The video process runs while something is watched and a little longer, so that the next viewer need not wait for it. A
ticket is valid for one link: when that is down, nothing is watched.
"""

from typing import Final

import msgspec

from onboard_agent.video.core.lines import Report, Watched
from onboard_agent.video.core.link_memory import Remembered
from wire.video import VIDEO, CameraState, Codec, VideoState, VideoWanted

KEEP_S: Final = 60.0
"""The process continues this long after the last viewer has left."""

CAN_BE_MADE: Final[tuple[Codec, ...]] = (Codec.MPEG1, Codec.H264)
"""Assumed until the video process has checked: PyAV has an encoder for both."""

STOPPED_WORDS: Final = "The camera's process on the drone ended and is started again."
SILENT_WORDS: Final = "The camera's process on the drone does not answer."


class VideoService:
    """Video of one drone. `has_camera`: a camera is configured."""

    def __init__(self, *, has_camera: bool) -> None:
        self._has_camera = has_camera
        self._linked = False
        self._wanted = Watched()
        self._frames = ""
        self._watched_until: float | None = None
        self._report: Report | None = None
        self._lost_words = ""
        self._is_silent = False
        self._codecs = CAN_BE_MADE
        self._sent: VideoState | None = None
        self.link: Remembered | None = None
        """What the video process has learnt of the link, for its successor."""

    # -- from the tower --------------------------------------------------------------------------------------------

    def link_up(self, takes: tuple[str, ...]) -> None:
        """A new link, on which nothing was sent yet. `takes`: from the tower's welcome."""
        self._linked = self._has_camera and VIDEO in takes
        self._sent = None

    def link_resumed(self) -> None:
        """The same link is back; the last message may be lost."""
        self._sent = None

    def link_down(self, now: float) -> None:
        """No tower is connected, and nothing is watched."""
        self._linked = False
        self.link = None
        self._want(Watched(), now)

    def wanted(self, message: VideoWanted, now: float) -> None:
        """Takes the tower's current demand."""
        if self._linked:
            self._want(Watched(ticket=message.ticket, streams=message.streams), now)

    def _want(self, wanted: Watched, now: float) -> None:
        if self._wanted.streams and not wanted.streams:
            self._watched_until = now
        self._wanted = wanted

    # -- from a controller on board --------------------------------------------------------------------------------

    def share(self, frames: str, now: float) -> None:
        """`frames`: path of the memory for the newest picture, whoever watches; empty: no controller looks any more.
        Does nothing without a camera."""
        if self._frames and not frames:
            self._watched_until = now
        self._frames = frames if self._has_camera else ""

    # -- the video process -----------------------------------------------------------------------------------------

    @property
    def watched(self) -> Watched:
        """The current demand, for the video process."""
        return msgspec.structs.replace(self._wanted, frames=self._frames)

    def should_run(self, now: float) -> bool:
        """Whether the video process should run."""
        if self._wanted.streams or self._frames:
            return True
        return self._watched_until is not None and now - self._watched_until < KEEP_S

    def reported(self, report: Report) -> None:
        """Takes a report of the video process."""
        self._report, self._lost_words, self._is_silent = report, "", False
        self.link = report.link if self._linked else None
        if report.codecs:
            self._codecs = report.codecs

    def silent(self) -> None:
        """A report of the video process is overdue: there are no pictures until the next one."""
        self._is_silent = True

    def ended(self, words: str = STOPPED_WORDS) -> None:
        """The video process has ended unexpectedly."""
        self._report, self._lost_words, self._is_silent = None, words, False

    def stopped(self) -> None:
        """The video process was stopped as intended."""
        self._report, self._lost_words, self._is_silent = None, "", False

    # -- to the tower ----------------------------------------------------------------------------------------------

    def messages_to_tower(self) -> VideoState | None:
        """Returns the changed state for the tower, or None."""
        if not self._linked:
            return None
        state = self._state()
        if state == self._sent:
            return None
        self._sent = state
        return state

    def _state(self) -> VideoState:
        if not self._wanted.streams:
            return VideoState(camera=CameraState.IDLE, codecs=self._codecs)
        if self._lost_words:
            return VideoState(camera=CameraState.LOST, words=self._lost_words[:200], codecs=self._codecs)
        if self._report is None or self._report.camera is CameraState.IDLE:
            return VideoState(camera=CameraState.OPENING, codecs=self._codecs)
        report = self._report
        if self._is_silent and report.camera is CameraState.LIVE:
            return VideoState(camera=CameraState.LOST, words=SILENT_WORDS, codecs=self._codecs)
        return VideoState(camera=report.camera, words=report.words[:200], thin=report.thin, codecs=self._codecs)
