"""A recording with a burnt-in flight display: what is shown when, and what can be read from the finished pictures."""

from __future__ import annotations

import asyncio
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

import av
import numpy as np
import pytest
from hub_world import LATER
from PIL import Image, ImageDraw
from worlds import clock_film, flight_files

from server.flights.core.index import entry_of
from server.flights.core.tlog import read_entries
from server.flights.core.videos.display_values import (
    STALE_SLOW_US,
    STALE_US,
    DisplayTimeline,
    DisplayValues,
    in_order,
)
from server.flights.core.videos.refusals import FlightVideoNotMade, FlightVideosBusy
from server.flights.store.videos import service
from server.flights.store.videos.drawing import Display, Field, Picture, fields, plain
from server.flights.store.videos.service import FlightVideos, Sources
from server.kernel.people import Principal, Role
from wire.ids import UserId

ARMED: Final = datetime(2026, 5, 1, 12, tzinfo=UTC)
BEGUN_US: Final = round((ARMED - timedelta(seconds=flight_files.EVENTS_S["armed"])).timestamp() * 1e6)
FILM_AT_S: Final = 39.0
"""When the film begins, in seconds of the flight: a second before the admin takes the drone."""
FILM_S: Final = 2.4
SIZE: Final = clock_film.WIDTH, clock_film.HEIGHT


def us(at_s: float) -> int:
    return BEGUN_US + round(at_s * 1e6)


@pytest.fixture(scope="module")
def sources(tmp_path_factory: pytest.TempPathFactory) -> Sources:
    folder = tmp_path_factory.mktemp("flight")
    people = {"drone": "Kestrel", "pilot": "Ágnes", "admin": "boss"}
    stem = flight_files.write_flight(folder, drone_id=1, began_at=ARMED, lasts_s=70.0, **people)
    pictures = clock_film.write_film(folder / "film.mp4", FILM_S)
    place = folder / "drone-1" / stem
    return Sources(
        folder / "film.mp4", place.with_suffix(".tlog"), place.with_suffix(".jsonl"), us(FILM_AT_S), pictures
    )


@pytest.fixture(scope="module")
def short(sources: Sources, tmp_path_factory: pytest.TempPathFactory) -> Sources:
    """The same flight with a film of eight pictures."""
    film = tmp_path_factory.mktemp("short") / "film.mp4"
    return replace(sources, recording=film, pictures=clock_film.write_film(film, 8 / clock_film.PICTURES_S))


@pytest.fixture
def timeline(sources: Sources) -> Iterator[DisplayTimeline]:
    lines = [entry_of(line) for line in sources.index.read_bytes().splitlines()]
    with sources.telemetry.open("rb") as file:
        yield DisplayTimeline(read_entries(file), in_order(lines))


def test_each_moment_has_its_own_values(timeline: DisplayTimeline) -> None:
    before = timeline.at(us(-1.0))
    assert before == DisplayValues(us(-1.0))
    climbing = timeline.at(us(12.0))
    assert climbing.height_m == pytest.approx(20.0, abs=0.5)
    assert (climbing.mode, climbing.holder, climbing.hold, climbing.link) == ("GUIDED", "Ágnes", "", "LINK 48 ms, 1 %")
    by_hand = timeline.at(us(30.0))
    assert by_hand.mode == "LOITER"
    assert by_hand.roll_deg == pytest.approx(12 * np.sin(10.0), abs=0.5)
    assert by_hand.heading_deg == pytest.approx(flight_files.position(30.0)[3], abs=0.5)
    assert by_hand.battery_percent == 100
    assert by_hand.battery_v == pytest.approx(16.785)
    taken = timeline.at(us(40.5))
    assert (taken.holder, taken.hold) == ("boss", "HOLD")
    assert timeline.at(us(59.0)).link == "LINK LOST"
    assert timeline.at(us(61.5)).link == "LINK"


def test_what_was_heard_too_long_ago_is_not_shown(timeline: DisplayTimeline) -> None:
    last_s = 69.9
    known = timeline.at(us(last_s) + STALE_US)
    assert known.height_m is not None
    gone = timeline.at(us(last_s) + STALE_US + 200_000)
    assert (gone.height_m, gone.roll_deg, gone.heading_deg) == (None, None, None)
    assert gone.mode == "GUIDED", "it comes once a second"
    assert timeline.at(us(last_s) + 2 * STALE_SLOW_US).mode == ""


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ({"kind": "hold", "step": "unconfirmed"}, "HOLD NOT CONFIRMED"),
        ({"kind": "hold", "step": "not_needed"}, ""),
        ({"kind": "sticks"}, ""),
        ({"kind": "command", "state": "running"}, ""),
        ({"kind": "command", "state": "done"}, "HOLD"),
        ({"kind": "disarmed"}, ""),
        ({"kind": "something new"}, "HOLD"),
    ],
)
def test_a_hold_is_shown_until_somebody_flies(line: dict[str, Any], words: str) -> None:
    shown = DisplayTimeline([], [{"at_us": 1, "kind": "hold", "step": "ordered"}, {"at_us": 2, **line}])
    assert shown.at(1).hold == "HOLD"
    assert shown.at(2).hold == words


