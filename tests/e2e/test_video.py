"""The console's video player in a real browser: what is on the canvas, and what the page reports without video.

The tower is a fake (web/test/fake_tower.py) with the agent's own encoders. One request triggers each fault. The time
strip on the picture tells the age of the picture that a page shows.
"""

import json
import subprocess
import sys
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from statistics import median
from typing import Any, Final

import pytest
from console_page import ConsolePage, visitors
from playwright.sync_api import Browser, expect
from video_page import PAST_LIVE_MS, READ_STRIP, count, state, strip, wait_until_live
from worlds.free_ports import free_tcp_port
from worlds.processes import CHECKOUT, wait_for

from bench.video.strip import Sight

FILLS_THE_SCREEN: Final = """() => {
  const { width, height } = document.querySelector('[data-testid=video]').getBoundingClientRect();
  return document.fullscreenElement !== null && width >= innerWidth && height >= innerHeight;
}"""
IS_ON_TOP: Final = """(dialog) => {
  const { left, top, width, height } = dialog.getBoundingClientRect();
  return dialog.contains(document.elementFromPoint(left + width / 2, top + height / 2));
}"""


class FakeTower:
    def __init__(self, address: str) -> None:
        self.address = address

    def turn(self, what: str, value: object) -> dict[str, Any]:
        """Calls `fake_video.turn` and returns its response."""
        with urllib.request.urlopen(f"{self.address}/fake/video/{what}/{value}", timeout=5) as answer:
            reported: dict[str, Any] = json.load(answer)
            return reported


@pytest.fixture
def tower(tmp_path: Path) -> Iterator[FakeTower]:
    port = free_tcp_port()
    with (tmp_path / "tower.log").open("wb") as log:
        process = subprocess.Popen(
            [sys.executable, CHECKOUT / "web" / "test" / "fake_tower.py", str(port)], stdout=log, stderr=log
        )
        fake = FakeTower(f"http://127.0.0.1:{port}")
        try:
            wait_for("the fake tower", lambda: answers(fake))
            fake.turn("codecs", "mpeg1")  # no second stream in the middle of a test
            yield fake
        finally:
            process.terminate()
            process.wait(10)


def answers(fake: FakeTower) -> bool:
    try:
        return fake.turn("left_out", 0)["viewers"] == 0
    except OSError:
        return False


@pytest.fixture
def visitor(chromium: Browser, tower: FakeTower) -> Iterator[ConsolePage]:
    with visitors(chromium, tower.address) as come:
        yield come()


def watch(console: ConsolePage, *, large: bool = True) -> None:
    console.sign_in("bob", "any")
    console.open_drone("Heron")
    if large:
        console.part("swap").click()


@pytest.mark.parametrize("codec", ["mpeg1", "h264"])
def test_the_picture_on_the_canvas_is_live_and_its_delay_is_told(
    tower: FakeTower, visitor: ConsolePage, codec: str
) -> None:
    tower.turn("codecs", codec)
    watch(visitor)
    visitor.wait("the codec that both have", lambda: tower.turn("left_out", 0)["codecs"] == [codec])
    visitor.wait("figures", lambda: count(visitor, "rate") > 10)
    wait_until_live(visitor)
    readings: list[Sight | None] = []
    for _ in range(30):
        readings.append(strip(visitor))
        visitor.page.wait_for_timeout(20)
    strips = [one for one in readings if one is not None]
    # A reading may fail only at the moment between two sizes of the canvas.
    assert len(strips) >= 29, readings
    assert median(one.delay_ms for one in strips) < PAST_LIVE_MS
    assert len({one.rendered_ms for one in strips}) > 5, "the picture stands still"
    assert 0 < count(visitor, "delay") < PAST_LIVE_MS
    assert count(visitor, "bits") > 50_000
    assert count(visitor, "lost") == 0
    assert not visitor.part("video-words").count()
    assert not [text for text in visitor.complaints if "401" not in text]


def test_a_lost_camera_is_said_by_name_and_the_picture_comes_back(tower: FakeTower, visitor: ConsolePage) -> None:
    watch(visitor)
    wait_until_live(visitor)
    tower.turn("state", "camera-lost")
    words = visitor.part("video-words")
    expect(words).to_contain_text("Camera of Heron lost since", timeout=1_000)
    expect(visitor.part("video-delay")).to_contain_text("s old")
    expect(visitor.part("video")).to_have_attribute("data-late", "true")
    tower.turn("state", "live")
    expect(words).to_have_count(0)
    wait_until_live(visitor)
    expect(visitor.part("video")).to_have_attribute("data-late", "false")


def test_units_that_never_came_are_counted_and_the_next_key_picture_heals(
    tower: FakeTower, visitor: ConsolePage
) -> None:
    watch(visitor)
    wait_until_live(visitor)
    tower.turn("left_out", 3)
    visitor.wait("the loss", lambda: count(visitor, "lost") == 3)
    wait_until_live(visitor)
    assert count(visitor, "lost") == 3


