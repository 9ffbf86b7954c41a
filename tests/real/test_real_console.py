"""The console in a real browser with real ArduCopters: a plan drawn on the page goes on board, is read back and flown.

The test compares a survey's photographs with the positions that the plan requires: from the start of each line, one per
trigger distance.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final, NamedTuple

import pytest
from e2e.console_page import FLAGS, ConsolePage, Somebody, visitors
from playwright.sync_api import Browser, expect, sync_playwright
from real.beside_agents import Photograph, PhotographedTap, beside_agents
from worlds.free_ports import free_udp_ports
from worlds.modest_chromium import modest
from worlds.processes import World, wait_for

from bench.rig import HOME
from wire.autopilots.ardupilot_plans import ArduPilot
from wire.plan_fields import Effect
from wire.plan_keeping import as_kept, changes_ahead
from wire.plans import PlanItem, PlanKind

SQUAD: Final = {1: "Kestrel", 2: "Merlin", 3: "Osprey"}
APART_DEG: Final = 0.0004
METRES_PER_E7: Final = 0.0111319491
WAYPOINT, TRIGGER = 16, 206
NEAR_M: Final = 2.0
FLOWN_WITHIN_S: Final = 600.0
FIELD: Final = ((0.43, 0.45), (0.485, 0.45), (0.485, 0.51), (0.43, 0.51))
WAY: Final = ((0.45, 0.60), (0.52, 0.52), (0.58, 0.60))
SQUAD_FIELD: Final = ((0.40, 0.28), (0.72, 0.28), (0.72, 0.42), (0.40, 0.42))
"""Corners, as fractions of the map."""


@pytest.fixture(scope="module")
def chromium(page_browser_path: str, console: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    assert console.exists()
    expect.set_options(timeout=30_000)
    with sync_playwright() as playwright:
        program = modest(page_browser_path, tmp_path_factory.mktemp("chromium"))
        browser = playwright.chromium.launch(executable_path=program, args=list(FLAGS))
        yield browser
        browser.close()


class Field(NamedTuple):
    world: World
    autopilots: list[PhotographedTap]


@pytest.fixture(scope="module")
def field(arducopter: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Field]:
    """Three ArduCopters of alice's, side by side, each with its agent, and a tower."""
    folder = tmp_path_factory.mktemp("field")
    ports = free_udp_ports(len(SQUAD))
    homes = {port: (HOME[0], HOME[1] + n * APART_DEG, HOME[2]) for n, port in enumerate(ports)}
    with World(folder / "world") as world, beside_agents(arducopter, folder, homes) as autopilots:
        world.add_user("alice")
        world.start_tower()
        for (drone_id, name), port in zip(SQUAD.items(), ports, strict=True):
            assert world.add_drone(name, "alice") == drone_id
            world.start_agent(name, f"udpin:127.0.0.1:{port}")
        alice = world.visitor("alice")
        world.wait_until_online(alice, *SQUAD)
        wait_for("all to be heard", lambda: all(alice.drone(one)["autopilot_heard"] for one in SQUAD))
        yield Field(world, autopilots)


@pytest.fixture
def come(chromium: Browser, field: Field) -> Iterator[Somebody]:
    with visitors(chromium, field.world.address) as somebody:
        yield somebody
    alice = field.world.visitor("alice")
    for drone_id in SQUAD:  # one account holds one drone
        alice.ask("POST", f"/drones/{drone_id}/control/release")


def click(console: ConsolePage, *places: tuple[float, float]) -> None:
    box = console.part("map").bounding_box()
    assert box is not None
    for x, y in places:
        console.page.mouse.click(box["x"] + box["width"] * x, box["y"] + box["height"] * y)


def planning(come: Somebody, drone_id: int) -> ConsolePage:
    console = come()
    console.page.on("dialog", lambda dialog: dialog.accept())
    console.sign_in("alice")
    expect(console.part("squad-row").first).to_be_visible()
    console.open(f"/#/missions/{drone_id}")
    expect(console.part("map")).to_have_attribute("data-zoom", re.compile(r"\d"))
    console.wait("the drone's place", lambda: float(console.part("map").get_attribute("data-zoom") or 0) > 10)
    console.part("strip-acquire").click()
    expect(console.part("mission-start")).to_be_visible()
    return console