def test_what_is_not_known_is_said() -> None:
    texts = {field.name: field.text for field in fields(DisplayValues(us(0)))}
    assert texts == {
        "time": "2026-05-01 11:59:55.0 UTC",
        "heading": "HDG --",
        "mode": "--",
        "height": "H -- m",
        "speed": "GS -- m/s",
        "holder": "Controls: nobody",
        "battery": "BAT -- % -- V",
        "link": "LINK --",
        "hold": "",
    }
    assert plain("Ágnes Żółć 龍") == "Agnes Zo?c ?"


@pytest.mark.parametrize("size", [(160, 120), (320, 240), (640, 480), (1920, 1080)])
def test_no_text_covers_another_or_leaves_the_picture(size: tuple[int, int]) -> None:
    values = DisplayValues(
        us(0), -123.4, 45.6, 359.0, 12.0, -5.0, 16.8, 100, "GUIDED_NOGPS", "x" * 60, "LINK 1234 ms, 100 %"
    )
    display = Display(*size)
    boxes = {field.name: display.box(field) for field in fields(replace(values, hold="HOLD NOT CONFIRMED"))}
    for left, upper, right, lower in boxes.values():
        assert left >= 0 <= upper
        assert right <= size[0]
        assert lower <= size[1]
    if size[0] < 320:
        return  # a picture of a thumb's size has no room for a long name
    for row in (("time", "mode"), ("height", "heading", "battery"), ("speed", "link")):
        for one, other in pairwise(row):
            assert boxes[one][2] <= boxes[other][0], (one, other)


