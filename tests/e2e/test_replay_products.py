"""What a replayed flight gives besides its files: step responses, and its video with a burnt-in flight display."""

import shutil
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Final

import pytest
from console_page import Somebody, visitors
from playwright.sync_api import Browser, Route, expect
from test_identification import SYSTEMS, frames
from worlds.clock_film import write_recording
from worlds.flight_files import EVENTS_S, write_flight
from worlds.processes import DATABASE, World

from server.flights.core.tlog import STAMP, read_entries
from wire.dialect import mavlink
from wire.frames import message_id

LASTS_S: Final = 100.0
FILM_S: Final = 0.4
KEPT: Final = (mavlink.MAVLINK_MSG_ID_HEARTBEAT, mavlink.MAVLINK_MSG_ID_SYS_STATUS)


def fly_known_systems(log: Path) -> None:
    """Replaces the way of the flight by sticks, and by the answers of systems that are known."""
    with log.open("rb") as file:
        kept = [(entry.at_us, entry.frame) for entry in read_entries(file)]
    flown = frames()
    shift_us = kept[0][0] + 1_000_000 - flown[0][0]
    merged = [one for one in kept if message_id(one[1]) in KEPT] + [(at_us + shift_us, one) for at_us, one in flown]
    merged.sort(key=lambda one: one[0])
    log.write_bytes(b"".join(STAMP.pack(at_us) + frame for at_us, frame in merged))


@pytest.fixture(scope="module")
def hangar(prepared_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[World]:
    """A tower that finds a flight of Kestrel on its disk, and a recording of its video."""
    folder = tmp_path_factory.mktemp("hangar")
    shutil.copytree(prepared_folder, folder, dirs_exist_ok=True)
    with World(folder, prepared=True) as world:
        people = {"pilot": "alice", "admin": "admin", "drone": "Kestrel"}
        armed_at = datetime.now(UTC)
        flights = folder / "files" / "flights"
        stem = write_flight(flights, drone_id=1, began_at=armed_at, lasts_s=LASTS_S, hz=2, **people)
        fly_known_systems(flights / "drone-1" / f"{stem}.tlog")
        film_at = armed_at + timedelta(seconds=30 - EVENTS_S["armed"])
        write_recording(folder / DATABASE, folder / "files", drone_id=1, began_at=film_at, lasts_s=FILM_S)
        world.start_tower()
        yield world


@pytest.fixture
def come(chromium: Browser, hangar: World) -> Iterator[Somebody]:
    with visitors(chromium, hangar.address) as somebody:
        yield somebody


def with_patterned_roll(route: Route) -> None:
    """As if something had blown the drone about: of the axes of this flight each acts as the model does."""
    found = route.fetch(timeout=120_000).json()
    for axis in found["axes"]:
        if axis["fit"] is not None:
            axis["fit"]["is_patterned"] = axis["axis"] == "roll"
    route.fulfill(json=found)


def test_step_responses_and_the_video_with_a_flight_display(come: Somebody) -> None:
    console = come()
    console.open()
    console.sign_in("alice")
    expect(console.part("squad-row").first).to_be_visible()
    console.open("/#/flights")
    console.part("flight-replay").click()
    console.page.route("**/identification", with_patterned_roll)
    console.part("steps").click()
    table = console.part("step-table")
    expect(table).to_have_attribute("data-axes", str(len(SYSTEMS)), timeout=120_000)
    gain, tau_s, _ = SYSTEMS["roll"]
    row = table.locator("tbody tr").first.locator("td")
    assert float(row.nth(0).inner_text().split()[0]) == pytest.approx(gain, rel=0.06)
    assert float(row.nth(1).inner_text().split()[0]) == pytest.approx(tau_s, abs=0.03)
    expect(console.part("step-patterned")).to_contain_text("Roll: what the model leaves is no noise.")
    expect(console.part("step-plot").locator("canvas")).to_be_visible()
    console.part("tab-climb").click()
    console.part("step-manoeuvre").select_option("2")
    console.part("step-seek").click()
    expect(console.part("step-responses")).to_have_count(0)

    console.part("replay-download").click()
    console.part("display-video").click()
    console.part("make-display-video").click()
    expect(console.part("display-video-row")).to_have_attribute("data-state", "ready", timeout=60_000)
    with console.page.expect_download() as started:
        console.part("display-video-file").click()
    assert started.value.suggested_filename.endswith("-display.mp4")
    assert started.value.path().stat().st_size > 1_000
