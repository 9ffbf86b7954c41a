"""A pilot records the video of a drone, sees it in the list with the logs, downloads it and deletes it."""

import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import av
import pytest
from console_page import SIMULATOR, Somebody, signed_in, visitors
from playwright.sync_api import Browser, expect
from worlds.free_ports import free_udp_ports
from worlds.processes import World

FRAMES = 40


def make_film(path: Path) -> None:
    """A camera that is a file: a grey that moves."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=20)
        stream.width, stream.height, stream.pix_fmt = 320, 240, "yuv420p"
        for number in range(FRAMES):
            frame = av.VideoFrame(320, 240, "yuv420p")
            for plane in frame.planes:
                plane.update(bytes([(number * 5) % 200]) * plane.buffer_size)
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))


@pytest.fixture(scope="module")
def filmed(prepared_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[World]:
    """A drone with a camera."""
    folder = tmp_path_factory.mktemp("filmed")
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


@pytest.fixture
def come(chromium: Browser, filmed: World) -> Iterator[Somebody]:
    with visitors(chromium, filmed.address) as somebody:
        yield somebody


def test_a_video_is_recorded_downloaded_and_deleted(come: Somebody, tmp_path: Path) -> None:
    alice = signed_in(come, "alice", "Kestrel")
    button = alice.part("recording-button")
    expect(button).to_be_disabled()
    expect(button).to_have_attribute("title", "Whoever has the controls of Kestrel, or an admin, records its video.")
    alice.acquire("Kestrel")
    expect(button).to_be_enabled()
    button.click()
    expect(alice.part("recording")).to_have_attribute("data-running", "true")
    admin = signed_in(come, "admin", "Kestrel")
    # Everybody sees that it is recorded, whoever began it.
    expect(admin.part("recording-time")).to_have_text(re.compile(r"0:0[4-9]|0:[1-9]\d"), timeout=30_000)
    button.click()
    expect(admin.part("recording")).to_have_attribute("data-running", "false")
    alice.part("page-logs").click()
    row = alice.part("recording-row")
    expect(row).to_have_attribute("data-state", "ready", timeout=60_000)
    with alice.page.expect_download() as download:
        alice.part("recording-download").click()
    path = tmp_path / "a.mp4"
    download.value.save_as(path)
    assert download.value.suggested_filename.startswith("Kestrel-20")
    with av.open(str(path)) as container:
        frames = sum(1 for _ in container.decode(video=0))
    assert frames > 10
    alice.part("recording-delete").click()
    expect(alice.part("confirm-dialog")).to_contain_text("The recording of Kestrel that began on 20")
    alice.part("confirm-button").click()
    expect(row).to_have_count(0)
    expect(alice.page.get_by_text("No video of Kestrel is recorded.")).to_be_visible()