def uploaded(console: ConsolePage, world: World, drone_id: int) -> list[PlanItem]:
    """Uploads, compares and reads back on the page. Returns the items on board."""
    console.part("upload").click()
    dialog = console.part("upload-dialog")
    came = console.part("transfer-came")
    console.wait("a question, or the upload", lambda: dialog.count() > 0 or came.count() > 0)
    if dialog.count() > 0:
        expect(console.part("upload-not-kept")).to_have_count(0)
        console.part("upload-confirm").click()
    expect(came).to_have_attribute("data-as", "done")
    expect(console.part("board-mission")).to_have_attribute("data-standing", "on the drone")
    shown = console.part("plan-item").count()
    console.page.keyboard.press("v")
    for action, reported in (("verify", "is this one"), ("download", "is on the screen")):
        console.part("drone-plan-menu").click()
        console.part(action).click()
        if action == "download":  # a plan on the screen is not in the library
            console.part("confirm-button").click()
        expect(came).to_contain_text(reported)
        expect(came).to_have_attribute("data-as", "done")
    expect(console.part("plan-item")).to_have_count(shown)
    expect(console.part("board-mission")).to_have_attribute("data-standing", "on the drone")
    return on_board(world, drone_id, shown)


def on_board(world: World, drone_id: int, count: int) -> list[PlanItem]:
    fresh = world.visitor("alice").ask("GET", f"/drones/{drone_id}/mission?fresh=true").json
    assert (fresh["state"], fresh["count"], fresh["fit_to_fly"]) == ("known", count, True)
    items = [PlanItem(row[0], row[1], tuple(row[2]), *row[3:]) for row in fresh["items"]]
    assert as_kept(ArduPilot(), PlanKind.MISSION, items) == tuple(items)  # as the autopilot keeps them
    return items


class Wanted(NamedTuple):
    """A photograph that the plan requires. `line`: from 0; `along_m`: distance from the start of the line."""

    line: int
    along_m: float
    north_m: float
    east_m: float


def metres(lat_e7: float, lon_e7: float) -> tuple[float, float]:
    """Returns metres north and east of HOME."""
    north = (lat_e7 - HOME[0] * 1e7) * METRES_PER_E7
    return north, (lon_e7 - HOME[1] * 1e7) * METRES_PER_E7 * math.cos(math.radians(HOME[0]))


def wanted(items: list[PlanItem]) -> tuple[list[Wanted], float]:
    """Returns the required photographs of each line, from the start of its trigger, and their distance."""
    found: list[Wanted] = []
    every_m, line = 0.0, -1
    here = (0.0, 0.0)
    for item in items:
        if item.command == TRIGGER:
            every_m = item.params[0] or 0.0
            line += every_m > 0
        elif item.command == WAYPOINT:
            there = metres(item.x, item.y)
            length = math.dist(here, there)
            if every_m > 0:
                for number in range(int(length / every_m) + 1):
                    share = number * every_m / length
                    north, east = (a + (b - a) * share for a, b in zip(here, there, strict=True))
                    found.append(Wanted(line, number * every_m, north, east))
                trigger_m = every_m
            here = there
    return found, trigger_m


def offsets(photographs: list[Photograph], plan: list[Wanted]) -> dict[Wanted, float]:
    """Returns for each required position the distance to the nearest photograph."""
    places = [metres(one.lat_e7, one.lon_e7) for one in photographs]
    return {one: min((math.dist(place, one[2:]) for place in places), default=math.inf) for one in plan}


