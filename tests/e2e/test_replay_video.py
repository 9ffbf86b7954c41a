"""The video of a replayed flight is in step with the replay: each picture says when it was taken."""

import shutil
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Final

import pytest
from console_page import ConsolePage, Somebody, visitors
from playwright.sync_api import Browser, expect
from worlds.clock_film import READ_PICTURE, write_recording
from worlds.flight_files import EVENTS_S, write_flight
from worlds.processes import DATABASE, World

LASTS_S: Final = 90.0
FILM_S: Final = (10.0, 85.0)
"""When the first picture was taken and the recording ended, by the replay's clock."""
LATE_S: Final = 4.0
"""For so long the recording went on before the camera sent a picture."""
IN_STEP_S: Final = 0.1

WATCH: Final = f"""async ([frames, beganS]) => {{
  const video = document.querySelector('[data-testid=replay-video]');
  const clock = document.querySelector('[data-testid=replay-time]');
  const pictureS = ({READ_PICTURE})(video);
  const seen = [];
  let before = performance.now();
  for (let left = frames; left > 0; left -= 1) {{
    const now = await new Promise(requestAnimationFrame);
    seen.push([now - before, Number(clock.dataset.ms) / 1000 - beganS - pictureS()]);
    before = now;
  }}
  return seen;
}}"""
"""For so many frames of the browser: how many milliseconds it took, and how many seconds the replay's clock is ahead of
the picture."""
STALL_MS: Final = 100
"""The browser of a busy machine stops now and then, and the video goes on: afterwards it has a second to catch up."""
CALM_MS: Final = 1000


@pytest.fixture(scope="module")
def hangar(prepared_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[World]:
    """A tower that finds a flight of Kestrel on its disk, and a recording of its video."""
    folder = tmp_path_factory.mktemp("hangar")
    shutil.copytree(prepared_folder, folder, dirs_exist_ok=True)
    with World(folder, prepared=True) as world:
        people = {"pilot": "alice", "admin": "admin", "drone": "Kestrel"}
        armed_at = datetime.now(UTC)
        write_flight(folder / "files" / "flights", drone_id=1, began_at=armed_at, lasts_s=LASTS_S, **people)
        film_at = armed_at + timedelta(seconds=FILM_S[0] - LATE_S - EVENTS_S["armed"])
        lasts_s = FILM_S[1] - FILM_S[0] + LATE_S
        write_recording(
            folder / DATABASE, folder / "files", drone_id=1, began_at=film_at, lasts_s=lasts_s, late_s=LATE_S
        )
        world.start_tower()
        yield world


@pytest.fixture
def come(chromium: Browser, hangar: World) -> Iterator[Somebody]:
    with visitors(chromium, hangar.address) as somebody:
        yield somebody


def apart_s(console: ConsolePage) -> float:
    ((_, apart),) = console.page.evaluate(WATCH, [1, FILM_S[0]])
    return float(apart)


def at_s(console: ConsolePage) -> float:
    return int(console.part("replay-time").get_attribute("data-ms") or -1) / 1000


def stands_in_step(console: ConsolePage) -> None:
    """Waits for a seek to settle, then looks again."""
    console.wait("the picture of this moment", lambda: abs(apart_s(console)) <= IN_STEP_S, timeout_s=20)
    assert abs(apart_s(console)) <= IN_STEP_S


def calm(seen: list[tuple[float, float]]) -> list[float]:
    """How far apart clock and picture were, without the second after a stall of the browser."""
    found, calm_ms = [], 0.0
    for frame_ms, apart in seen:
        calm_ms = 0.0 if frame_ms > STALL_MS else calm_ms + frame_ms
        if calm_ms >= CALM_MS:
            found.append(apart)
    return found


def replayed(come: Somebody) -> ConsolePage:
    console = come()
    console.open()
    console.sign_in("alice")
    expect(console.part("squad-row").first).to_be_visible()
    console.open("/#/flights")
    console.part("flight-replay").click()
    expect(console.part("replay")).to_have_attribute("data-whole", "true")
    return console


def test_the_picture_is_of_the_moment_that_is_scrubbed_or_jumped_to(come: Somebody) -> None:
    console = replayed(come)
    for wanted_s in (12.34, 61.0, 61.48, 20.02):
        console.part("scrub").fill(f"{wanted_s * 1000:.0f}")
        console.wait(f"second {wanted_s}", lambda wanted_s=wanted_s: abs(at_s(console) - wanted_s) <= 0.15)
        stands_in_step(console)
    console.part("event").filter(has_text="TOOK control").click()
    console.wait("the hand-over", lambda: abs(at_s(console) - EVENTS_S["taken"]) <= 0.04)
    stands_in_step(console)
    console.page.keyboard.press(".")
    console.wait("a tenth of a second later", lambda: abs(at_s(console) - EVENTS_S["taken"] - 0.1) <= 0.04)
    stands_in_step(console)


@pytest.mark.parametrize("speed", [1, pytest.param(4, marks=pytest.mark.long("another speed"))])
def test_the_video_plays_in_step(come: Somebody, speed: int) -> None:
    console = replayed(come)

    def plays_in_step() -> bool:
        """Nearly all pictures within a tenth of a second of the person who looks (at 4x that is 0.4 s of flight), and
        in the middle within a tenth of a second of flight."""
        console.part("scrub").fill("15000")
        console.wait("second 15", lambda: abs(at_s(console) - 15) <= 0.15)
        stands_in_step(console)
        console.part("speed").select_option(str(speed))
        console.part("play").click()
        apart = calm(console.page.evaluate(WATCH, [240, FILM_S[0]]))
        console.part("play").click()
        if len(apart) < 60:
            print(f"{speed}x: {len(apart)} calm frames")
            return False
        near = sum(abs(one) <= IN_STEP_S * speed for one in apart) / len(apart)
        middle = sorted(apart)[len(apart) // 2]
        print(f"{speed}x: {len(apart)} frames, {near:.0%} in step, median {middle:.3f} s")
        return near >= 0.9 and abs(middle) <= IN_STEP_S

    console.wait(f"video in step at {speed}x", plays_in_step, timeout_s=60)
