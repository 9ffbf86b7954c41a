"""Files of a recorded flight as the recorder writes them, of any length, without flying: a drone on a circle.

A tower that starts and finds them lists the flight (server/flights/store/service.py). The flight has a hand-over with a
hold, commands, an alert, sticks, a lost link and statements of the autopilot, at times that `EVENTS_S` names.
"""

import json
import math
import secrets
import struct
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final

from pymavlink.dialects.v20 import ardupilotmega as mavlink

RADIUS_M: Final = 150.0
SPEED_M_S: Final = 9.0
METRES_PER_DEGREE: Final = 111_319.49
HOME: Final = (47.3977, 8.5456)
HEIGHT_M: Final = 40.0
CLIMB_S: Final = 10.0
STICKS_HZ: Final = 20
EVENTS_S: Final = {"armed": 5.0, "take-off": 7.0, "sticks": 20.0, "sticks_rest": 30.0, "taken": 40.0, "alert": 50.0}
"""Seconds from the beginning of the file. What is beyond the end of a short flight is left out."""


def position(at_s: float) -> tuple[float, float, float, float]:
    """Latitude, longitude, height above home, and heading in degrees."""
    height = HEIGHT_M * min(1.0, max(0.0, (at_s - EVENTS_S["take-off"]) / CLIMB_S))
    angle = max(0.0, at_s - EVENTS_S["take-off"] - CLIMB_S) * SPEED_M_S / RADIUS_M
    north, east = RADIUS_M * math.sin(angle), RADIUS_M * (1 - math.cos(angle))
    lat = HOME[0] + north / METRES_PER_DEGREE
    lon = HOME[1] + east / METRES_PER_DEGREE / math.cos(math.radians(HOME[0]))
    return lat, lon, height, math.degrees(angle) % 360


