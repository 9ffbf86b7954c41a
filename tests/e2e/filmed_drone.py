"""Kestrel, a drone of alice's, whose camera plays a file: a moving grey."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

import av
from console_page import SIMULATOR
from worlds.free_ports import free_udp_ports
from worlds.processes import World

FRAMES: Final = 40


def make_film(path: Path) -> None:
    """Writes a two-second film that the camera repeats."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=20)
        stream.width, stream.height, stream.pix_fmt = 320, 240, "yuv420p"
        for number in range(FRAMES):
            frame = av.VideoFrame(320, 240, "yuv420p")
            for plane in frame.planes:
                plane.update(bytes([(number * 5) % 200]) * plane.buffer_size)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))


@contextmanager
def filmed_world(prepared_folder: Path, folder: Path) -> Iterator[World]:
    """A tower with Kestrel online."""
    shutil.copytree(prepared_folder, folder, dirs_exist_ok=True)
    film = folder / "film.mp4"
    make_film(film)
    with World(folder, prepared=True) as world:
        world.start_tower()
        (port,) = free_udp_ports(1)
        token = str(world.token_file("Kestrel"))
        autopilot = ("--autopilot", f"udpin:127.0.0.1:{port}")
        camera = ("--camera", f"file:{film}")
        world.start("agent", "tower-agent", "run", "--tower", world.address, "--token", token, *autopilot, *camera)
        home = ("--home", "47.3977,8.5456,488,0")
        world.start("simulator", "tower-sim", "--count", "1", *home, "--out", f"udp:127.0.0.1:{port}", *SIMULATOR)
        world.wait_until_online(world.visitor("admin"), 1)
        yield world