def test_a_tower_that_refuses_is_asked_again(tower: FakeTower, visitor: ConsolePage) -> None:
    watch(visitor)
    wait_until_live(visitor)
    tower.turn("close_with", 4403)
    expect(visitor.part("video-words")).to_contain_text("The tower gives no video of Heron.")
    assert state(visitor) == "refused"
    tower.turn("close_with", 0)
    expect(visitor.part("video")).to_have_attribute("data-state", "live")
    wait_until_live(visitor)


@pytest.mark.parametrize("codec", ["mpeg1", pytest.param("h264", marks=pytest.mark.long("another codec"))])
def test_a_page_that_is_busy_delays_no_picture(tower: FakeTower, visitor: ConsolePage, codec: str) -> None:
    """The worker goes on with connection, decoder and canvas while the page is busy computing."""
    tower.turn("codecs", codec)
    watch(visitor)
    visitor.wait("the codec that both have", lambda: tower.turn("left_out", 0)["codecs"] == [codec])
    wait_until_live(visitor)
    before = tower.turn("left_out", 0)["drawn"]
    # It leaves the newest two seconds unsaid.
    at_work = visitor.page.evaluate(
        """async ([address, enough]) => {
          const deadline = performance.now() + 60000;
          let drawn = 0;
          while (drawn < enough && performance.now() < deadline) {
            const until = performance.now() + 500;
            while (performance.now() < until);
            const request = new XMLHttpRequest(); // at once: nothing of the page may run in between
            request.open('GET', address, false);
            request.send();
            drawn = JSON.parse(request.responseText).drawn;
          }
          return drawn;
        }""",
        [f"{tower.address}/fake/video/left_out/0", before + 21],
    )
    assert at_work - before > 20


def test_what_can_be_done_with_a_picture_with_the_keyboard_alone(tower: FakeTower, visitor: ConsolePage) -> None:
    watch(visitor)
    wait_until_live(visitor)
    page = visitor.page
    quality = page.get_by_label("Quality of the video of Heron")
    quality.focus()
    page.keyboard.press("End")
    expect(quality).to_have_value("high")
    visitor.wait("640 pixels", lambda: page.evaluate(READ_STRIP, 0)["width"] == 640)
    wait_until_live(visitor)

    save = page.get_by_role("button", name="Save this picture of Heron")
    expect(save).to_be_enabled()  # a key on a disabled button does nothing
    with page.expect_download() as saved:
        save.press("Enter")
    name = saved.value.suggested_filename
    assert name.startswith("Heron-20")
    assert name.endswith("Z.png")
    picture = Path(saved.value.path()).read_bytes()
    assert picture[:8] == b"\x89PNG\r\n\x1a\n"
    assert int.from_bytes(picture[16:20]) == 640
    assert int.from_bytes(picture[20:24]) == 480

    page.get_by_role("button", name="Video of Heron on the full screen").press("Enter")
    visitor.wait("the full screen", lambda: page.evaluate(FILLS_THE_SCREEN))
    wait_until_live(visitor)
    # A confirmation that cannot be seen must not be asked, so it is on top of the picture.
    page.keyboard.press("?")
    dialog = page.get_by_role("dialog")
    expect(dialog).to_be_visible()
    assert page.evaluate(IS_ON_TOP, dialog.element_handle())
    page.keyboard.press("Escape")
    expect(dialog).to_have_count(0)
    page.get_by_role("button", name="Leave full screen").press("Enter")
    visitor.wait("the page again", lambda: page.evaluate("document.fullscreenElement === null"))


def test_a_video_that_is_closed_is_not_asked_for(tower: FakeTower, visitor: ConsolePage) -> None:
    watch(visitor, large=False)
    wait_until_live(visitor)
    assert tower.turn("left_out", 0)["viewers"] == 1
    visitor.open("/#/")
    visitor.wait("nobody", lambda: tower.turn("left_out", 0)["viewers"] == 0)


def test_the_videos_of_a_squad_go_on_beside_each_other(tower: FakeTower, visitor: ConsolePage) -> None:
    """Runs longer than the page's refresh interval for drones, because a refresh must not restart a video."""
    visitor.sign_in("bob", "any")
    expect(visitor.part("squad-row").first).to_be_visible()
    visitor.open("/#/videos")
    tiles = visitor.part("video-tile")
    visitor.wait("several videos", lambda: tiles.count() > 1 and tower.turn("left_out", 0)["viewers"] == tiles.count())
    visitor.page.wait_for_timeout(3_000)
    # A canvas transferred twice would stay black, and its video without statistics.
    for tile in tiles.all():
        video = tile.get_by_test_id("video")
        expect(video).to_have_attribute("data-state", "live")
        expect(video).to_have_attribute("data-late", "false")
        delay = tile.get_by_test_id("video-delay")
        assert float(delay.get_attribute("data-value") or "nan") < PAST_LIVE_MS
    assert tower.turn("left_out", 0)["viewers"] == tiles.count()
    assert not [text for text in visitor.complaints if "401" not in text]
