"""One simulated drone of the fake tower: flies straight lines, obeys the commands of the console."""

import math
import struct
from datetime import UTC, datetime, timedelta
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

HOME = (47.3977, 8.5456)
METRE_DEG = 1 / 111_195
STEP_S = 0.1
SPEED_MPS = 8.0
CLIMB_MPS = 2.5
ALT_HOLD, AUTO, GUIDED, RTL, LAND, BRAKE = 2, 3, 4, 6, 9, 17

HOLDS: dict[str, dict[str, Any]] = {
    "hold": {},
    "hold-height": {"stage": "altitude", "mode": "ALT_HOLD", "sticks": True, "waiting_for": "no position"},
    "hold-sticks": {"sticks": True, "after_sticks": "returns"},
    "counting": {"lost": "person", "phase": "counting", "action": "return"},
    "stayed": {"lost": "person", "phase": "stayed", "action": "stay"},
    "asking": {"lost": "person", "phase": "asking", "action": "return"},
    "done": {"open": False, "stage": "none", "mode": "RTL", "lost": "person", "phase": "done", "action": "return"},
    "tower-done": {"open": False, "stage": "none", "mode": "RTL", "lost": "tower", "phase": "done", "action": "return"},
}
"""What an agent reports of an open hold, by situation: the differences from a hold that stays in place."""


