"""Every REST route of the tower, with a valid path and body for it."""

import re
from typing import Final

from fastapi.routing import APIRoute

from server.app.routers import ROUTERS

MISSION: Final = {"name": "field", "document": {"mission": [], "fence": [], "rally": []}}
ZONE: Final = {"name": "x", "kind": "no-fly", "points": [[0, 0], [0, 1e-3], [1e-3, 0]]}
AREA: Final = {"name": "x", "layer_id": 9999, "south": 1, "west": 1, "north": 2, "east": 2, "max_zoom": 3}
BODIES: Final[dict[str, dict[str, object]]] = {
    "rehearse_loss": {"what": "tower"},
    "add_alert_channel": {"kind": "webhook", "target": "https://example.org/"},
    "confirm_alert_channel": {"code": "x"},
    "add_push_channel": {
        "endpoint": "https://push.example.org/1",
        "p256dh": "BCVxsr7N_eNgVRqvHtD0zTZsEc6-VV-JvLexhqUzORcxaOzi6-AYWXvTBHm4bjyPjs7Vd8pZGH6SRpkNtoIAiw4",
        "auth": "BTBZMqHH6r4Tts7J_aSIgg",
    },
    "make_team": {"name": "x"},
    "rename_team": {"name": "x"},
    "set_team_member": {"role": "observer"},
    "invite_to_team": {"name": "x", "role": "observer"},
    "lend_drone": {"until": "2020-01-01T00:00:00Z"},
    "change_share": {"limit": None},
    "restrain_drone": {"measure": "muted"},
    "put_plan": {"items": []},
    "verify_plan": {"items": []},
    "foresee_plan": {"items": []},
    "sign_preflight": {"checked": []},
    "put_drone_checklist": {"lines": []},
    "put_checklist": {"lines": []},
    "command_drone": {"command": "land"},
    "start_controller": {"controller": "scripted"},
    "create_mission": MISSION,
    "replace_mission": MISSION,
    "create_zone": ZONE,
    "replace_zone": ZONE | {"version": 1},
    "read_zone_file": {"text": "{}"},
    "get_heights": {"places": [[47.4, 8.5]]},
    "add_map_layer": {"name": "x", "role": "map", "template": "no address"},
    "estimate_map_area": AREA,
    "keep_map_area": AREA,
    "add_maintenance": {"title": "x", "interval_h": 50},
    "change_maintenance": {"interval_h": 50},
    "end_maintenance": {},
    "write_parameters": {"values": {"RTL_ALT": 1500}},
}
# A response to HEAD has only a status, the same as that of GET.
ROUTES: Final = [
    route for router in ROUTERS for route in router.routes if isinstance(route, APIRoute) and route.methods != {"HEAD"}
]


def path_of(route: APIRoute, drone_id: int) -> str:
    """Returns a path for this drone. Every other object that the path names does not exist."""
    path = route.path.replace("{drone_id}", str(drone_id)).replace("{name}", "units")
    path = path.replace("{kind:plan_kind}", "mission").replace("{format_name}", "csv").replace("{kind}", "unknown")
    path = path.replace("{zoom}/{x}/{y}", "1/0/0")
    path = path.replace("{share_name}", "long-work").replace("{import_id}", "0" * 16)
    return re.sub(r"\{\w+_id\}", "9999", path)
