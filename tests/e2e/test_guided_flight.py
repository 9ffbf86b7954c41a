"""The mission on board and other requests to a drone that flies by itself: start, pause, jump, look."""

from typing import Any, Final

from console_page import METRES_PER_DEGREE, ConsolePage, Somebody, signed_in
from playwright.sync_api import expect

HAS_MAP = True

PUT_PLAN: Final = """async (items) => {
  const answer = await fetch('/api/v1/drones/1/mission', {
    method: 'PUT', headers: { 'Content-Type': 'application/json' }, body: JSON.stringify({ items }),
  });
  return [answer.status, await answer.json()];
}"""
IS_DRAWN_ON: Final = """(canvas) =>
  canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data.some((byte) => byte > 0)"""
TAKE_OFF, WAYPOINT, RETURN = 22, 16, 20
ABOVE_HOME = 3


def row(command: int, lat_deg: float = 0.0, lon_deg: float = 0.0, height_m: float = 0.0) -> list[Any]:
    return [command, ABOVE_HOME, [0, 0, 0, 0], round(lat_deg * 1e7), round(lon_deg * 1e7), height_m, 1]


def put_mission(console: ConsolePage, lat_deg: float, lon_deg: float) -> None:
    """Uploads a take-off, three positions northwards, and the return."""
    step = 80 / METRES_PER_DEGREE
    places = [row(WAYPOINT, lat_deg + step * far, lon_deg, 20) for far in (1, 2, 3)]
    status, reported = console.page.evaluate(PUT_PLAN, [row(TAKE_OFF, height_m=10), *places, row(RETURN)])
    assert (status, reported["state"]) == (200, "done"), reported


def at_item(console: ConsolePage) -> str | None:
    return console.part("mission-strip").get_attribute("data-current")


def done(console: ConsolePage, label: str) -> None:
    report = console.part("action-report")
    expect(report).to_contain_text(label)
    expect(report).to_have_attribute("data-value", "done")


def test_a_mission_is_started_paused_jumped_in_and_left(somebody: Somebody) -> None:
    alice = signed_in(somebody, "alice", "Kestrel")
    alice.wait("a position", lambda: alice.word("gps") != "" and alice.number("latitude") > 40)
    home = (alice.number("latitude"), alice.number("longitude"))
    expect(alice.part("mission-strip")).to_contain_text("None on board")
    expect(alice.part("plan-canvas")).to_have_count(0)
    alice.acquire("Kestrel")
    put_mission(alice, *home)
    expect(alice.part("mission-strip")).to_contain_text("5 items on board")
    expect(alice.part("mission-jump")).to_be_disabled()
    plan = alice.part("plan-canvas")
    expect(plan).to_be_attached()
    alice.wait("the plan on the map", lambda: plan.evaluate(IS_DRAWN_ON) is True)
    alice.part("board-plan").click()
    expect(plan).to_have_count(0)
    alice.part("board-plan").click()
    expect(plan).to_be_attached()

    alice.part("mission-start").click()
    alice.confirm("Kestrel")
    done(alice, "Start the mission")
    alice.wait("the second place", lambda: at_item(alice) == "2")
    expect(alice.part("mission-at")).to_contain_text("Item 3 of 5, Waypoint")
    alice.part("mission-pause").click()
    done(alice, "Pause the mission")
    alice.wait("a stop", lambda: alice.number("speed") < 0.5)
    alice.part("mission-item").select_option("3")
    alice.part("mission-jump").click()
    alice.confirm("Kestrel")
    done(alice, "Jump to item 4")
    expect(alice.part("mission-strip")).to_have_attribute("data-current", "3")
    alice.part("mission-resume").click()
    alice.confirm("Kestrel")
    done(alice, "Resume the mission")
    alice.wait("the way on", lambda: alice.number("speed") > 2)

    # On the way, the nose turns to a clicked position. ArduCopter circles in missions only, so no orbit is requested.
    alice.part("in-flight").locator("summary").click()
    alice.press_map(0.5, 0.3)
    expect(alice.part("place-note")).to_contain_text("Kestrel leaves its mission")
    expect(alice.part("orbit-confirm")).to_have_count(0)
    alice.part("roi-confirm").click()
    done(alice, "Look at")
    alice.part("action-roi-none").click()
    done(alice, "Look ahead")
    alice.ends_flight("return")
    alice.wait("RTL", lambda: alice.word("mode") == "RTL")