class FakeDrone:
    """Flies straight to its target at constant speed."""

    def __init__(self, drone_id: int, name: str, north_m: float, east_m: float, *, online: bool = True) -> None:
        self.id, self.name, self.online = drone_id, name, online
        self.epoch = 1
        self.holder: dict[str, Any] | None = None
        self.taken_from: dict[str, Any] | None = None
        self.assistant: dict[str, Any] | None = None
        self.offered = self.blind = self.acknowledged = False
        self.assisted_s = 0.0
        self.hold: dict[str, Any] | None = None
        self.parameters = {"FS_THR_ENABLE": 0.0, "FS_OPTIONS": 16.0, "RC_OVERRIDE_TIME": 3.0}
        self.settings: dict[str, Any] = {
            "hold_ladder": ["LOITER"],
            "sticks_stale_s": 0.5,
            "sticks_late_s": 0.5,
            "commands_late_s": 2.0,
            "lost_hold_s": 2.0,
            "lost_action": "return",
            "lost_action_s": 30.0,
            "rtt_limit_ms": 500,
            "rtt_limit_s": 1.0,
            "stream_profile": "auto",
        }
        self.home = (HOME[0] + north_m * METRE_DEG, HOME[1] + east_m * METRE_DEG * 1.48)
        self.lat, self.lon, self.alt = *self.home, 0.0
        self.mode, self.armed, self.heading, self.battery = (
            ALT_HOLD,
            False,
            40.0 * drone_id,
            96.0 - 7 * drone_id,
        )
        self.target: tuple[float, float, float] | None = None
        self.speed = self.climb = 0.0
        self.circle_s = 0.0
        self.mav = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
        self.out: list[bytes] = []

    def put(self, message: Any) -> None:
        self.out.append(struct.pack("<I", self.id) + message.pack(self.mav))

    def say(self, severity: int, text: str, chunk_id: int = 0, chunk: int = 0) -> None:
        self.put(dialect.MAVLink_statustext_message(severity, text.encode(), chunk_id, chunk))

    def circle(self) -> None:
        """Keeps one drone moving, so that the map has something to show."""
        self.circle_s += STEP_S
        angle = self.circle_s / 12
        here = (
            self.home[0] + 90 * math.sin(angle) * METRE_DEG,
            self.home[1] + 90 * math.cos(angle) * METRE_DEG * 1.48,
        )
        self.target = (*here, 25.0)

    def step(self) -> None:
        if self.mode == AUTO:
            self.circle()
        goal = self.target
        if self.mode == RTL:
            goal = (*self.home, self.alt) if self.away(self.home) > 1 else (*self.home, 0.0)
        elif self.mode == LAND:
            goal = (self.lat, self.lon, 0.0)
        before = (self.lat, self.lon, self.alt)
        if self.armed and goal:
            self.toward(goal)
        self.speed = self.away(before[:2]) / STEP_S
        self.climb = (self.alt - before[2]) / STEP_S
        if self.armed:
            self.battery = max(0.0, self.battery - 0.004)
            if self.mode in (RTL, LAND) and self.alt <= 0.01:
                self.armed = False
                self.say(6, "Disarming motors")

    def away(self, place: tuple[float, ...]) -> float:
        north = (place[0] - self.lat) / METRE_DEG
        east = (place[1] - self.lon) / METRE_DEG / 1.48
        return math.hypot(north, east)

    def toward(self, goal: tuple[float, float, float]) -> None:
        rise = goal[2] - self.alt
        self.alt += max(-CLIMB_MPS * STEP_S, min(CLIMB_MPS * STEP_S, rise))
        distance = self.away(goal[:2])
        if distance < 0.01 or self.alt < 0.5:
            return
        share = min(1.0, SPEED_MPS * STEP_S / distance)
        d_lat, d_lon = goal[0] - self.lat, goal[1] - self.lon
        self.heading = math.degrees(math.atan2(d_lon / 1.48, d_lat)) % 360
        self.lat, self.lon = self.lat + d_lat * share, self.lon + d_lon * share

    def heartbeat(self) -> None:
        base = 0x51 | (0x80 if self.armed else 0)
        self.put(dialect.MAVLink_heartbeat_message(2, 3, base, self.mode, 4 if self.armed else 3, 3))
        landed = 1 if self.alt < 0.2 else 2
        self.put(dialect.MAVLink_extended_sys_state_message(0, landed))
        zeros = (0.0, 0.0, 0.0, [1.0, 0.0, 0.0, 0.0], 0.0, 0.0, 0.0)
        self.put(
            dialect.MAVLink_home_position_message(int(self.home[0] * 1e7), int(self.home[1] * 1e7), 400_000, *zeros)
        )
        self.put(dialect.MAVLink_sys_status_message(0, 0, 0, 200, 16_200, 1200, int(self.battery), 0, 0, 0, 0, 0, 0))

    def state(self, boot_ms: int) -> None:
        lat, lon = int(self.lat * 1e7), int(self.lon * 1e7)
        alt_mm, heading_cd = int(self.alt * 1000), int(self.heading * 100)
        self.put(
            dialect.MAVLink_global_position_int_message(
                boot_ms, lat, lon, 400_000 + alt_mm, alt_mm, 0, 0, 0, heading_cd
            )
        )
        throttle = 48 if self.armed else 0
        self.put(
            dialect.MAVLink_vfr_hud_message(
                self.speed, self.speed, int(self.heading), throttle, 400 + self.alt, self.climb
            )
        )
        self.put(dialect.MAVLink_attitude_message(boot_ms, 0.02, -0.1, math.radians(self.heading), 0, 0, 0))
        self.put(dialect.MAVLink_gps_raw_int_message(0, 6, lat, lon, 400_000, 80, 90, 0, 0, 14))

    def answer(self, command: int, result: int) -> None:
        self.put(dialect.MAVLink_command_ack_message(command, result, 0, 0, 255, 190))

    def obey(self, message: Any) -> None:
        if message.get_type() not in ("COMMAND_LONG", "COMMAND_INT"):
            return
        command = message.command
        result = 0
        if command == 176:
            self.mode = int(message.param2)
            self.target = None
        elif command == 400:
            result = self.arm(message.param1 == 1, force=message.param2 == 21196)
        elif command == 22:
            if self.mode == GUIDED and self.armed:
                self.target = (self.lat, self.lon, message.param7)
            else:
                result = 4
        elif command == 192:
            self.mode = GUIDED
            self.target = (message.x / 1e7, message.y / 1e7, message.z)
        else:
            result = 3
        self.answer(command, result)
        self.heartbeat()

    def arm(self, wanted: bool, *, force: bool) -> int:
        if wanted and self.name == "Kestrel":
            self.say(2, "PreArm: Battery 1 below minimum arming capacity; 6", 5, 0)
            self.say(2, "2 percent are wanted", 5, 1)
            return 4
        if not wanted and self.alt > 0.5 and not force:
            return 4
        self.armed = wanted
        self.say(6, "Arming motors" if wanted else "Disarming motors")
        return 0

    def loss_check(self) -> dict[str, Any]:
        danger = self.name == "Heron"
        sentences = [
            ("operator", "info", f"{self.name} holds its height 0.5 s after the sticks stop."),
            ("tower", "info", f"{self.name} holds after 2 s and returns after 30 s."),
        ]
        if danger:
            sentences += [
                (
                    "tower",
                    "warning",
                    "Its own ground-station failsafe is off (FS_GCS_ENABLE = 0): it does nothing.",
                ),
                (
                    "radio",
                    "danger",
                    "There is no radio receiver, and overrides never expire (RC_OVERRIDE_TIME = -1).",
                ),
            ]
        return {
            "complete": True,
            "has_radio": False if danger else None,
            "sentences": [{"about": a, "severity": s, "text": text} for a, s, text in sentences],
            "dangerous": danger,
            "acknowledged": self.acknowledged,
        }

    def hold_as(self, situation: str) -> None:
        """Opens a hold; a countdown takes 24 s."""
        now = datetime.now(UTC)
        changes = HOLDS[situation]
        counts = changes.get("phase") == "counting"
        self.mode, self.target = (RTL if situation.endswith("done") else BRAKE), None
        self.hold = {
            "open": True,
            "stage": "stay",
            "mode": "BRAKE",
            "sticks": False,
            "after_sticks": "stays",
            "waiting_for": "",
            "lost": None,
            "phase": "quiet",
            "action": None,
            "due_at": (now + timedelta(seconds=24)).isoformat() if counts else None,
            "detail": "",
            "as_of": now.isoformat(),
            "stale": False,
            **changes,
        }

    def receiver_setup(self) -> dict[str, Any]:
        wanted = {
            "FS_THR_ENABLE": (1.0, "Return when sticks end in a mode that needs them."),
            "FS_OPTIONS": (29.0, "Missions, guided flight and landings go on without a radio."),
            "RC_OVERRIDE_TIME": (3.0, "Sticks that stop are forgotten after 3 s."),
        }
        rows = [
            {"name": name, "now": now, "wanted": wanted[name][0], "why": wanted[name][1], "ok": now == wanted[name][0]}
            for name, now in self.parameters.items()
        ]
        return {
            "autopilot": "ardupilot",
            "has_radio": False,
            "needed": not all(row["ok"] for row in rows),
            "known": True,
            "rows": rows,
            "text": f"{self.name} has no radio receiver. With these its own failsafe does not end a hold.",
        }

    def as_json(self, viewer: dict[str, Any] | None = None) -> dict[str, Any]:
        return {
            "id": self.id,
            "name": self.name,
            "online": self.online,
            "owners": [{"id": 2, "name": "olga"}],
            "holder": self.holder,
            "epoch": self.epoch,
            "taken_from": self.taken_from,
            "autopilot_heard": self.online,
            "armed": self.armed if self.online else None,
            "airborne": self.alt > 0.5 if self.online else None,
            "airborne_since": None,
            "offered": self.offered,
            "assistant": self.assistant,
            "may_watch": not self.shut_out(viewer),
            "lost_action": self.settings["lost_action"],
            "lost_action_s": self.settings["lost_action_s"],
            "hold": self.hold and {**self.hold, "stale": not self.online},
            "profile": "full" if self.settings["stream_profile"] == "auto" else self.settings["stream_profile"],
            "profile_chosen": self.settings["stream_profile"],
            "profile_why": "" if self.settings["stream_profile"] == "auto" else "set by an admin",
        }

    def shut_out(self, viewer: dict[str, Any] | None) -> bool:
        theirs = self.taken_from is not None and viewer is not None and self.taken_from["id"] == viewer["id"]
        return self.blind and theirs
