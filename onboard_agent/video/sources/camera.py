"""A source with its own thread: keeps the newest picture and the camera's state, and reopens a lost camera.

A new picture replaces an unfetched one, because late pictures are useless.
"""

import logging
import threading
import time
from collections.abc import Callable
from typing import Final

from onboard_agent.link.backoff import STEADY_S, Backoff
from onboard_agent.video.sources.camera_watch import CameraWatch
from onboard_agent.video.sources.source import CameraLost, Picture, PictureRequest, Source, Taken
from wire.video import CameraState

_log = logging.getLogger(__name__)

_WATCH_EVERY_S: Final = 0.1
MAX_TEXT_LENGTH: Final = 160


class Camera:
    """Call `start`, then `newest` whenever `on_change` reports something, then `stop`.

    The camera's threads call `on_change` at each picture and each change of state; it must not block.
    """

    def __init__(self, source: Source, request: PictureRequest, on_change: Callable[[], None]) -> None:
        self._source = source
        self._request = request
        self._on_change = on_change
        self._lock = threading.Lock()
        self._watch = CameraWatch(source.name)
        self._newest: Picture | None = None
        self._number = 0
        self._break = True
        self._ending = threading.Event()
        self._threads: list[threading.Thread] = []

    @property
    def state(self) -> CameraState:
        return self._watch.state

    @property
    def words(self) -> str:
        """The problem, in words for users; empty if there is none."""
        return self._watch.words

    def start(self) -> None:
        """Starts the threads. Call it once."""
        for name, work in (("camera", self._read_for_ever), ("camera-watch", self._watch_for_ever)):
            thread = threading.Thread(target=work, name=name, daemon=True)
            self._threads.append(thread)
            thread.start()

    def stop(self) -> bool:
        """Releases the camera. False: its thread hangs in the driver, and only the end of the process releases it."""
        self._ending.set()
        self._source.interrupt()
        until = time.monotonic() + self._source.lets_go_within_s
        for thread in self._threads:
            thread.join(max(0.0, until - time.monotonic()))
        return not any(thread.is_alive() for thread in self._threads)

    def newest(self) -> Picture | None:
        """Returns the newest picture once. None: nothing new."""
        with self._lock:
            picture, self._newest = self._newest, None
            if picture is not None and picture.is_break:
                self._break = False
            return picture

    def _read_for_ever(self) -> None:
        backoff = Backoff()
        while not self._ending.is_set():
            self._changed(self._watch.opening)
            first_at: float | None = None
            try:
                self._source.open(self._request)
                while not self._ending.is_set():
                    taken = self._source.read()
                    if taken is None:
                        continue
                    self._took(taken)
                    first_at = first_at or time.monotonic()
            except CameraLost as error:
                self._lost(str(error))
            except Exception as error:  # unknown state of a driver or library: treat it as unplugged
                _log.exception("%s: unexpected", self._source.name)
                self._lost(f"{self._source.name}: {error}")
            finally:
                self._source.close()
            if first_at is not None and time.monotonic() - first_at >= STEADY_S:
                backoff.reset()
            self._ending.wait(backoff.next_delay_s())
        self._changed(self._watch.closed)

    def _watch_for_ever(self) -> None:
        while not self._ending.wait(_WATCH_EVERY_S):
            self._changed(lambda: self._watch.tick(time.monotonic()))

    def _took(self, taken: Taken) -> None:
        with self._lock:
            was = self._watch.state
            self._watch.picture(time.monotonic())
            if was is not CameraState.LIVE:
                self._break = True
            self._number += 1
            # The break flag stays set until a picture with it has been fetched.
            self._newest = Picture(taken.frame, taken.capture_us, self._number, self._break)
        if was is not CameraState.LIVE:
            _log.info("%s: gives pictures, %d x %d", self._source.name, taken.frame.width, taken.frame.height)
        self._on_change()

    def _lost(self, words: str) -> None:
        if self._ending.is_set():
            return
        words = fit_to_show(words)
        if self._watch.words != words:
            _log.warning("%s; trying on", words)
        self._changed(lambda: self._watch.lost(words))

    def _changed(self, happen: Callable[[], None]) -> None:
        with self._lock:
            was = self._watch.state, self._watch.words
            happen()
            changed = was != (self._watch.state, self._watch.words)
        if changed:
            self._on_change()


def fit_to_show(words: str) -> str:
    """Sanitises text from a camera for logs and screens: it may contain anything."""
    return "".join(letter if letter.isprintable() else "?" for letter in words)[:MAX_TEXT_LENGTH]
