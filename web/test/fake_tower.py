"""A fake tower for looking at the console while developing: three invented drones over the real /live protocol.

It is no simulator (straight lines, no physics), checks no password, and keeps nothing. Any name signs in as an
operator who owns all drones; `admin` signs in as an admin. Run it after `npm run build`:

    .venv/bin/python web/test/fake_tower.py [PORT]
"""

import asyncio
import contextlib
import json
import math
import struct
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import uvicorn
from fastapi import FastAPI, Request, Response, WebSocket, WebSocketDisconnect
from fastapi.responses import FileResponse, JSONResponse
from pymavlink.dialects.v20 import ardupilotmega as dialect

DIST = Path(__file__).resolve().parent.parent / "dist"
CSP = (
    "default-src 'self'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
    "worker-src 'self'; connect-src 'self'; object-src 'none'; base-uri 'none'; frame-ancestors 'none'"
)
HOME = (47.3977, 8.5456)
METRE_DEG = 1 / 111_195
STEP_S = 0.1
SPEED_MPS = 8.0
CLIMB_MPS = 2.5
ALT_HOLD, AUTO, GUIDED, RTL, LAND = 2, 3, 4, 6, 9


class FakeDrone:
    """Flies straight to its target at constant speed."""

    def __init__(
        self, drone_id: int, name: str, north_m: float, east_m: float, *, online: bool = True
    ) -> None:
        self.id, self.name, self.online = drone_id, name, online
        self.epoch = 1
        self.holder: dict[str, Any] | None = None
        self.taken_from: dict[str, Any] | None = None
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
        """Keeps one drone busy, so that the map has something to show."""
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
            dialect.MAVLink_home_position_message(
                int(self.home[0] * 1e7), int(self.home[1] * 1e7), 400_000, *zeros
            )
        )
        self.put(
            dialect.MAVLink_sys_status_message(
                0, 0, 0, 200, 16_200, 1200, int(self.battery), 0, 0, 0, 0, 0, 0
            )
        )

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

    def as_json(self) -> dict[str, Any]:
        return {
            "id": self.id,
            "name": self.name,
            "online": self.online,
            "owners": [{"id": 2, "name": "olga"}],
            "holder": self.holder,
            "epoch": self.epoch,
            "taken_from": self.taken_from,
            "autopilot_heard": self.online,
        }


class FakeTower:
    def __init__(self) -> None:
        drones = [
            FakeDrone(1, "Heron", 0, 0),
            FakeDrone(2, "Kestrel", 40, 60),
            FakeDrone(3, "Swift", -60, 150),
            FakeDrone(4, "Plover", -30, -60, online=False),
        ]
        self.drones = {drone.id: drone for drone in drones}
        self.sockets: dict[WebSocket, dict[str, Any]] = {}
        busy = self.drones[3]
        busy.mode, busy.armed, busy.alt = AUTO, True, 25.0

    async def tell(self, event: dict[str, Any]) -> None:
        for socket in list(self.sockets):
            with contextlib.suppress(RuntimeError, WebSocketDisconnect):
                await socket.send_text(json.dumps(event))

    async def fly(self) -> None:
        tick = 0
        while True:
            tick += 1
            batch = b""
            for drone in self.drones.values():
                if not drone.online:
                    continue
                drone.step()
                drone.state(tick * 100)
                if tick % 10 == 0:
                    drone.heartbeat()
                    await self.tell(
                        {"type": "link", "drone_id": drone.id, "rtt_ms": 40 + drone.id, "loss": 0.01}
                    )
                batch += b"".join(drone.out)
                drone.out.clear()
            for socket in list(self.sockets):
                with contextlib.suppress(RuntimeError, WebSocketDisconnect):
                    await socket.send_bytes(batch)
            await asyncio.sleep(STEP_S)

    async def change(self, drone: FakeDrone, action: str, user: dict[str, Any], reason: str) -> str | None:
        """The refusal in words, or None."""
        me = {"id": user["id"], "name": user["name"]}
        if action == "acquire":
            if drone.holder and drone.holder != me:
                return f"{drone.holder['name']} has the controls of {drone.name}."
            drone.holder = me
        elif action == "release":
            drone.holder = None
        elif action == "take":
            drone.taken_from, drone.holder = drone.holder, me
        else:
            drone.holder, drone.taken_from = drone.taken_from, None
        drone.epoch += 1
        past = {"acquire": "acquired", "release": "released", "take": "taken", "give": "given"}[action]
        await self.tell({"type": "drone", "drone": drone.as_json()})
        event = {"drone_id": drone.id, "event": past, "epoch": drone.epoch, "holder": drone.holder}
        await self.tell({"type": "control", **event, "by": me, "reason": reason})
        if action in ("take", "give"):
            drone.mode = ALT_HOLD
            hold = {"drone_id": drone.id, "epoch": drone.epoch, "detail": "", "elapsed_ms": 8}
            await self.tell({"type": "hold", **hold, "step": "confirmed"})
        return None


