"""A pilot records a drone's video, sees it listed with the logs, downloads it and deletes it."""

import re
from collections.abc import Iterator
from pathlib import Path

import av
import pytest
from console_page import Somebody, signed_in, visitors
from filmed_drone import filmed_world
from playwright.sync_api import Browser, expect
from worlds.processes import World, wait_for


@pytest.fixture(scope="module")
def filmed(prepared_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[World]:
    with filmed_world(prepared_folder, tmp_path_factory.mktemp("filmed")) as world:
        yield world


@pytest.fixture
def come(chromium: Browser, filmed: World) -> Iterator[Somebody]:
    with visitors(chromium, filmed.address) as somebody:
        yield somebody


def test_a_video_is_recorded_downloaded_and_deleted(come: Somebody, filmed: World, tmp_path: Path) -> None:
    alice = signed_in(come, "alice", "Kestrel")
    button = alice.part("recording-button")
    expect(button).to_be_disabled()
    expect(button).to_have_attribute("title", "Whoever has the controls of Kestrel, or an admin, records its video.")
    alice.acquire("Kestrel")
    expect(button).to_be_enabled()
    button.click()
    expect(alice.part("recording")).to_have_attribute("data-running", "true")
    admin = signed_in(come, "admin", "Kestrel")
    # Everybody sees the recording, whoever started it.
    expect(admin.part("recording-time")).to_have_text(re.compile(r"0:0[4-9]|0:[1-9]\d"), timeout=30_000)
    visitor = filmed.visitor("alice")
    wait_for("a picture", lambda: visitor.ask("GET", "/drones/1/recordings").json[0]["first_picture_at"])
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
    assert frames > 2
    alice.part("recording-delete").click()
    expect(alice.part("confirm-dialog")).to_contain_text("The recording of Kestrel that began on 20")
    alice.part("confirm-button").click()
    expect(row).to_have_count(0)
    expect(alice.page.get_by_text("No video of Kestrel is recorded.")).to_be_visible()
