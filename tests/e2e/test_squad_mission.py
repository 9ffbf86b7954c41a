"""A field split among three drones in the browser: drawn, checked, sent, flown simultaneously with safe separation."""

import json
import math
import shutil
from collections.abc import Iterator
from itertools import combinations
from pathlib import Path
from typing import Final

import pytest
from console_page import METRES_PER_DEGREE, ConsolePage, Somebody
from playwright.sync_api import WebSocket, expect
from worlds.processes import World

from wire.dialect import decode
from wire.tagged import split_tagged

HAS_MAP = True

SQUAD: Final = {1: "Kestrel", 3: "Osprey", 4: "Plover"}
KEPT_APART_M: Final = 15.0
"""Minimum separation of the plan check, and of the separation watch: the drones start 20 m apart."""
AUTO: Final = 3
"""The mode in which ArduCopter flies its mission."""
SAME_HEIGHT_M: Final = 10.0
FIELD: Final = ((0.40, 0.28), (0.72, 0.28), (0.72, 0.42), (0.40, 0.42))
"""Corners, as fractions of the map."""


@pytest.fixture
def quiet_world(tmp_path: Path, prepared_folder: Path) -> Iterator[World]:
    """A tower where alice has three drones."""
    shutil.copytree(prepared_folder, tmp_path, dirs_exist_ok=True)
    with World(tmp_path, prepared=True) as world:
        assert world.add_drone("Osprey", "alice") == 3
        assert world.add_drone("Plover", "alice") == 4
        world.start_tower()
        yield world


@pytest.fixture
def world(quiet_world: World) -> World:
    # At twice real speed, an interval set here between two starts is twice as long in the flight.
    quiet_world.start_simulated(
        *SQUAD.values(), options=("--boot-s", "1", "--seed", "7", "--speed", "2", "--real-rates")
    )
    quiet_world.wait_until_online(quiet_world.visitor("admin"), *SQUAD)
    return quiet_world


class Sky:
    """Positions of the drones from a page's live channel; the smallest distance of any two in the air, and the distance
    that each flew."""

    def __init__(self, console: ConsolePage) -> None:
        self.places: dict[int, tuple[float, float, float]] = {}
        self.nearest_m = math.inf
        self.highest_m = dict.fromkeys(SQUAD, 0.0)
        self.way_m = dict.fromkeys(SQUAD, 0.0)
        self.speeds_m_s = dict.fromkeys(SQUAD, math.inf)
        self.modes: dict[int, int] = {}
        self.reported: list[dict[str, object]] = []
        console.page.on("websocket", self._watch)

    def _watch(self, socket: WebSocket) -> None:
        socket.on("framereceived", self._received)

    def _received(self, message: str | bytes) -> None:
        if isinstance(message, str):
            event = json.loads(message)
            if event["type"] == "separation":
                self.reported.append(event)
            return
        for drone_id, frame in split_tagged(message):
            said = decode(frame)
            if said is None or drone_id not in SQUAD:
                continue
            if said.get_type() == "HEARTBEAT" and said.get_srcComponent() == 1:
                self.modes[drone_id] = said.custom_mode
            if said.get_type() == "GLOBAL_POSITION_INT":
                self.speeds_m_s[drone_id] = math.hypot(said.vx, said.vy) / 100
                self._moved(drone_id, said.lat / 1e7, said.lon / 1e7, said.relative_alt / 1000)

    def _moved(self, drone_id: int, lat_deg: float, lon_deg: float, up_m: float) -> None:
        here = (lat_deg, lon_deg, up_m)
        if drone_id in self.places:
            self.way_m[drone_id] += _over_ground_m(self.places[drone_id], here)
        self.places[drone_id] = here
        self.highest_m[drone_id] = max(self.highest_m[drone_id], up_m)
        flying = [place for place in self.places.values() if place[2] > 2.0]
        for one, other in combinations(flying, 2):
            if abs(one[2] - other[2]) < SAME_HEIGHT_M:
                self.nearest_m = min(self.nearest_m, _over_ground_m(one, other))

    def all_landed(self) -> bool:
        return all(place[2] < 0.5 for place in self.places.values())


def _over_ground_m(one: tuple[float, float, float], other: tuple[float, float, float]) -> float:
    north = (other[0] - one[0]) * METRES_PER_DEGREE
    east = (other[1] - one[1]) * METRES_PER_DEGREE * math.cos(math.radians(one[0]))
    return math.hypot(north, east)


def draw_field(console: ConsolePage) -> None:
    # The field goes where the map shows it. The map moves to the squad by itself once the positions are known.
    console.wait("the map at the squad", lambda: abs(float(_shown(console, "lat")) - 47.3977) < 0.01)
    box = console.page.locator(".maplibregl-canvas").bounding_box()
    assert box is not None
    for number, (across, down) in enumerate(FIELD, 1):
        console.page.mouse.click(box["x"] + box["width"] * across, box["y"] + box["height"] * down)
        expect(console.part("squad-corners")).to_have_attribute("data-value", str(number))


