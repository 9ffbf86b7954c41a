"""A tower in its third week: a dozen drones of four owners, loans, tokens, enrolments, and their audit trail.

For tests and screenshots that need full pages. None of the drones flies.
"""

from datetime import UTC, datetime, timedelta
from typing import Any, Final

from worlds.processes import Visitor, World

OWNERS: Final = {
    "alice": ("Kestrel", "Heron", "Plover"),
    "bob": ("Merlin", "Osprey", "Swift"),
    "carla.van-der-meer@field-team-north": (
        "Survey hexacopter of the north team, no. 2",
        "Goshawk",
        "Harrier",
    ),
    "dmitri": ("Avocet", "Dunlin", "Curlew"),
}
NEWCOMER: Final = "newcomer"
"""Still has the first password and must choose another."""
FIRST_PASSWORD: Final = "a first password"
LEFT: Final = "erin"
"""Disabled account of a person who has left."""


def furnish(world: World, admin: Visitor) -> None:
    """Adds to the users and drones of `world`. The tower must be running and `admin` signed in."""

    def sent(method: str, path: str, body: Any = None) -> Any:
        answer = admin.ask(method, path, body)
        assert answer.status < 300, f"{method} {path}: {answer.body!r}"
        return answer.json if answer.body else None

    def later(**span: float) -> str:
        return (datetime.now(UTC) + timedelta(**span)).isoformat()

    users = {one["name"]: one["id"] for one in sent("GET", "/users")}
    for name in (*OWNERS, NEWCOMER, LEFT):
        if name not in users:
            made = sent("POST", "/users", {"name": name, "password": FIRST_PASSWORD, "role": "operator"})
            users[name] = made["id"]
    sent("PATCH", f"/users/{users[LEFT]}", {"disabled": True})
    drones = {one["name"]: one["id"] for one in sent("GET", "/drones")}
    for owner, names in OWNERS.items():
        for name in names:
            if name not in drones:
                drones[name] = sent("POST", "/drones", {"name": name})["drone"]["id"]
                sent("PUT", f"/drones/{drones[name]}/owners/{users[owner]}")
    sent("PUT", f"/drones/{drones['Goshawk']}/owners/{users['dmitri']}")

    def lend(drone: str, to: str, **terms: Any) -> None:
        sent("PUT", f"/drones/{drones[drone]}/loans/{users[to]}", terms)

    lend("Heron", "bob", until=later(hours=5), may_arm=False, max_height_m=60, radius_m=400)
    lend("Swift", "alice", until=later(days=3))
    lend("Swift", "dmitri", until=later(minutes=50), max_height_m=120)
    for drone in ("Avocet", "Dunlin"):
        sent("POST", f"/drones/{drones[drone]}/enrolments", {"lasts_s": 86_400})
    cancelled = sent("POST", f"/drones/{drones['Curlew']}/enrolments", {"autopilot": "serial:/dev/ttyACM0"})
    sent("DELETE", f"/enrolments/{cancelled['enrolment']['id']}")
    ended = sent("POST", "/tokens", {"name": "last year's", "scopes": ["watch"], "expires_at": later(seconds=1)})
    assert ended["secret"]
    sent("POST", "/tokens", {"name": "Prometheus in the cellar", "scopes": ["metrics"], "expires_at": None})
    sent("POST", "/tokens", {"name": "Night script", "scopes": ["watch", "fly", "admin"], "expires_at": later(days=30)})