def test_a_survey_is_drawn_goes_on_board_and_is_photographed_where_it_was_planned(field: Field, come: Somebody) -> None:
    console = planning(come, 1)
    console.part("tool-survey").click()
    click(console, *FIELD, FIELD[0])
    console.part("pattern-camera").select_option("none")
    for part, value in {"height": "20", "spacing": "20", "trigger": "8"}.items():
        console.part(f"pattern-{part}").fill(value)
        console.part(f"pattern-{part}").press("Tab")
    items = int(console.part("pattern-facts").get_attribute("data-items") or 0)
    console.part("pattern-add").click()
    expect(console.part("plan-item")).to_have_count(items + 1)  # plus the take-off
    console.page.get_by_role("tab", name="Checks").click()
    console.part("add-return").click()
    board = uploaded(console, field.world, 1)
    plan, every_m = wanted(board)
    assert len(plan) > 10

    reported = console.part("told")
    console.part("mission-start").click()
    console.confirm("Kestrel")
    expect(reported).to_have_attribute("data-good", "true", timeout=60_000)
    kestrel = field.autopilots[0]
    console.wait("the air", lambda: field.world.visitor("alice").drone(1)["airborne"])
    console.wait(
        "the return in the mission, and the ground",
        lambda: console.part("drone-state").get_attribute("data-value") == "idle",
        timeout_s=FLOWN_WITHIN_S,
    )

    photographs = kestrel.photographs
    off = offsets(photographs, plan)
    stray = [min(math.dist(metres(one.lat_e7, one.lon_e7), place[2:]) for place in plan) for one in photographs]
    print(f"{len(plan)} photographs wanted on {plan[-1].line + 1} lines, {every_m:g} m apart; {len(photographs)} taken")
    print(f"from the wanted place to the nearest photograph, m: max {max(off.values()):.2f}")
    print(f"from a photograph to the nearest wanted place, m: max {max(stray):.2f}, mean {sum(stray) / len(stray):.2f}")
    heights = [one.height_m for one in photographs]
    print(f"height above home, m: {min(heights):.2f} to {max(heights):.2f}")
    assert max(stray) < NEAR_M
    assert max(off.values()) < NEAR_M, {one: metres_off for one, metres_off in off.items() if metres_off >= NEAR_M}
    assert len(photographs) == len(plan)


def test_a_corridor_is_drawn_and_goes_on_board(field: Field, come: Somebody) -> None:
    console = planning(come, 2)
    console.part("tool-corridor").click()
    click(console, *WAY)
    console.part("pattern-finish").click()
    console.part("pattern-height").fill("25")
    items = int(console.part("pattern-facts").get_attribute("data-items") or 0)
    console.part("pattern-add").click()
    expect(console.part("plan-item").first).to_be_visible()
    board = uploaded(console, field.world, 2)
    assert len(board) > 4 and items > 0
    assert {item.command for item in board} >= {22, WAYPOINT}


def test_a_squad_plan_is_drawn_and_goes_on_board_of_all(field: Field, come: Somebody) -> None:
    console = come()
    console.sign_in("alice")
    expect(console.part("squad-row")).to_have_count(len(SQUAD))
    console.part("choose-all").check()
    console.part("squad-mission-link").click()
    console.wait("the map at the squad", lambda: abs(shown(console, "lat") - HOME[0]) < 0.01)
    box = console.page.locator(".maplibregl-canvas").bounding_box()
    assert box is not None
    for number, (across, down) in enumerate(SQUAD_FIELD, 1):
        console.page.mouse.click(box["x"] + box["width"] * across, box["y"] + box["height"] * down)
        expect(console.part("squad-corners")).to_have_attribute("data-value", str(number))
    for setting, value in {"height": "15", "step": "12", "spacing": "40", "speed": "8", "start-every": "6"}.items():
        console.part(f"squad-{setting}").fill(value)
    expect(console.part("squad-part")).to_have_count(len(SQUAD))
    console.part("squad-upload").click()
    console.confirm("Osprey")
    parts = console.part("squad-part")

    def all_are(attribute: str, word: str) -> bool:
        return [part.get_attribute(f"data-{attribute}") for part in parts.all()] == [word] * len(SQUAD)

    console.wait("three uploads", lambda: all_are("answer", "done"))
    console.wait("the plans on board", lambda: all_are("standing", "on the drone"))
    boards: list[Any] = []
    alice = field.world.visitor("alice")
    for drone_id in SQUAD:
        count = alice.ask("GET", f"/drones/{drone_id}/mission").json["count"]
        boards.append(on_board(field.world, drone_id, count))
        reported = [
            one for one in changes_ahead(ArduPilot(), PlanKind.MISSION, boards[-1]) if one.effect > Effect.QUIET
        ]
        assert reported == []
    assert all(one != other for one, other in itertools.pairwise(boards))


def shown(console: ConsolePage, name: str) -> float:
    return float(console.part("map").get_attribute(f"data-{name}") or 0)
