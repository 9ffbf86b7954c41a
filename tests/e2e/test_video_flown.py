"""Live video as people see it: a real tower, two drones with cameras, and browsers that watch them.

The time strip in the picture shows that it moves, and its age.
"""

import shutil
import time
from collections.abc import Iterator
from pathlib import Path
from statistics import median

import cv2
import pytest
from console_page import ConsolePage, Somebody, signed_in, visitors
from playwright.sync_api import Browser, expect
from video_page import PAST_LIVE_MS, count, moves, strip, wait_until_live
from worlds.clock_strip import age_ms, read_clock
from worlds.processes import World, wait_for
from worlds.video_seen import looking_through, units_from_agents, unplugged_at

SAID_WITHIN_S = 1.0
SIMULATOR = ("--boot-s", "1", "--seed", "7", "--speed", "1")

LATENESS = """() => {
  const seen = { said: null, late: 0, due: performance.now() + 10 };
  window.lateness = seen;
  setInterval(() => {
    seen.late = Math.max(seen.late, performance.now() - seen.due);
    seen.due = performance.now() + 10;
  }, 10);
  const video = document.querySelector('[data-testid=video]');
  new MutationObserver(() => {
    const words = document.querySelector('[data-testid=video-words]')?.textContent ?? '';
    if (seen.said === null && words.includes('Camera of Kestrel lost since')) seen.said = Date.now();
  }).observe(video, { attributes: true, childList: true, subtree: true, characterData: true });
}"""
"""Records when the page reports that the camera is lost, and how late the page runs its timers."""