tower = FakeTower()


@contextlib.asynccontextmanager
async def lifespan(_: FastAPI) -> Any:
    task = asyncio.create_task(tower.fly())
    yield
    task.cancel()


app = FastAPI(lifespan=lifespan)


def user_of(cookies: dict[str, str]) -> dict[str, Any] | None:
    name = cookies.get("fake_session")
    if not name:
        return None
    return {
        "id": 1 if name == "admin" else 2,
        "name": name,
        "role": "admin" if name == "admin" else "operator",
    }


def problem(status: int, title: str, detail: str) -> JSONResponse:
    body = {"type": "about:blank", "title": title, "status": status, "detail": detail}
    return JSONResponse(body, status_code=status, media_type="application/problem+json")


@app.post("/api/v1/session")
async def sign_in(request: Request) -> Response:
    body = await request.json()
    if body["password"] == "wrong":  # noqa: S105 - a word, not a secret
        return problem(401, "Not signed in", "The name or the password is wrong.")
    answer = JSONResponse(user_of({"fake_session": body["name"]}))
    answer.set_cookie("fake_session", body["name"], httponly=True, samesite="strict")
    return answer


@app.delete("/api/v1/session")
async def sign_out() -> Response:
    answer = Response(status_code=204)
    answer.delete_cookie("fake_session")
    return answer


@app.get("/api/v1/me")
async def me(request: Request) -> Response:
    user = user_of(request.cookies)
    return JSONResponse(user) if user else problem(401, "Not signed in", "Sign in first.")


@app.post("/api/v1/drones/{drone_id}/control/{action}")
async def control(drone_id: int, action: str, request: Request) -> Response:
    user = user_of(request.cookies)
    drone = tower.drones.get(drone_id)
    if user is None or drone is None:
        return problem(404, "Not found", "There is no such drone.")
    reason = (await request.json()).get("reason") or ""
    refusal = await tower.change(drone, action, user, reason)
    return problem(409, "Refused", refusal) if refusal else JSONResponse(drone.as_json())


@app.websocket("/api/v1/live")
async def live(socket: WebSocket) -> None:
    user = user_of(socket.cookies)
    await socket.accept(subprotocol="tower.v1")
    if user is None:
        await socket.close(4401)
        return
    drones = [drone.as_json() for drone in tower.drones.values()]
    now = datetime.now(UTC).isoformat()
    await socket.send_text(
        json.dumps({"type": "welcome", "user": user, "drones": drones, "server_time": now})
    )
    tower.sockets[socket] = user
    try:
        while True:
            message = await socket.receive()
            if message["type"] == "websocket.disconnect":
                break
            if message.get("bytes"):
                await obey(socket, user, message["bytes"])
    finally:
        del tower.sockets[socket]


async def obey(socket: WebSocket, user: dict[str, Any], data: bytes) -> None:
    drone = tower.drones.get(struct.unpack_from("<I", data)[0])
    if drone is None or not drone.holder or drone.holder["id"] != user["id"]:
        notice = {"severity": "warning", "code": "not-in-control", "text": "You do not have the controls."}
        await socket.send_text(
            json.dumps({"type": "notice", **notice, "drone_id": drone.id if drone else None, "count": 1})
        )
        return
    parser = dialect.MAVLink(None)
    parser.robust_parsing = True
    for message in parser.parse_buffer(data[4:]) or []:
        drone.obey(message)


@app.get("/{path:path}")
async def page(path: str) -> Response:
    file = DIST / (path or "index.html")
    headers = {"Content-Security-Policy": CSP}
    return FileResponse(file if file.is_file() else DIST / "index.html", headers=headers)


if __name__ == "__main__":
    uvicorn.run(
        app, host="127.0.0.1", port=int(sys.argv[1]) if len(sys.argv) > 1 else 8000, log_level="warning"
    )
