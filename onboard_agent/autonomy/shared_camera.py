"""A camera of the video process, in the shape of one of one's own: it keeps the newest shared picture."""

import threading
from collections.abc import Callable
from typing import Final

from onboard_agent.video.frame_share import FrameReader
from onboard_agent.video.sources.source import Picture

LOOK_EVERY_S: Final = 0.005
NOT_SHARED: Final = "the agent's camera is not shared: set camera in agent.toml"


class SharedCamera:
    """Call `start`, then `newest`. `on_change` is called by a thread of this at each picture; it must not block."""

    def __init__(self, path: str, on_change: Callable[[], None]) -> None:
        self._path = path
        self._on_change = on_change
        self._reader: FrameReader | None = None
        self._ending = threading.Event()
        self.words = "" if path else NOT_SHARED

    def start(self) -> None:
        """Begins to look for pictures."""
        if not self._path:
            return
        try:
            self._reader = FrameReader(self._path)
        except (OSError, ValueError) as error:
            self.words = f"the agent's pictures cannot be read: {error}"
            return
        threading.Thread(target=self._watch, args=(self._reader,), name="shared camera", daemon=True).start()

    def stop(self) -> None:
        """Ends its thread."""
        self._ending.set()

    def newest(self) -> Picture | None:
        """Returns the newest picture once. None: nothing new."""
        return None if self._reader is None else self._reader.newest()

    def _watch(self, reader: FrameReader) -> None:
        while not self._ending.wait(LOOK_EVERY_S):
            if reader.has_news():
                self._on_change()