def write_flight(
    folder: Path, *, drone_id: int, drone: str, pilot: str, admin: str, began_at: datetime, lasts_s: float, hz: int = 10
) -> str:
    """Writes both files into the folder of flights; returns their stem. `hz`: of attitude and position; three more
    messages come as often, so that 10 is some 50 frames a second."""
    stem = secrets.token_hex(8)
    place = folder / f"drone-{drone_id}"
    place.mkdir(mode=0o700, parents=True, exist_ok=True)
    begun_s = began_at.timestamp() - EVENTS_S["armed"]
    (place / f"{stem}.tlog").write_bytes(telemetry_log(begun_s, lasts_s, hz))
    lines = index(drone_id, drone, pilot, admin, began_at, begun_s, lasts_s)
    (place / f"{stem}.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines))
    return stem


def telemetry_log(begun_s: float, lasts_s: float, hz: int) -> bytes:
    """A whole `.tlog`."""
    drone = mavlink.MAVLink(None, srcSystem=1, srcComponent=1)
    person = mavlink.MAVLink(None, srcSystem=255, srcComponent=190)
    out = bytearray()

    def put(at_s: float, link: Any, message: Any) -> None:
        out.extend(struct.pack(">Q", round((begun_s + at_s) * 1e6)) + message.pack(link))
        link.seq = (link.seq + 1) % 256

    for step in range(int(lasts_s * hz)):
        at_s = step / hz
        boot_ms = round(at_s * 1000)
        lat, lon, height, heading = position(at_s)
        is_armed = at_s >= EVENTS_S["armed"] and at_s < lasts_s - 2
        whole = step % hz == 0
        if whole:
            mode = 5 if EVENTS_S["sticks"] <= at_s < EVENTS_S["taken"] else 4
            flags = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | (mavlink.MAV_MODE_FLAG_SAFETY_ARMED if is_armed else 0)
            put(at_s, drone, mavlink.MAVLink_heartbeat_message(2, 3, flags, mode, 4, 3))
            charge = max(20, round(100 - at_s / 60))
            status = (1, 1, 1, 300, 16_800 - round(at_s / 2), 1500, charge, 0, 0, 0, 0, 0, 0)
            put(at_s, drone, mavlink.MAVLink_sys_status_message(*status))
            landed = 2 if height > 0.5 else 1
            put(at_s, drone, mavlink.MAVLink_extended_sys_state_message(0, landed))
            gps = (boot_ms * 1000, 3, round(lat * 1e7), round(lon * 1e7), 520_000, 80, 90, 900, 0, 14)
            put(at_s, drone, mavlink.MAVLink_gps_raw_int_message(*gps))
        if step == hz:
            home = (round(HOME[0] * 1e7), round(HOME[1] * 1e7), 480_000)
            put(at_s, drone, mavlink.MAVLink_home_position_message(*home, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0))
        roll, yaw = math.radians(12 * math.sin(at_s / 3)), math.radians((heading + 180) % 360 - 180)
        put(at_s, drone, mavlink.MAVLink_attitude_message(boot_ms, roll, 0.02, yaw, 0.0, 0.0, 0.06))
        fix = (round(lat * 1e7), round(lon * 1e7), round(480_000 + height * 1000), round(height * 1000))
        put(at_s, drone, mavlink.MAVLink_global_position_int_message(boot_ms, *fix, 0, 0, 0, round(heading * 100)))
        hud = (SPEED_M_S, SPEED_M_S, round(heading), 42, height, 0.0)
        put(at_s, drone, mavlink.MAVLink_vfr_hud_message(*hud))
        outputs = [1500 + round(100 * math.sin(at_s + motor)) for motor in range(8)]
        put(at_s, drone, mavlink.MAVLink_servo_output_raw_message(boot_ms * 1000 % 2**32, 0, *outputs))
        put(at_s, drone, mavlink.MAVLink_vibration_message(boot_ms * 1000, 4.0, 5.0, 9.0, 0, 0, 0))
        if EVENTS_S["sticks"] <= at_s < EVENTS_S["sticks_rest"]:
            for beat in range(max(1, STICKS_HZ // hz)):
                deflection = round(800 * math.sin(at_s - EVENTS_S["sticks"]))
                moved = mavlink.MAVLink_manual_control_message(1, 0, deflection, 500, 0, 0)
                put(at_s + beat / STICKS_HZ, person, moved)
        if step == round(EVENTS_S["take-off"] * hz):
            put(at_s, drone, mavlink.MAVLink_statustext_message(6, b"Takeoff to 40 m"))
        if step == round(EVENTS_S["alert"] * hz):
            put(at_s, drone, mavlink.MAVLink_statustext_message(4, b"Battery 1 low voltage"))
    return bytes(out)


def index(
    drone_id: int, drone: str, pilot: str, admin: str, began_at: datetime, begun_s: float, lasts_s: float
) -> list[dict[str, Any]]:
    """The lines of the index, the head first."""
    alice, boss = {"id": 1, "name": pilot}, {"id": 3, "name": admin}

    def line(at_s: float, kind: str, **about: Any) -> dict[str, Any]:
        return {"at_us": round((begun_s + at_s) * 1e6), "kind": kind, **about}

    def place(at_s: float) -> dict[str, float]:
        lat, lon, *_ = position(at_s)
        return {"lat": round(lat, 5), "lon": round(lon, 5)}

    at = EVENTS_S
    took = {"about": "take-off to 40 m", "by": alice, "way": "operation", "operation": "op-1"}
    hold = {"epoch": 5, "cause": "order"}
    lines = [
        line(at["armed"], "armed", holder=alice, epoch=4),
        line(at["take-off"], "command", work="command", state="running", answer="", **took),
        line(at["take-off"] + 0.4, "command", work="command", state="done", answer="accepted", **took),
        line(at["sticks"], "sticks", by=alice),
        line(at["sticks_rest"], "sticks_rest", by=alice),
        line(at["taken"], "control", event="taken", epoch=5, holder=boss, by=boss, reason="airspace closed"),
        line(at["taken"] + 0.01, "hold", step="ordered", detail="taken", elapsed_ms=0.0, **hold),
        line(at["taken"] + 0.06, "hold", step="sticks_centred", detail="", elapsed_ms=52.0, **hold),
        line(at["taken"] + 0.3, "hold", step="confirmed", detail="ALT_HOLD", elapsed_ms=290.0, **hold),
        line(
            at["alert"], "alert", what="battery-low", alert=7, severity="warning", state="opened", words="Battery low"
        ),
        line(
            at["alert"] + 5,
            "alert",
            what="battery-low",
            alert=7,
            severity="warning",
            state="closed",
            words="Battery low",
        ),
        line(at["alert"] + 8, "link_lost", **place(at["alert"] + 8)),
        line(at["alert"] + 11, "link_back"),
    ]
    lines += [
        line(one, "link", rtt_ms=48.0, loss=0.01, transport="udp", uplinks=1, **place(one))
        for one in range(5, int(lasts_s), 5)
    ]
    lines = [one for one in lines if one["at_us"] < (begun_s + lasts_s - 2) * 1e6]
    lines.sort(key=lambda one: int(one["at_us"]))
    head = {"kind": "flight", "version": 1, "drone_id": drone_id, "drone": drone, "before_s": at["armed"]}
    head["began_at"] = began_at.astimezone(UTC).isoformat()
    return [head, *lines, line(lasts_s - 2, "disarmed"), line(lasts_s, "end", words="")]
