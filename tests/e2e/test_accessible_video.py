"""axe-core finds no serious or critical fault where there is video, and the keyboard alone reaches every
control there."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from axe_look import Axe
from console_page import ConsolePage, Somebody, signed_in, visitors
from filmed_drone import filmed_world
from playwright.sync_api import Browser, expect
from worlds.processes import World

pytestmark = pytest.mark.long("further states of pages that test_every_page.py looks at")

FOCUSED = "() => document.activeElement?.dataset.testid ?? document.activeElement?.getAttribute('href') ?? ''"
COVERS = """([cover, covered]) => {
  const box = (id) => document.querySelector(`[data-testid=${id}]`).getBoundingClientRect();
  const [one, other] = [box(cover), box(covered)];
  return one.left < other.right && other.left < one.right && one.top < other.bottom && other.top < one.bottom;
}"""


@pytest.fixture(scope="module")
def filmed(prepared_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[World]:
    with filmed_world(prepared_folder, tmp_path_factory.mktemp("filmed")) as world:
        yield world


@pytest.fixture
def come(chromium: Browser, filmed: World) -> Iterator[Somebody]:
    with visitors(chromium, filmed.address) as somebody:
        yield somebody


def reached(console: ConsolePage, most: int = 80) -> set[str]:
    """Returns the elements that Tab gives the focus to."""
    found = set()
    console.page.evaluate("document.activeElement?.blur()")
    for _ in range(most):
        console.page.keyboard.press("Tab")
        found.add(console.page.evaluate(FOCUSED))
    return found


def live(console: ConsolePage) -> None:
    expect(console.part("video-figures").first).to_be_visible(timeout=30_000)


def test_the_page_of_a_drone_with_video_and_what_it_recorded(come: Somebody, axe: Axe) -> None:
    alice = signed_in(come, "alice", "Kestrel")
    live(alice)
    axe.look(alice, "control-video-inset")
    alice.page.keyboard.press("v")
    live(alice)
    alice.acquire("Kestrel")
    axe.look(alice, "control-video-large")
    alice.part("recording-button").press("Enter")
    expect(alice.part("recording")).to_have_attribute("data-running", "true")
    axe.look(alice, "control-video-recording")
    wanted = {"video-quality", "video-snapshot", "video-full-screen", "recording-button", "show-video", "swap"}
    assert wanted <= reached(alice)
    alice.part("recording-button").press("Enter")
    expect(alice.part("recording")).to_have_attribute("data-running", "false")

    admin = signed_in(come, "admin", "Kestrel")
    admin.part("control-take").click()
    axe.look(admin, "control-take-video")
    admin.page.keyboard.press("Escape")
    admin.takes_from("alice", "Kestrel", may_watch_video=False)
    expect(alice.part("video-taken")).to_be_visible()
    axe.look(alice, "control-video-taken")
    for tool in ("swap", "show-video", "recording-button"):
        assert not alice.page.evaluate(COVERS, ["taken-banner", tool]), tool
    alice.part("page-logs").click()
    expect(alice.page.get_by_text("An admin has taken the video of Kestrel")).to_be_visible()
    axe.look(alice, "recordings-taken")

    admin.gives_back("Kestrel")
    admin.part("page-logs").click()
    row = admin.part("recording-row")
    expect(row).to_have_attribute("data-state", re.compile("ready"), timeout=60_000)
    axe.look(admin, "recordings")
    assert {"recording-download", "recording-delete"} <= reached(admin)
    axe.look_beneath(admin, "recording-delete", "recordings-delete")


def test_the_wall_of_videos(come: Somebody, axe: Axe) -> None:
    alice = signed_in(come, "alice")
    alice.part("open-videos").click()
    live(alice)
    axe.look(alice, "videos")
    assert "#/drone/1" in reached(alice, 20)
    tile = alice.part("video-tile").first
    box = tile.locator("canvas").bounding_box()
    assert box is not None
    alice.open("/#/videos/99")
    expect(alice.part("videos-none")).to_be_visible()
    axe.look(alice, "videos-none")
    alice.open("/#/videos")
    live(alice)
    alice.page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    expect(alice.part("value-armed")).to_be_visible()