@pytest.fixture(scope="module")
def squad(prepared_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[World]:
    """alice's Kestrel and bob's Merlin, each with a camera."""
    folder = tmp_path_factory.mktemp("squad")
    shutil.copytree(prepared_folder, folder, dirs_exist_ok=True)
    with World(folder, prepared=True) as world:
        world.start_tower()
        world.start_simulated("Kestrel", "Merlin", options=SIMULATOR, camera="width=320&height=240&rate=15")
        world.wait_until_online(world.visitor("admin"), 1, 2)
        yield world


@pytest.fixture
def come(chromium: Browser, squad: World) -> Iterator[Somebody]:
    with visitors(chromium, squad.address) as somebody:
        yield somebody


@pytest.fixture
def alice(come: Somebody) -> ConsolePage:
    """Watches Kestrel, whose video is the inset."""
    alice = signed_in(come, "alice", "Kestrel")
    wait_until_live(alice)
    return alice


def complaints(console: ConsolePage) -> list[str]:
    """Returns the page's errors except the first 401, when nobody was signed in."""
    return [said for said in console.complaints if "401" not in said]


def test_the_control_page_shows_what_the_drone_sees_now(alice: ConsolePage) -> None:
    seen = moves(alice)
    alice.wait("a delay", lambda: count(alice, "delay") > 0)
    reported_ms = count(alice, "delay")
    print(f"{median(one.delay_ms for one in seen):.0f} ms by the strip, {reported_ms:.0f} ms told")
    assert reported_ms < PAST_LIVE_MS
    view = alice.part("video-view")
    expect(view).to_have_attribute("data-large", "false")
    alice.page.keyboard.press("v")
    expect(view).to_have_attribute("data-large", "true")
    alice.wait("figures", lambda: count(alice, "rate") > 5)
    moves(alice)
    alice.page.keyboard.press("v")
    expect(view).to_have_attribute("data-large", "false")
    moves(alice)
    assert complaints(alice) == []


def test_a_drone_sends_nothing_for_a_video_that_was_closed(alice: ConsolePage, squad: World) -> None:
    camera, admin = squad.cameras["Kestrel"], squad.visitor("admin")
    assert looking_through(camera) == 1
    alice.part("show-video").click()
    expect(alice.part("video")).to_have_count(0)
    wait_for("the camera to be closed", lambda: looking_through(camera) == 0)
    sent = units_from_agents(admin)
    alice.page.wait_for_timeout(1_000)
    assert units_from_agents(admin) == sent
    alice.part("show-video").click()
    wait_until_live(alice)
    assert complaints(alice) == []


def test_a_snapshot_is_what_is_seen(alice: ConsolePage, tmp_path: Path) -> None:
    alice.page.keyboard.press("v")
    wait_until_live(alice)
    with alice.page.expect_download() as download:
        alice.part("video-snapshot").click()
    saved_ms = time.time() * 1000
    path = tmp_path / "snapshot.png"
    download.value.save_as(path)
    assert download.value.suggested_filename.startswith("Kestrel")
    assert path.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    picture = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    assert picture is not None
    assert picture.shape == (240, 320)
    read = read_clock(picture)
    assert read is not None
    assert age_ms(read, round(saved_ms)) < 5_000
    alice.page.keyboard.press("v")


def test_the_wall_shows_drones_beside_each_other(come: Somebody) -> None:
    admin = signed_in(come, "admin")
    admin.part("open-videos").click()
    tiles = admin.part("video-tile")
    expect(tiles).to_have_count(2)
    for which in range(2):
        wait_until_live(admin, which)
    # Long enough for the page to refresh its drones, which must not restart a video.
    seen = [moves(admin, which, lasts_s=3.0, at_least=5) for which in (0, 1)]
    for which, pictures in enumerate(seen):
        assert median(one.delay_ms for one in pictures) < PAST_LIVE_MS
        # All tiles are in sight and none is cut off.
        tile = tiles.nth(which)
        expect(tile.get_by_test_id("video-delay")).to_be_in_viewport(ratio=1)
        expect(tile.get_by_role("link")).to_be_in_viewport(ratio=1)
    assert complaints(admin) == []


def test_an_unplugged_camera_is_said_and_the_picture_comes_back(alice: ConsolePage, squad: World) -> None:
    alice.page.evaluate(LATENESS)
    gone = unplugged_at(squad.cameras["Kestrel"])
    squad.unplug_camera("Kestrel", 5.0)
    words = alice.part("video-words")
    expect(words).to_contain_text("Camera of Kestrel lost since")
    unix_ahead_s = time.time() - time.monotonic()
    noted = alice.page.evaluate("window.lateness")
    said_s = noted["said"] / 1000 - unix_ahead_s - gone.result(30)
    print(f"said {said_s:.3f} s after it was unplugged; the page was late by {noted['late'] / 1000:.3f} s")
    assert said_s < SAID_WITHIN_S + noted["late"] / 1000
    expect(words).to_have_count(0)
    wait_until_live(alice)
    moves(alice)
    assert complaints(alice) == []


def test_the_video_is_taken_with_the_controls_and_comes_back_with_them(alice: ConsolePage, come: Somebody) -> None:
    alice.acquire("Kestrel")
    admin = signed_in(come, "admin", "Kestrel")
    wait_until_live(admin)
    admin.part("control-take").click()
    dialog = admin.page.get_by_role("dialog")
    expect(dialog.get_by_label("alice may still watch the video of Kestrel")).to_be_checked()
    # A person without a view of the drone sees no video.
    watch = dialog.get_by_label("alice may still watch Kestrel", exact=True)
    watch.uncheck()
    expect(admin.part("confirm-second-check")).to_be_disabled()
    expect(admin.part("confirm-second-check")).not_to_be_checked()
    watch.check()
    expect(admin.part("confirm-second-check")).to_be_checked()
    admin.part("cancel-button").click()
    admin.takes_from("alice", "Kestrel", reason="inquiry", may_watch_video=False)

    expect(alice.part("video-taken")).to_contain_text("The video of Kestrel was taken too.")
    expect(alice.part("video-taken")).to_contain_text("admin took control without letting you watch the video")
    expect(alice.part("taken-banner")).to_contain_text("The video was taken too. You can still watch the rest")
    expect(alice.part("video")).to_have_count(0)
    # Telemetry goes on, and so does the admin's video.
    alice.frames_heard.clear()
    alice.wait("frames", lambda: alice.frames_heard[1] > 20)
    moves(admin)
    assert strip(alice) is None

    # A person who is offered the controls sees the drone before accepting.
    admin.gives_back("Kestrel")
    expect(alice.part("video-taken")).to_have_count(0)
    wait_until_live(alice)
    alice.part("control-accept").click()
    expect(alice.part("blocked-reason")).to_contain_text("You fly Kestrel")
    moves(alice)
    assert complaints(alice) == complaints(admin) == []