def test_the_horizon_tilts_against_the_roll_and_sinks_as_the_nose_rises() -> None:
    display, black = Display(*SIZE), np.zeros((SIZE[1], SIZE[0], 3), np.uint8)

    def heights(roll_deg: float, pitch_deg: float) -> tuple[float, float]:
        """The rows of the horizon at the left and the right of the middle."""
        drawn = display.draw(black, DisplayValues(0, roll_deg=roll_deg, pitch_deg=pitch_deg))
        found = []
        for column in (SIZE[0] // 2 - 55, SIZE[0] // 2 + 55):
            green = drawn[30:200, column, 1].astype(int) - drawn[30:200, column, 0]
            found.append(30 + float(np.argmax(green)))
        return found[0], found[1]

    level = heights(0.0, 0.0)
    assert level == pytest.approx((SIZE[1] / 2, SIZE[1] / 2), abs=2)
    right_down = heights(20.0, 0.0)
    assert right_down[0] > level[0] + 10 > right_down[1] + 20, "its right end rises"
    assert heights(0.0, 10.0)[0] > level[0] + 10


def made(sources: Sources, target: Path, max_bytes: int = 10_000_000) -> tuple[int, str]:
    """The program itself, with its limits. Returns its exit code and its last line."""
    paths = (sources.recording, sources.telemetry, sources.index, sources.began_us, target, max_bytes)
    program = (sys.executable, "-m", "server.flights.store.videos.make_display_video", *map(str, paths))
    with subprocess.Popen(program, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        lines = process.stdout.read().splitlines()
    return process.returncode, lines[-1] if lines else ""


@cache
def _drawn(text: str, field: Field) -> Picture:
    """How the text looks alone, on grey."""
    grey = np.full((SIZE[1], SIZE[0], 3), 128, np.uint8)
    display = Display(*SIZE)
    image = Image.fromarray(grey)
    display._text(ImageDraw.Draw(image), field._replace(text=text))
    return np.asarray(image)


def read_text(picture: Picture, field: Field, candidates: list[str]) -> str:
    """Which of the candidates is burnt in at the place of the field."""
    display = Display(*SIZE)
    boxes = [display.box(field._replace(text=one)) for one in candidates]
    left, upper = min(box[0] for box in boxes), boxes[0][1]
    right, lower = max(box[2] for box in boxes), boxes[0][3]
    there = picture[upper:lower, left:right].astype(float)
    apart = [np.abs(there - _drawn(one, field)[upper:lower, left:right]).mean() for one in candidates]
    return candidates[int(np.argmin(apart))]


def test_the_values_of_each_moment_are_burnt_in_and_no_picture_is_lost(sources: Sources, tmp_path: Path) -> None:
    code, said = made(sources, tmp_path / "made.mp4")
    assert (code, f'"pictures": {sources.pictures}' in said) == (0, True), said
    with av.open(str(sources.recording)) as film:
        times = [(frame.pts or 0) * (frame.time_base or 0) for frame in film.decode(video=0)]
    with av.open(str(tmp_path / "made.mp4")) as film:
        stream = film.streams.video[0]
        assert (stream.codec_context.name, stream.codec_context.pix_fmt) == ("h264", "yuv420p")
        frames = list(film.decode(stream))
    assert [(frame.pts or 0) * (frame.time_base or 0) for frame in frames] == times

    places = {field.name: field for field in fields(DisplayValues(0, hold="HOLD"))}
    holders = ["Controls: Agnes", "Controls: boss", "Controls: nobody"]
    for number in range(0, sources.pictures, 9):
        picture = np.asarray(frames[number].to_ndarray(format="rgb24"), np.uint8)
        at_s = number / clock_film.PICTURES_S
        degrees = [f"HDG {angle:03d}" for angle in range(360)]
        heading = int(read_text(picture, places["heading"], degrees)[4:])
        assert heading == pytest.approx(flight_files.position(FILM_AT_S + at_s)[3], abs=1.0), number
        is_taken = FILM_AT_S + at_s >= flight_files.EVENTS_S["taken"]
        assert read_text(picture, places["holder"], holders) == holders[is_taken], number
        assert read_text(picture, places["mode"], ["LOITER", "GUIDED", "--"]) == ("GUIDED" if is_taken else "LOITER")
        ink = picture[40:60, SIZE[0] // 2 - 30 : SIZE[0] // 2 + 30].astype(int)
        assert bool(((ink[..., 0] - ink[..., 1]) > 60).any()) is is_taken, "HOLD in red"
        gray = "".join(
            "1" if shade > 126 else "0" for shade in picture[34, clock_film.BLOCK // 2 :: clock_film.BLOCK, 0]
        )
        assert int(gray, 2) == number ^ number >> 1, "the picture itself is that of its time"


def test_a_file_that_is_none_or_becomes_too_large_is_refused_with_words(short: Sources, tmp_path: Path) -> None:
    (tmp_path / "no.mp4").write_bytes(b"nothing at all")
    code, said = made(replace(short, recording=tmp_path / "no.mp4"), tmp_path / "made.mp4")
    assert (code, "Invalid data" in said) == (1, True), said
    code, said = made(short, tmp_path / "large.mp4", max_bytes=2_000)
    assert (code, "too large" in said) == (1, True), said
    assert (tmp_path / "large.mp4").stat().st_size <= 2_000


def person(number: int) -> Principal:
    return Principal(UserId(number), f"user {number}", Role.OPERATOR, number, LATER)


async def until(videos: FlightVideos, key: tuple[int, int], state: str) -> None:
    async with asyncio.timeout(60):
        while videos.view(key).state != state:  # noqa: ASYNC110
            await asyncio.sleep(0.01)


async def test_it_is_made_once_kept_for_its_time_and_gone_afterwards(short: Sources, tmp_path: Path) -> None:
    root = tmp_path / "videos"
    root.mkdir()
    (root / "left.mp4").touch()
    videos = FlightVideos(root)
    await videos.sweep()
    key, other = (1, 2), (1, 3)
    with pytest.raises(FlightVideoNotMade):
        videos.view(key)
    begun = await videos.begin(key, short, person(1))
    assert (begun.state, begun.done) == ("waiting", 0.0)
    assert (await videos.begin(key, short, person(2))).flight_id == 1, "the one that there is"
    with pytest.raises(FlightVideosBusy):
        await videos.begin(other, short, person(1))
    with pytest.raises(FlightVideoNotMade):
        videos.path(key)
    await until(videos, key, "ready")
    path = videos.path(key)
    assert (videos.view(key).done, videos.view(key).size_bytes) == (1.0, path.stat().st_size)
    assert list(root.iterdir()) == [path]
    await videos.close()
    assert list(root.iterdir()) == []
    with pytest.raises(FlightVideoNotMade):
        videos.view(key)


async def test_one_that_failed_says_why_and_may_be_made_again(short: Sources, tmp_path: Path) -> None:
    videos, key = FlightVideos(tmp_path / "videos", kept_s=0.2), (1, 2)
    await videos.begin(key, replace(short, recording=tmp_path / "none.mp4"), person(1))
    await until(videos, key, "failed")
    assert videos.view(key).words == "No such file or directory"
    assert (await videos.begin(key, replace(short, recording=tmp_path / "none.mp4"), person(1))).state == "waiting"
    async with asyncio.timeout(30):
        while True:
            try:
                videos.view(key)
            except FlightVideoNotMade:
                break
            await asyncio.sleep(0.02)
    await videos.close()


async def test_the_number_of_videos_is_bounded(short: Sources, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(service, "MAX_VIDEOS", 2)
    made_now = asyncio.Event()

    async def run(video: Any, of: Sources, max_bytes: int) -> dict[str, Any]:
        await made_now.wait()
        video.path.touch()
        return {"size_bytes": 1}

    monkeypatch.setattr(service, "_run", run)
    videos = FlightVideos(tmp_path / "videos")
    await videos.begin((1, 1), short, person(1))
    await videos.begin((1, 2), short, person(2))
    with pytest.raises(FlightVideosBusy, match="too many"):
        await videos.begin((1, 3), short, person(3))
    made_now.set()
    for key in ((1, 1), (1, 2)):
        await until(videos, key, "ready")
    oldest = videos.path((1, 1))
    await videos.begin((1, 3), short, person(3))
    await until(videos, (1, 3), "ready")
    with pytest.raises(FlightVideoNotMade):
        videos.view((1, 1))
    assert not oldest.exists()
    assert videos.view((1, 2)).state == "ready"
    await videos.close()
