"""Worst bodies that no schema describes, by operation, and the values of paths."""

from __future__ import annotations

import json
import random
from collections.abc import Callable
from typing import Any, Final

from bench.worst.full_database import LAT, LON, MISSION, PLAN, TEAM, ZONE, ring

_MB: Final = 1024 * 1024

PATHS: Final[dict[str, str]] = {
    "drone_id": "1",
    "user_id": "40",
    "team_id": str(TEAM),
    "zone_id": str(ZONE),
    "mission_id": str(MISSION),
    "flight_id": "1",
    "recording_id": "1",
    "alert_id": "1",
    "enrolment_id": "1",
    "session_id": "9",
    "token_id": "9",
    "channel_id": "1",
    "invitation_id": "1",
    "task_id": "1",
    "passkey_id": "1",
    "operation_id": "1",
    "transaction_id": "1",
    "log_id": "1",
    "layer_id": "1",
    "area_id": "1",
    "tower_id": "1",
    "import_id": "0" * 16,
    "version": "1.0.0",
    "format_name": "csv",
    "share_name": "long-work",
    "zoom": "1",
    "x": "0",
    "y": "0",
}
PATHS_OF: Final[dict[str, dict[str, str]]] = {
    "put_preference": {"name": "units"},
    **{key: {"name": "worst.pmtiles"} for key in ("get_map_file", "put_map_file", "remove_map_file")},
    "put_elevation_file": {"name": "worst.tif"},
    **{key: {"kind": "copter"} for key in ("get_checklist", "put_checklist")},
    **{key: {"kind": "mission"} for key in ("get_plan", "put_plan", "clear_plan", "verify_plan", "foresee_plan")},
}


def _json(value: Any) -> bytes:
    return json.dumps(value, separators=(",", ":")).encode()


def _far_items() -> list[Any]:
    """To and fro over all zones, below their ceilings."""
    chance = random.Random(41)

    def anywhere(middle_deg: float) -> int:
        return round(1e7 * (middle_deg + chance.uniform(-0.3, 0.3)))

    return [[16, 3, [0, 0, 0, None], anywhere(LAT), anywhere(LON), 50, 1] for _ in PLAN]


def _plan() -> dict[str, bytes]:
    return {"to and fro over all zones": _json({"items": _far_items()})}


def _mission() -> dict[str, bytes]:
    document = {"mission": _far_items(), "fence": PLAN, "rally": PLAN}
    return {"three plans of 724 items": _json({"name": "worst", "document": document})}


def _zone(**more: Any) -> dict[str, bytes]:
    body = {"name": "worst", "kind": "no-fly", "points": ring(1), "reason": "r" * 200} | more
    line = body | {"kind": "corridor", "width_m": 100.0}
    return {"an area of 500 corners": _json(body), "a line of 500 points": _json(line)}


def _shapes() -> dict[str, bytes]:
    most = 390_000
    nested = f"<kml><Document>{'<Placemark>' * 34}{'<Point/>' * 45_000}{'</Placemark>' * 34}</Document></kml>"
    square = "<Placemark><Polygon><outerBoundaryIs><LinearRing><coordinates>8,47 8.1,47 8.1,47.1</coordinates>"
    square += "</LinearRing></outerBoundaryIs></Polygon></Placemark>"
    points = " ".join(f"8.{n},47" for n in range(40_000))
    line = f"<kml><Placemark><LineString><coordinates>{points[:most]}</coordinates></LineString></Placemark></kml>"
    feature = {"type": "Feature", "properties": {}, "geometry": {"type": "Polygon", "coordinates": [ring(1, 4)]}}
    features = {"type": "FeatureCollection", "features": [feature] * (most // len(_json(feature)) - 1)}
    collection = '{"type":"GeometryCollection","geometries":['
    return {
        "nested placemarks": _json({"text": nested[:most]}),
        "many areas": _json({"text": f"<kml>{square * (most // len(square))}</kml>"}),
        "one long line": _json({"text": line}),
        "GeoJSON, many features": _json({"text": _json(features).decode()}),
        "GeoJSON, nested collections": _json({"text": collection * 7_000 + "]}" * 7_000}),
        "GeoJSON, nested arrays": _json({"text": "[" * 100_000 + "]" * 100_000}),
    }


def _parameters() -> dict[str, bytes]:
    return {"4096 values": _json({"values": {f"P{n}": n + 0.5 for n in range(4096)}})}


def _heights() -> dict[str, bytes]:
    return {"2000 places": _json({"places": [[LAT + n * 0.001, LON + n * 0.001] for n in range(2000)]})}


def _area() -> dict[str, bytes]:
    body = {"name": "worst", "layer_id": 1, "south": -80, "west": -179, "north": 80, "east": 179, "max_zoom": 19}
    return {"the whole earth": _json(body)}


def _preference() -> dict[str, bytes]:
    return {"32 levels": b'{"a":' * 31 + b"1" + b"}" * 31, "8 kB": _json({f"k{n}": n for n in range(700)})}


def _file() -> dict[str, bytes]:
    return {"8 MB of chance": random.Random(41).randbytes(8 * _MB)}


NAMED: Final[dict[str, Callable[[], dict[str, bytes]]]] = {
    **dict.fromkeys(("put_plan", "verify_plan", "foresee_plan"), _plan),
    **dict.fromkeys(("create_mission", "replace_mission"), _mission),
    "create_zone": _zone,
    "replace_zone": lambda: _zone(version=1),
    "read_zone_file": _shapes,
    "write_parameters": _parameters,
    "get_heights": _heights,
    **dict.fromkeys(("estimate_map_area", "keep_map_area"), _area),
    "put_preference": _preference,
    **dict.fromkeys(("import_flight", "put_map_file", "put_elevation_file", "put_agent_file"), _file),
}
"""Valid JSON, or files, beside those that are made from the schema."""
LAST: Final = ("sign_out", "drain_tower")
"""Nothing works after them."""
