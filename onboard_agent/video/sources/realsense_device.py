"""One RealSense device, shared by the sources of its streams: the library opens it once in a process.

Rules, each tested:
- A thread of the device takes the frames. Each source has a place for one: a newer frame replaces it.
- A stream that joins restarts the pipeline with all streams; one that leaves does not.
- A device that fails, or stays silent, fails for all its sources. They open it again as any lost camera.
"""

from __future__ import annotations

import contextlib
import logging
import threading
import time
from collections.abc import Callable, Mapping
from typing import Any, Final, NamedTuple, Protocol

from onboard_agent.video.sources.mode import Mode
from onboard_agent.video.sources.realsense_streams import Stream, Where
from onboard_agent.video.sources.source import OPEN_PATIENCE_S, READ_PATIENCE_S

_log = logging.getLogger(__name__)

JOIN_S: Final = 0.1
"""Cameras of one device are opened one after the other. Waiting for the others saves a restart."""
_STEP_MS: Final = 200
_NEEDED: Final = {
    Stream.COLOUR: (Stream.COLOUR,),
    Stream.INFRARED: (Stream.INFRARED,),
    Stream.INFRARED_RIGHT: (Stream.INFRARED_RIGHT,),
    Stream.DEPTH: (Stream.DEPTH,),
    Stream.ALIGNED: (Stream.DEPTH, Stream.COLOUR),
}


class Failed(Exception):
    """The device gives nothing (more). The text says why."""


class Pipeline(Protocol):
    """A started pipeline."""

    def frames(self, timeout_ms: int, *, is_aligned: bool) -> Mapping[Stream, Any] | None:
        """Returns the newest frame of each stream, and of `ALIGNED` if it is asked for. None: nothing in time. Raises
        RuntimeError."""

    def stop(self) -> None:
        """Raises RuntimeError."""


class Seat(NamedTuple):
    """What one source wants."""

    stream: Stream
    mode: Mode


class _Place:
    def __init__(self, seat: Seat) -> None:
        self.seat = seat
        self.frame: Any = None
        self.number: int | None = None
        self.came_at = 0.0
        self.words = ""


class RealsenseDevice:
    """`start`: opens a pipeline with these modes by stream; raises RuntimeError, and Failed with words."""

    def __init__(self, start: Callable[[Mapping[Stream, Mode]], Pipeline]) -> None:
        self._start = start
        self._changed = threading.Condition()
        self._places: list[_Place] = []
        self._thread: threading.Thread | None = None

    def join(self, seat: Seat) -> object:
        """Returns a ticket for `take` and `leave`. Raises Failed if the stream is read with another mode."""
        with self._changed:
            others = _modes([place.seat for place in self._places])
            for stream, mode in _modes([seat]).items():
                if mode != Mode() and others.get(stream, mode) not in (mode, Mode()):
                    raise Failed(f"its stream {stream} is read in another size or rate already")
            place = _Place(seat)
            self._places.append(place)
            if self._thread is None:
                self._thread = threading.Thread(target=self._work, name="realsense", daemon=True)
                self._thread.start()
            return place

    def take(self, ticket: object, timeout_s: float) -> Any | None:
        """Returns the newest frame once; None: none in time. Raises Failed."""
        assert isinstance(ticket, _Place)
        with self._changed:
            self._changed.wait_for(lambda: ticket.frame is not None or bool(ticket.words), timeout_s)
            if ticket.words:
                raise Failed(ticket.words)
            frame, ticket.frame = ticket.frame, None
            return frame

    def leave(self, ticket: object) -> None:
        """The last one closes the device, and waits for it."""
        with self._changed:
            if ticket in self._places:
                self._places.remove(ticket)
            self._changed.wait_for(lambda: bool(self._places) or self._thread is None, READ_PATIENCE_S)

    def _work(self) -> None:
        while True:
            time.sleep(JOIN_S)
            words = self._run()
            with self._changed:
                if words:
                    for place in self._places:
                        place.words = words
                    self._places = []
                if not self._places:
                    self._thread = None
                self._changed.notify_all()
                if self._thread is None:
                    return

    def _run(self) -> str:
        """Returns, with the device closed, when nobody is there any more, or with words on what failed."""
        pipeline: Pipeline | None = None
        running: dict[Stream, Mode] = {}
        try:
            while True:
                with self._changed:
                    wanted = _modes([place.seat for place in self._places])
                    is_aligned = any(place.seat.stream is Stream.ALIGNED for place in self._places)
                if not wanted:
                    return ""
                if pipeline is None or any(running.get(one) != mode for one, mode in wanted.items()):
                    if pipeline is not None:
                        _stop(pipeline)
                    pipeline = None
                    pipeline, running = self._start(wanted), wanted
                    self._begin_to_wait()
                self._hand_out(pipeline.frames(_STEP_MS, is_aligned=is_aligned) or {})
        except (Failed, RuntimeError) as error:
            return str(error).strip() or type(error).__name__
        except Exception as error:  # unknown state of a library: treat it as unplugged
            _log.exception("RealSense: unexpected")
            return f"{type(error).__name__}: {error}"
        finally:
            if pipeline is not None:
                _stop(pipeline)

    def _begin_to_wait(self) -> None:
        with self._changed:
            for place in self._places:
                place.came_at = time.monotonic() + OPEN_PATIENCE_S - READ_PATIENCE_S
                place.number = None

    def _hand_out(self, frames: Mapping[Stream, Any]) -> None:
        with self._changed:
            now = time.monotonic()
            for place in self._places:
                frame = frames.get(place.seat.stream)
                if frame is not None and frame.get_frame_number() != place.number:
                    # A pipeline repeats the last frame of a slower stream.
                    place.frame, place.number, place.came_at = frame, frame.get_frame_number(), now
                elif place.came_at and now - place.came_at > READ_PATIENCE_S:
                    raise Failed(f"its stream {place.seat.stream} gives no pictures")
                elif not place.came_at:
                    place.came_at = now  # it joined a running stream
            self._changed.notify_all()


def _stop(pipeline: Pipeline) -> None:
    with contextlib.suppress(RuntimeError):  # an unplugged device cannot be told
        pipeline.stop()


def _modes(seats: list[Seat]) -> dict[Stream, Mode]:
    """The streams to open. A seat without a wish takes the mode of another one. `ALIGNED` has a
    wish for depth only."""
    found: dict[Stream, Mode] = {}
    for seat in seats:
        for number, stream in enumerate(_NEEDED[seat.stream]):
            mode = seat.mode if number == 0 else Mode()
            found[stream] = mode if found.get(stream, Mode()) == Mode() else found[stream]
    return found


_devices: dict[Where, RealsenseDevice] = {}
_devices_lock = threading.Lock()


def shared_device(where: Where, start: Callable[[Mapping[Stream, Mode]], Pipeline]) -> RealsenseDevice:
    """Returns the one device of this process at `where`. `start`: for the first who asks."""
    with _devices_lock:
        return _devices.setdefault(where, RealsenseDevice(start))
