"""Every page: no serious fault for axe-core at three sizes and in three themes, and on a phone every target is 44 px.

One person signs in once and goes through the pages.
"""

import shutil
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

import pytest
from axe_look import THEMES, Axe, Theme
from console_page import SIMULATOR, Somebody, visitors
from furnished import furnish
from playwright.sync_api import Browser, ViewportSize, expect
from touch_targets import PHONE, Measured
from worlds.flight_files import write_flight
from worlds.processes import World
from worlds.tiers import is_long

SIZES: Final[tuple[ViewportSize, ...]] = ({"width": 1440, "height": 900}, {"width": 1024, "height": 768}, PHONE)
THEMES_AT: Final[dict[int, tuple[Theme, ...]]] = {
    1440: ("dark", "light"),
    1024: ("light",),
    PHONE["width"]: ("contrast",),
}
"""In the short tier. The long one looks at each page in each theme at each size."""
PAGES: Final = {
    "": "squad-row",
    "drone/1": "bar-state",
    "drone/1/parameters": "parameter-row",
    "drone/1/logs": "list-logs",
    **{f"drone/1/setup/{one}": f"setup-{one}" for one in ("sensors", "radio", "motors", "failsafes", "reboot")},
    "drone/99": "no-such-drone",
    "missions": "plan-menu",
    "missions/1": "drone-strip",
    "squad-mission/1,2": "squad-mission",
    "videos/1,2": "video-tile",
    "flights": "flight-filter",
    "statistics": "statistics-total",
    "flights/file": "own-file",
    "flights/1": "events",
    "zones": "zones-none",
    **{f"account/{one}": f"section-{one}" for one in ("password", "passkeys", "second-factor", "sessions", "tokens")},
    "admin/users": "user-row",
    "admin/drones": "drone-row",
    "admin/enrolment": "enrolment-row",
    "admin/sessions": "session-row",
    "admin/tokens": "token-row",
    "admin/teams": "new-team",
    "admin/audit": "audit-row",
    "admin/maps": "map-layer-form",
    "admin/system": "system",
}
"""Each with a part that shows that it is there."""


@pytest.fixture(scope="module")
def office(prepared_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[World]:
    """A tower with Kestrel and Merlin switched on and ten other drones off."""
    folder = tmp_path_factory.mktemp("office")
    shutil.copytree(prepared_folder, folder, dirs_exist_ok=True)
    with World(folder, prepared=True) as world:
        people = {"drone": "Kestrel", "pilot": "alice", "admin": "admin"}
        flights = folder / "files" / "flights"
        write_flight(flights, drone_id=1, began_at=datetime.now(UTC), lasts_s=60.0, **people)
        world.start_tower()
        world.start_simulated("Kestrel", "Merlin", options=SIMULATOR)
        admin = world.visitor("admin")
        furnish(world, admin)
        world.wait_until_online(admin, 1, 2)
        yield world


@pytest.fixture
def come(chromium: Browser, office: World) -> Iterator[Somebody]:
    with visitors(chromium, office.address, has_map=True) as somebody:
        yield somebody


def test_every_page_is_accessible_and_can_be_pressed_on_a_phone(come: Somebody, axe: Axe) -> None:
    console = come()
    measured = Measured(console)
    for at, (address, part) in enumerate({"sign-in": "sign-in-button", **PAGES}.items()):
        if at == 1:
            console.sign_in("admin")
        elif at > 1:
            console.page.evaluate(f"window.location.hash = '#/{address}'")
        expect(console.part(part).first).to_be_visible()
        for size in SIZES:
            console.page.set_viewport_size(size)
            for theme in THEMES if is_long() else THEMES_AT[size["width"]]:
                axe.look_in(console, theme, f"{address.replace('/', '-') or 'monitor'}-{size['width']}")
            if size == PHONE:
                measured.look(address or "monitor")
    assert not measured.faults, "\n".join(measured.faults)