def _shown(console: ConsolePage, name: str) -> str:
    return console.part("map").get_attribute(f"data-{name}") or "0"


def confirm_all(console: ConsolePage) -> None:
    """Confirms the one dialog that names all of them."""
    for name in SQUAD.values():
        expect(console.page.get_by_role("dialog")).to_contain_text(name)
    console.confirm("Plover")


def answers(console: ConsolePage, attribute: str) -> list[str]:
    return [part.get_attribute(f"data-{attribute}") or "" for part in console.part("squad-part").all()]


def plan_and_upload(console: ConsolePage) -> None:
    """Draws a field on the squad's page, splits it and uploads it to all three."""
    console.part("choose-all").check()
    console.part("squad-mission-link").click()
    for drone_id, name in SQUAD.items():
        expect(console.part("squad-member").and_(console.page.locator(f"[data-drone-id='{drone_id}']"))).to_be_checked()
        expect(console.part("squad-mission")).to_contain_text(name)
    expect(console.part("squad-start")).to_be_disabled()

    draw_field(console)
    settings = {"height": "15", "step": "12", "spacing": "40", "speed": "8", "start-every": "6"}
    for setting, value in settings.items():
        console.part(f"squad-{setting}").fill(value)
    expect(console.part("squad-part")).to_have_count(3)
    expect(console.part("squad-conflicts")).to_have_attribute("data-value", "0")
    assert answers(console, "standing") == ["none"] * 3

    console.part("squad-upload").click()
    confirm_all(console)
    console.wait("three uploads", lambda: answers(console, "answer") == ["done"] * 3)
    console.wait("the plans on board", lambda: answers(console, "standing") == ["on the drone"] * 3)


def start_all(console: ConsolePage) -> None:
    console.part("squad-start").click()
    confirm_all(console)
    console.wait("three starts", lambda: answers(console, "answer") == ["done"] * 3)


@pytest.mark.long("the plans that it flies are proved apart by unit tests")
def test_a_field_is_split_among_three_drones_which_keep_their_distance(somebody: Somebody) -> None:
    console = somebody()
    sky = Sky(console)
    console.open()  # reopened, to receive the live channel from its beginning
    console.sign_in("alice")
    expect(console.part("squad-row")).to_have_count(3)
    console.wait("three places", lambda: len(sky.places) == 3)
    plan_and_upload(console)

    start_all(console)
    console.wait("all in the air at their height", lambda: min(sky.highest_m.values()) > 14.0)
    progress = console.part("squad-progress")
    expect(progress).to_contain_text("left, 3 flying")
    expect(console.part("part-progress")).to_have_count(3)
    first_s = float(progress.get_attribute("data-left-s") or 0)
    assert first_s > 5, first_s
    console.wait("half of it", lambda: int(progress.get_attribute("data-percent") or 0) >= 50, timeout_s=120.0)
    assert float(progress.get_attribute("data-left-s") or 0) < first_s
    console.wait("the field flown and all at home", sky.all_landed, timeout_s=180.0)

    expect(progress).to_contain_text("The mission is flown.")
    assert min(sky.way_m.values()) > 150.0, sky.way_m
    assert sky.nearest_m > KEPT_APART_M, sky.nearest_m
    assert [event for event in sky.reported if event["level"] == "warning"] == []
    # Nobody holds them: the controls were released after each step.
    for drone_id in SQUAD:
        assert console.page.request.get(f"{console.address}/api/v1/drones/{drone_id}").json()["holder"] is None
    assert console.complaints == [] or all("401" in one for one in console.complaints), console.complaints


def test_all_are_held_from_a_page_that_was_opened_while_they_fly(somebody: Somebody) -> None:
    console = somebody()
    sky = Sky(console)
    console.open()
    console.sign_in("alice")
    expect(console.part("squad-row")).to_have_count(3)
    console.wait("three places", lambda: len(sky.places) == 3)
    plan_and_upload(console)
    for drone_id, name in SQUAD.items():
        control = f"{console.address}/api/v1/drones/{drone_id}/control"
        console.page.request.post(f"{control}/acquire", headers={"Origin": console.address})
        console.read_loss_check(name)
        console.page.request.post(f"{control}/release", headers={"Origin": console.address})
    start_all(console)
    console.wait("all in the air", lambda: min(place[2] for place in sky.places.values()) > 8.0)
    assert set(sky.modes.values()) == {AUTO}

    console.page.reload()
    expect(console.part("squad-hold-all")).to_be_enabled()
    expect(console.part("squad-part")).to_have_count(0)  # it knows of no plan
    console.part("squad-hold-all").click()
    confirm_all(console)
    others = console.part("squad-other")
    console.wait("three answers", lambda: [one.get_attribute("data-answer") for one in others.all()] == ["done"] * 3)
    for name in SQUAD.values():
        expect(others.filter(has_text=name)).to_have_count(1)

    console.wait("all stand in the air", lambda: max(sky.speeds_m_s.values()) < 0.3)
    assert min(place[2] for place in sky.places.values()) > 5.0, sky.places
    assert AUTO not in sky.modes.values(), sky.modes
