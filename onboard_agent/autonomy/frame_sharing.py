"""The flight process's side of shared pictures: makes the memory, and has the video process fill it while a controller
looks."""

import logging
import os
from collections.abc import Callable

from onboard_agent.video.core.frame_memory import SIZE_BYTES

_log = logging.getLogger(__name__)


class FrameSharing:
    """`share`: tells the video process where to put its pictures; empty: nowhere. The memory is made at the first
    `begin`, and lasts as long as this process."""

    def __init__(self, share: Callable[[str], None]) -> None:
        self._share = share
        self._fd: int | None = None

    def begin(self) -> str:
        """Returns the path of the memory for readers; empty if this system has none."""
        if self._fd is None:
            try:
                self._fd = os.memfd_create("newest picture")
                os.ftruncate(self._fd, SIZE_BYTES)
            except (OSError, AttributeError) as error:
                _log.error("no pictures for controllers: %s", error)
                return ""
        path = f"/proc/{os.getpid()}/fd/{self._fd}"
        self._share(path)
        return path

    def end(self) -> None:
        """No controller looks any more."""
        self._share("")
