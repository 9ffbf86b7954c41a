"""The camera's thread: the newest picture only, lost and found again, and released."""

import queue
import threading
import time
from collections.abc import Callable

import av
import pytest

from onboard_agent.video.sources.camera import Camera
from onboard_agent.video.sources.source import CameraLost, Picture, PictureRequest, Source, Taken
from wire.video import CameraState

DEADLINE_S = 30.0
LIVE, LOST, IDLE = CameraState.LIVE, CameraState.LOST, CameraState.IDLE


class Scripted(Source):
    """Returns what the test puts in."""

    def __init__(self) -> None:
        super().__init__("scripted")
        self.coming: queue.Queue[Taken | Exception | None] = queue.Queue()
        self.refuses: str | None = None
        self.opened = self.closed = 0

    def open(self, request: PictureRequest) -> None:
        self.opened += 1
        if self.refuses:
            raise CameraLost(self.refuses)

    def read(self) -> Taken | None:
        try:
            came = self.coming.get(timeout=0.02)
        except queue.Empty:
            return None
        if isinstance(came, Exception):
            raise came
        return came

    def close(self) -> None:
        self.closed += 1

    def gives(self, at_us: int) -> None:
        self.coming.put(Taken(av.VideoFrame(16, 16, "yuv420p"), at_us))


class World:
    def __init__(self) -> None:
        self.source = Scripted()
        self.changes = threading.Semaphore(0)
        self.camera = Camera(self.source, PictureRequest(), self.changes.release)

    def until(self, there: Callable[[], bool]) -> None:
        """Polls whenever the camera reports a change, as the video process does."""
        deadline = time.monotonic() + DEADLINE_S
        while not there():
            assert self.changes.acquire(timeout=max(deadline - time.monotonic(), 0.01)), "nothing changes any more"

    def picture(self) -> Picture:
        found: list[Picture] = []

        def there() -> bool:
            picture = self.camera.newest()
            found.extend([picture] if picture else [])
            return bool(found)

        self.until(there)
        return found[0]


@pytest.fixture
def world():
    made = World()
    made.camera.start()
    yield made
    assert made.camera.stop()


def test_the_newest_picture_only_and_that_once(world: World) -> None:
    world.source.gives(1)
    assert world.picture()[1:] == (1, 1, True)
    for at_us in range(2, 8):
        world.source.gives(at_us)
    world.until(lambda: world.camera._newest is not None and world.camera._newest.capture_us == 7)
    assert world.picture()[1:] == (7, 7, False)  # the number shows how many pictures were skipped
    assert world.camera.newest() is None
    assert (world.camera.state, world.camera.words) == (LIVE, "")


def test_unplugged_and_back(world: World) -> None:
    world.source.gives(1)
    world.picture()
    world.source.refuses = "scripted: not there"
    world.source.coming.put(CameraLost("scripted: gone"))
    world.until(lambda: world.camera.state is LOST)
    world.until(lambda: world.camera.words == "scripted: not there")
    world.source.refuses = None
    world.source.gives(50)
    assert world.picture()[1:] == (50, 2, True)
    assert world.camera.state is LIVE
    world.source.gives(51)
    assert not world.picture().is_break


def test_a_break_is_not_lost_with_the_picture_that_nobody_fetched(world: World) -> None:
    for at_us in (1, 2, 3):
        world.source.gives(at_us)
    world.until(lambda: world.camera._newest is not None and world.camera._newest.capture_us == 3)
    assert world.picture().is_break


def test_a_camera_that_falls_silent_is_lost_without_an_error(world: World) -> None:
    world.source.gives(1)
    assert world.picture().is_break
    world.until(lambda: world.camera.state is LOST)
    assert world.camera.words == "scripted: gives no pictures any more"
    assert world.source.opened == 1
    world.source.gives(2)
    assert world.picture().is_break


def test_an_unexpected_error_is_a_loss_too(world: World) -> None:
    world.source.coming.put(RuntimeError("driver is odd"))
    world.until(lambda: world.camera.words == "scripted: driver is odd")
    world.source.gives(1)
    assert world.picture().is_break


def test_stopped_it_is_let_go_of() -> None:
    world = World()
    world.camera.start()
    world.source.gives(1)
    world.picture()
    assert world.camera.stop()
    assert world.source.closed == world.source.opened == 1
    assert world.camera.state is IDLE
