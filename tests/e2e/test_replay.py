"""The replay of a recorded flight, live charts and the inspector; one tower with one generated flight for all."""

import shutil
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

import pytest
from axe_look import Axe
from console_page import SIMULATOR, ConsolePage, Somebody, visitors
from playwright.sync_api import Browser, expect
from worlds.flight_files import EVENTS_S, METRES_PER_DEGREE, position, telemetry_log, write_flight
from worlds.foreign_logs import dataflash_log, place, ulog_log
from worlds.processes import World

LASTS_S: Final = 90.0


@pytest.fixture(scope="module")
def hangar(prepared_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[World]:
    """A tower that finds a flight of Kestrel on its disk; Kestrel is switched on."""
    folder = tmp_path_factory.mktemp("hangar")
    shutil.copytree(prepared_folder, folder, dirs_exist_ok=True)
    with World(folder, prepared=True) as world:
        people = {"pilot": "alice", "admin": "admin", "drone": "Kestrel"}
        write_flight(folder / "files" / "flights", drone_id=1, began_at=datetime.now(UTC), lasts_s=LASTS_S, **people)
        world.start_tower()
        world.start_simulated("Kestrel", options=SIMULATOR)
        yield world


@pytest.fixture
def come(chromium: Browser, hangar: World) -> Iterator[Somebody]:
    with visitors(chromium, hangar.address) as somebody:
        yield somebody


def at_s(console: ConsolePage) -> float:
    return int(console.part("replay-time").get_attribute("data-ms") or -1) / 1000


def shows(console: ConsolePage, second: float, *, within_s: float = 0.15) -> None:
    console.wait(f"second {second:g}", lambda: abs(at_s(console) - second) <= within_s, timeout_s=20)


def test_a_flight_is_replayed(come: Somebody, axe: Axe) -> None:
    console = come()
    console.open()
    console.sign_in("alice")
    expect(console.part("squad-row").first).to_be_visible()
    console.open("/#/flights")
    console.part("flight-replay").click()
    replay = console.part("replay")
    expect(replay).to_have_attribute("data-whole", "true")
    assert int(replay.get_attribute("data-frames") or 0) > LASTS_S * 45
    keys = console.page.keyboard

    # Scrub: any moment is shown as it was.
    console.part("scrub").fill("35000")
    shows(console, 35.0)
    lat, lon, height, _ = position(35.0)
    console.wait("its height", lambda: abs(console.number("altitude") - height) < 0.1, timeout_s=10)
    off_m = (
        (console.number("latitude") - lat) * METRES_PER_DEGREE,
        (console.number("longitude") - lon) * METRES_PER_DEGREE,
    )
    assert max(map(abs, off_m)) < 0.5
    assert console.word("mode") == "LOITER"
    expect(console.part("replay-holder")).to_contain_text("alice")

    # Jump to the hand-over, and see who had the controls and what the hold did.
    console.part("event").filter(has_text="TOOK control").click()
    shows(console, EVENTS_S["taken"])
    expect(console.part("replay-holder")).to_contain_text("admin")
    keys.press("n")
    shows(console, EVENTS_S["taken"] + 0.01, within_s=0.05)
    keys.press("p")
    keys.press("p")
    console.part("event").filter(has_text="alice moves the sticks").click()
    shows(console, EVENTS_S["sticks"], within_s=0.04)
    keys.press(".")
    shows(console, EVENTS_S["sticks"] + 0.1, within_s=0.04)
    expect(console.part("replay-hand")).to_contain_text("alice")
    expect(console.part("replay-sticks")).to_be_visible()

    # Keys and speed.
    keys.press("Home")
    shows(console, 0.0)
    keys.press("Shift+ArrowRight")
    shows(console, 30.0)
    keys.press("ArrowLeft")
    shows(console, 25.0)
    keys.press("End")
    shows(console, LASTS_S, within_s=0.3)
    keys.press("Home")
    console.part("speed").select_option("16")
    console.part("play").click()
    console.wait("16 times as fast", lambda: at_s(console) > 40, timeout_s=20)
    console.part("play").click()
    expect(console.part("play")).to_have_attribute("data-playing", "false")

    # Charts: height and speed at first, and any other field.
    expect(console.part("chart-curve")).to_have_count(2)
    console.part("chart-message").select_option(label="VIBRATION")
    console.part("chart-field").select_option(index=2)
    expect(console.part("chart-curve")).to_have_count(3)
    expect(console.part("chart-plot")).to_have_attribute("data-curves", "3")
    axe.look(console, "replay")

    # A link is an address of this moment: for those who may see the flight.
    console.part("event").filter(has_text="Battery low").first.click()
    shows(console, EVENTS_S["alert"])
    console.part("share").click()
    shared = console.part("share")
    expect(shared).to_have_attribute("data-shared", f"{console.address}/#/flights/1/{EVENTS_S['alert']:.1f}")
    address = (shared.get_attribute("data-shared") or "").removeprefix(console.address)
    console.open("/#/")
    console.page.goto(console.address + address)
    shows(console, EVENTS_S["alert"])
    stranger = come()
    stranger.open()
    stranger.sign_in("bob")
    expect(stranger.part("squad-row").first).to_be_visible()
    stranger.open(address)
    expect(stranger.part("replay-problem")).to_contain_text("no such")
    stranger.complaints.clear()  # the browser says that an answer was 404


def test_a_file_of_the_persons_own_is_replayed(come: Somebody, axe: Axe, tmp_path: Path) -> None:
    console = come()
    console.open()
    console.sign_in("bob")
    expect(console.part("squad-row").first).to_be_visible()
    console.open("/#/flights/file")
    axe.look(console, "own-file")
    file = tmp_path / "from elsewhere.tlog"
    file.write_bytes(telemetry_log(datetime.now(UTC).timestamp(), 30.0, 10))
    console.part("own-file").set_input_files(file)
    expect(console.part("replay")).to_have_attribute("data-whole", "true")
    console.page.keyboard.press("End")
    shows(console, 30.0, within_s=0.3)
    console.wait("its height", lambda: abs(console.number("altitude") - position(29.9)[2]) < 0.5, timeout_s=10)
    expect(console.part("event").filter(has_text="Takeoff to 40 m")).to_be_visible()


def test_live_charts_and_the_inspector(come: Somebody, axe: Axe) -> None:
    console = come()
    console.open()
    console.sign_in("alice")
    console.open_drone("Kestrel")
    console.part("telemetry").click()
    expect(console.part("chart-curve")).to_have_count(2)
    console.part("telemetry-view").get_by_text("Messages", exact=True).click()
    attitude = console.page.locator("[data-testid=message-row][data-name=ATTITUDE]")
    console.wait("a rate", lambda: float(attitude.get_attribute("data-rate") or 0) > 1, timeout_s=20)
    attitude.get_by_role("button").click()
    expect(console.part("message-fields")).to_contain_text("rollspeed")
    axe.look(console, "inspector")
    console.page.locator("[data-testid=chart-this][data-field=pitch]").click()
    expect(console.part("chart-curve")).to_have_count(3)
    expect(console.part("chart-plot")).to_have_attribute("data-curves", "3")
    console.part("telemetry-pause").click()
    expect(console.part("live-telemetry")).to_contain_text("Paused")
    axe.look(console, "live-charts")
    console.part("telemetry").click()
    expect(console.part("live-telemetry")).to_have_count(0)


def test_flights_of_other_programs_are_imported_and_two_replayed_beside_each_other(
    come: Somebody, axe: Axe, tmp_path: Path
) -> None:
    console = come()
    console.open()
    console.sign_in("alice")
    expect(console.part("squad-row").first).to_be_visible()
    console.open("/#/flights")
    bad = tmp_path / "picture.bin"
    bad.write_bytes(b"GIF89a" * 100)
    console.part("import-file").set_input_files(bad)
    expect(console.part("import-problem")).to_contain_text("no flight file that the tower knows")
    console.complaints.clear()  # the browser says that an answer was 422
    for name, log in (("00000001.bin", dataflash_log(40)), ("log_0.ulg", ulog_log(30))):
        (tmp_path / name).write_bytes(log)
        console.part("import-file").set_input_files(tmp_path / name)
        expect(console.part("import-row").filter(has_text=name)).to_be_visible(timeout=30_000)
    axe.look(console, "imported-flights")
    console.part("import-row").filter(has_text="00000001.bin").get_by_test_id("import-replay").click()
    expect(console.part("replay")).to_have_attribute("data-whole", "true")
    # The log begins a second after boot.
    console.part("scrub").fill("24000")
    shows(console, 24.0)
    console.wait("its height", lambda: abs(console.number("altitude") - place(25.0)[2]) < 0.3, timeout_s=10)
    console.wait("its mode", lambda: console.word("mode") == "AUTO", timeout_s=10)
    expect(console.part("event").filter(has_text="ArduPlane V4.6.0")).to_be_visible()

    # The recorded flight beside it: both at the same time after take-off.
    console.part("replay-beside").click()
    console.part("beside-1").click()
    beside = console.part("beside")
    expect(beside).to_be_visible(timeout=20_000)
    expect(console.part("beside-name")).to_contain_text("Kestrel")
    console.part("scrub").press("Home")
    shows(console, 0.0)  # the timeline begins with the flight that begins first
    later_s = float(beside.get_attribute("data-later-ms") or 0) / 1000
    assert later_s != 0
    console.wait("both flights", lambda: console.part("replay").get_attribute("data-whole") == "true", timeout_s=20)
    # Take-off is at 1.5 m: of the log after 5.75 s, of the recorded flight after 7.4 s (4 m/s).
    recorded_s = EVENTS_S["take-off"] + 0.4
    since = console.part("beside-time")

    def heights() -> tuple[float, float]:
        first, other = (console.part(f"beside-height-{at}").get_attribute("data-m") for at in (0, 1))
        return float(first or -1), float(other or -1)

    def are_where_they_were() -> bool:
        """Both, at the moment that is on view now: a jump may be under way."""
        words = since.text_content() or ""
        minutes, seconds = words.removeprefix("-").split(":")
        after_s = (60 * int(minutes) + float(seconds)) * (-1 if words.startswith("-") else 1)
        wanted = place(5.75 + after_s)[2], position(recorded_s + after_s)[2]
        return after_s > 5 and heights() == pytest.approx(wanted, abs=0.6)

    for _ in range(4):
        console.page.keyboard.press("ArrowRight")
    shows(console, 20.0)
    console.wait("both heights", are_where_they_were, timeout_s=10)
    axe.look(console, "two-flights")
    # Beyond the end of the shorter one, which stays as it was.
    console.page.keyboard.press("End")
    console.wait("the end of the longer one", lambda: heights() == pytest.approx((70, 40), abs=0.5), timeout_s=10)
    console.page.go_back()
    expect(console.part("beside")).to_have_count(0)
