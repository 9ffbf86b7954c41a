"""Zones in the browser: an admin draws one around a drone in flight, and its pilot is warned and refused."""

import re

from axe_look import Axe
from console_page import METRES_PER_DEGREE, Somebody, signed_in
from playwright.sync_api import expect

HAS_MAP = True

GO_TO = """async ([lat, lon]) => {
  const answer = await fetch('/api/v1/drones/1/commands', {
    method: 'POST', headers: { 'Content-Type': 'application/json' },
    body: JSON.stringify({ command: 'goto', lat, lon, height_m: 10 }),
  });
  return [answer.status, (await answer.json()).detail];
}"""
CREATE = """async (points) => {
  const answer = await fetch('/api/v1/zones', {
    method: 'POST', headers: { 'Content-Type': 'application/json' },
    body: JSON.stringify({ name: 'Hospital', kind: 'no-fly', points, reason: 'helicopter' }),
  });
  return answer.status;
}"""
DRAWN = """(canvas) =>
  canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data.some((one) => one > 0)"""


def mission_text(*ways: tuple[float, float]) -> bytes:
    """A plan as Mission Planner saves it: a take-off to 10 m, then these places at that height."""
    rows = ["0\t1\t0\t16\t0\t0\t0\t0\t{}\t{}\t488\t1".format(*ways[0]), "1\t0\t3\t22\t0\t0\t0\t0\t0\t0\t10\t1"]
    rows += [f"{at}\t0\t3\t16\t0\t0\t0\t0\t{lat}\t{lon}\t10\t1" for at, (lat, lon) in enumerate(ways, start=2)]
    return "\r\n".join(("QGC WPL 110", *rows, "")).encode()


def test_an_admin_draws_a_zone_and_the_pilot_is_warned_and_refused(somebody: Somebody, axe: Axe) -> None:
    alice = signed_in(somebody, "alice", "Kestrel")
    alice.acquire("Kestrel")
    alice.take_off("Kestrel", 10)
    lat, lon = alice.number("latitude"), alice.number("longitude")

    # Near one: 5 m from its edge.
    admin = signed_in(somebody, "admin")
    south, north = lat + 5 / METRES_PER_DEGREE, lat + 60 / METRES_PER_DEGREE
    corners = [[south, lon - 1e-3], [south, lon + 1e-3], [north, lon + 1e-3], [north, lon - 1e-3]]
    assert admin.page.evaluate(CREATE, corners) == 201
    bar = alice.part("bar-zone")
    expect(bar).to_have_text("is within 10 m of the edge of the no-fly zone Hospital.", timeout=15_000)
    refused = alice.page.evaluate(GO_TO, [lat + 30 / METRES_PER_DEGREE, lon])
    assert refused == [409, "the way of Kestrel leads into the no-fly zone Hospital (helicopter)"]

    # Among the checks of a plan, before it is sent.
    alice.page.evaluate("window.location.hash = '#/missions/1'")
    plan = mission_text((lat - 20 / METRES_PER_DEGREE, lon), (lat + 30 / METRES_PER_DEGREE, lon))
    alice.part("plan-file").set_input_files(
        files=[{"name": "clinic.waypoints", "mimeType": "text/plain", "buffer": plan}]
    )
    alice.page.get_by_role("tab", name=re.compile("Checks")).click()
    finding = alice.part("finding").filter(has_text="Hospital")
    expect(finding).to_have_text(
        re.compile(r"item 3 \(Waypoint\) leads into the no-fly zone Hospital \(helicopter\)\.")
    )
    expect(finding).to_have_attribute("data-severity", "error")
    alice.page.evaluate("window.location.hash = '#/drone/1'")

    # Drawn around the drones, on the map.
    admin.part("user-menu").click()
    admin.part("open-zones").click()
    expect(admin.part("zone-row")).to_contain_text("No-fly zone, all heights, always")
    admin.part("zone-new").click()
    expect(admin.part("zone-save")).to_be_disabled()
    admin.part("zone-name").fill("Airport")
    expect(admin.part("map").locator("canvas.maplibregl-canvas")).to_be_visible(timeout=20_000)
    admin.wait("the map at the squad", lambda: float(admin.part("map").get_attribute("data-zoom") or 0) > 12)
    box = admin.part("map").bounding_box()
    assert box is not None
    for across, down in ((0.1, 0.1), (0.9, 0.1), (0.9, 0.9), (0.1, 0.9)):
        admin.page.mouse.click(box["x"] + across * box["width"], box["y"] + down * box["height"])
    expect(admin.part("zone-points")).to_contain_text("4 points")
    axe.look(admin, "zones-drawing")
    admin.part("zone-save").click()
    expect(admin.part("zone-row")).to_have_count(2)
    expect(admin.part("zone-form")).to_have_count(0)
    expect(bar).to_contain_text("is in the no-fly zone Airport", timeout=15_000)
    canvas = alice.part("zones-canvas")
    alice.wait("the zone on the pilot's map", lambda: canvas.evaluate(DRAWN) is True)

    # Deleted, it warns nobody.
    for name in ("Airport", "Hospital"):
        admin.page.get_by_role("button", name=f"Delete {name}").click()
        admin.confirm(name)
        expect(admin.part("zone-row").filter(has_text=name)).to_have_count(0)
    expect(admin.part("zones-none")).to_be_visible()
    expect(bar).to_have_count(0, timeout=15_000)
