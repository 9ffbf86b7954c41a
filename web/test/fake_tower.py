"""A fake tower for the console's development: three simulated drones over the real /live protocol.

It has no physics (straight lines), checks no password, and stores nothing. Any name signs in as an
operator who owns all drones; `admin` signs in as an admin. Run it after `npm run build`:

    .venv/bin/python web/test/fake_tower.py [PORT]
"""

import asyncio
import contextlib
import json
import struct
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import uvicorn
from fake_drone import ALT_HOLD, AUTO, HOLDS, STEP_S, FakeDrone
from fake_video import router as video_router
from fastapi import FastAPI, Request, Response, WebSocket, WebSocketDisconnect
from fastapi.responses import FileResponse, JSONResponse
from pymavlink.dialects.v20 import ardupilotmega as dialect

DIST = Path(__file__).resolve().parent.parent / "dist"
CSP = (
    "default-src 'self'; script-src 'self' 'wasm-unsafe-eval'; style-src 'self'; img-src 'self' data: blob:; "
    "worker-src 'self'; connect-src 'self'; object-src 'none'; base-uri 'none'; frame-ancestors 'none'"
)


LASTS_S = {"operator": 5.0, "tower": 4.0}


class FakeTower:
    def __init__(self) -> None:
        drones = [
            FakeDrone(1, "Heron", 0, 0),
            FakeDrone(2, "Kestrel", 40, 60),
            FakeDrone(3, "Swift", -60, 150),
            FakeDrone(4, "Plover", -30, -60, online=False),
        ]
        self.drones = {drone.id: drone for drone in drones}
        self.preferences: dict[str, Any] = {}
        self.sockets: dict[WebSocket, dict[str, Any]] = {}
        self.tasks: set[asyncio.Task[None]] = set()
        busy = self.drones[3]
        busy.mode, busy.armed, busy.alt = AUTO, True, 25.0

    async def tell(self, event: dict[str, Any]) -> None:
        for socket in list(self.sockets):
            with contextlib.suppress(RuntimeError, WebSocketDisconnect):
                await socket.send_text(json.dumps(event))

    async def show(self, drone: FakeDrone) -> None:
        for socket, user in list(self.sockets.items()):
            with contextlib.suppress(RuntimeError, WebSocketDisconnect):
                await socket.send_text(json.dumps({"type": "drone", "drone": drone.as_json(user)}))

    async def turn(self, drone: FakeDrone, user: dict[str, Any]) -> None:
        """The assistant's turn begins or continues; it ends a second later."""
        if drone.assisted_s <= 0:
            await self.tell({"type": "turn", "drone_id": drone.id, "user": user})
        drone.assisted_s = 1.0

    async def end_turns(self) -> None:
        for drone in self.drones.values():
            if drone.assisted_s > 0:
                drone.assisted_s -= STEP_S
                if drone.assisted_s <= 0 and drone.assistant:
                    await self.tell({"type": "turn", "drone_id": drone.id, "user": drone.holder})

    async def hold(self, drone: FakeDrone, cause: str = "order", mode: int = ALT_HOLD) -> None:
        drone.mode, drone.target = mode, None
        base = {"type": "hold", "drone_id": drone.id, "epoch": drone.epoch, "cause": cause}
        steps = [("ordered", "", 0), ("sticks_centred", "", 1), ("mode_requested", "ALT_HOLD", 2)]
        steps += [("mode_acknowledged", "", 6), ("confirmed", "ALT_HOLD", 8)]
        if drone.name == "Kestrel":
            steps[3:] = [("unconfirmed", "no answer to DO_SET_MODE after 5 attempts", 2600)]
        for step, detail, elapsed_ms in steps:
            await self.tell({**base, "step": step, "detail": detail, "elapsed_ms": elapsed_ms})
            await asyncio.sleep(0.15)
        drone.heartbeat()

    async def rehearse(self, drone: FakeDrone, what: str) -> None:
        base = {"type": "rehearsal", "drone_id": drone.id, "what": what, "lasts_s": LASTS_S[what]}
        await self.tell({**base, "phase": "begun", "hold_ms": None, "text": "The loss has begun."})
        await asyncio.sleep(2)
        await self.tell({**base, "phase": "held", "hold_ms": 2008.4, "text": "It holds in ALT_HOLD."})
        await self.hold(drone, "pilot-lost")
        await self.tell({**base, "phase": "ended", "hold_ms": 2008.4, "text": "The link is as before."})

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
                    await self.tell({"type": "link", "drone_id": drone.id, "rtt_ms": 40 + drone.id, "loss": 0.01})
                batch += b"".join(drone.out)
                drone.out.clear()
            for socket in list(self.sockets):
                with contextlib.suppress(RuntimeError, WebSocketDisconnect):
                    await socket.send_bytes(batch)
            await self.end_turns()
            if tick % 5 == 0:
                await self.tell({"type": "ping", "sequence": tick})
            await asyncio.sleep(STEP_S)

    async def change(self, drone: FakeDrone, action: str, user: dict[str, Any], body: dict[str, Any]) -> str | None:
        """The refusal in words, or None."""
        me = {"id": user["id"], "name": user["name"]}
        holds = action in ("take", "give", "accept")
        if action == "stay":
            if drone.hold is None or drone.hold["phase"] != "counting":
                return f"Nothing is counted down for {drone.name}."
            drone.hold_as("stayed")
            await self.show(drone)
            return None
        if action == "acquire":
            if drone.holder and drone.holder != me:
                return f"{drone.holder['name']} has the controls of {drone.name}."
            drone.holder = me
        elif action == "release":
            drone.holder = None
        elif action == "take":
            if drone.holder != me:
                drone.taken_from, drone.holder = drone.holder, me
                drone.blind = body.get("watch") is False
            drone.offered, drone.assistant = False, None
        elif action == "give":
            drone.offered = True
        elif action == "accept":
            if not body.get("sticks_centred"):
                return "Centre the sticks first."
            drone.holder, drone.taken_from, drone.offered, drone.blind = drone.taken_from, None, False, False
        else:
            drone.assistant = me if action == "assist" else None
        drone.epoch += 1
        past = {
            "acquire": "acquired",
            "release": "released",
            "take": "taken",
            "give": "given",
            "accept": "accepted",
            "assist": "assisting",
            "unassist": "assist_ended",
        }[action]
        await self.tell_change(drone, past, me, body.get("reason") or "")
        if holds:
            task = asyncio.create_task(self.hold(drone))
            self.tasks.add(task)
            task.add_done_callback(self.tasks.discard)
        return None

    async def tell_change(self, drone: FakeDrone, past: str, by: dict[str, Any] | None, reason: str) -> None:
        await self.show(drone)
        event = {"drone_id": drone.id, "event": past, "epoch": drone.epoch, "holder": drone.holder}
        await self.tell({"type": "control", **event, "by": by, "reason": reason})

    async def play(self, what: str, drone: FakeDrone) -> None:
        """Triggers what a real tower does on its own: `GET /fake/WHAT/DRONE`."""
        if what == "revoke":
            drone.holder = None
            drone.epoch += 1
            await self.tell_change(drone, "revoked", {"id": 1, "name": "admin"}, "ownership removed")
        elif what == "remove":
            await self.tell({"type": "drone_removed", "drone_id": drone.id})
        elif what in ("pilot-lost", "sticks-stale"):
            await self.hold(drone, what)
        elif what in HOLDS:
            drone.armed, drone.alt = True, max(drone.alt, 20.0)
            drone.hold_as(what)
            await self.show(drone)
        elif what == "flown":
            drone.hold = None
            await self.show(drone)
        elif what == "offline":
            drone.online = not drone.online
            await self.show(drone)


tower = FakeTower()


@contextlib.asynccontextmanager
async def lifespan(_: FastAPI) -> Any:
    task = asyncio.create_task(tower.fly())
    yield
    task.cancel()


app = FastAPI(lifespan=lifespan)
app.include_router(video_router)


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


@app.get("/api/v1/me/preferences")
async def preferences() -> Response:
    return JSONResponse(tower.preferences)


@app.put("/api/v1/me/preferences/{name}")
async def keep_preference(name: str, request: Request) -> Response:
    tower.preferences[name] = await request.json()
    return Response(status_code=204)


@app.post("/api/v1/drones/{drone_id}/control/{action}")
async def control(drone_id: int, action: str, request: Request) -> Response:
    user = user_of(request.cookies)
    drone = tower.drones.get(drone_id)
    if user is None or drone is None:
        return problem(404, "Not found", "There is no such drone.")
    refusal = await tower.change(drone, action, user, await request.json())
    return problem(409, "Refused", refusal) if refusal else JSONResponse(drone.as_json(user))


@app.get("/api/v1/drones/{drone_id}/settings")
async def settings(drone_id: int) -> Response:
    return JSONResponse(tower.drones[drone_id].settings)


@app.patch("/api/v1/drones/{drone_id}/settings")
async def change_settings(drone_id: int, request: Request) -> Response:
    changes = await request.json()
    if changes.get("lost_hold_s", 2) > 60:
        body = {"title": "The request is not valid", "status": 422, "detail": "One field is at fault."}
        errors = [{"in": "body", "field": "lost_hold_s", "message": "must be 60 at most"}]
        return JSONResponse({**body, "errors": errors}, status_code=422)
    tower.drones[drone_id].settings.update(changes)
    await tower.show(tower.drones[drone_id])
    return JSONResponse(tower.drones[drone_id].settings)


@app.get("/api/v1/drones/{drone_id}/loss-check")
async def loss_check(drone_id: int) -> Response:
    return JSONResponse(tower.drones[drone_id].loss_check())


@app.post("/api/v1/drones/{drone_id}/loss-check/acknowledge")
async def acknowledge(drone_id: int, request: Request) -> Response:
    if (await request.json()).get("drone") != tower.drones[drone_id].name:
        return problem(422, "The request is not valid", "Name the drone whose dangers you have read.")
    tower.drones[drone_id].acknowledged = True
    await tower.tell({"type": "loss_check", "drone_id": drone_id})
    return JSONResponse(tower.drones[drone_id].loss_check())


@app.get("/api/v1/drones/{drone_id}/receiver-setup")
async def receiver_setup(drone_id: int) -> Response:
    return JSONResponse(tower.drones[drone_id].receiver_setup())


@app.post("/api/v1/drones/{drone_id}/receiver-setup")
async def set_up(drone_id: int) -> Response:
    drone = tower.drones[drone_id]
    drone.parameters = {row["name"]: row["wanted"] for row in drone.receiver_setup()["rows"]}
    begun: dict[str, Any] = {
        "id": "setup",
        "drone_id": drone_id,
        "work": "parameters_write",
        "kind": None,
        "state": "done",
        "phase": "",
        "done": 2,
        "total": 2,
        "words": f"Both parameters were written to {drone.name}.",
        "item": None,
        "code": "",
        "hash": None,
        "refusals": [],
        "refused": 0,
        "by": None,
        "began_at": datetime.now(UTC).isoformat(),
        "ended_at": datetime.now(UTC).isoformat(),
    }
    return JSONResponse(begun, status_code=202)


@app.get("/api/v1/drones/{drone_id}/rehearsal")
async def rehearsal_terms(drone_id: int) -> Response:
    return JSONResponse({"lasts_s": LASTS_S, "running": False, "simulated": drone_id == 1})


@app.post("/api/v1/drones/{drone_id}/rehearsal")
async def rehearsal(drone_id: int, request: Request) -> Response:
    what = (await request.json())["what"]
    task = asyncio.create_task(tower.rehearse(tower.drones[drone_id], what))
    tower.tasks.add(task)
    task.add_done_callback(tower.tasks.discard)
    return JSONResponse({"what": what, "phase": "begun"}, status_code=202)


@app.get("/fake/{what}/{drone_id}")
async def fake(what: str, drone_id: int) -> Response:
    await tower.play(what, tower.drones[drone_id])
    return Response(status_code=204)


@app.websocket("/api/v1/live")
async def live(socket: WebSocket) -> None:
    user = user_of(socket.cookies)
    await socket.accept(subprotocol="tower.v1")
    if user is None:
        await socket.close(4401)
        return
    drones = [drone.as_json(user) for drone in tower.drones.values()]
    now = datetime.now(UTC).isoformat()
    await socket.send_text(json.dumps({"type": "welcome", "user": user, "drones": drones, "server_time": now}))
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
    if data[:4] == b"\0\0\0\0":
        data = data[8:]
    drone = tower.drones.get(struct.unpack_from("<I", data)[0])
    mine = drone is not None and drone.holder is not None and drone.holder["id"] == user["id"]
    assists = drone is not None and drone.assistant is not None and drone.assistant["id"] == user["id"]
    if drone is None or not (mine or assists):
        await refuse(socket, drone, "not-in-control", "You do not have the controls.")
        return
    if assists:
        await tower.turn(drone, drone.assistant or {})
    elif drone.assisted_s > 0:
        await refuse(socket, drone, "assisted", "admin assists: your commands wait.")
        return
    parser = dialect.MAVLink(None)
    parser.robust_parsing = True
    for message in parser.parse_buffer(data[4:]) or []:
        drone.obey(message)


async def refuse(socket: WebSocket, drone: FakeDrone | None, code: str, text: str) -> None:
    notice = {"severity": "warning", "code": code, "text": text, "count": 1}
    await socket.send_text(json.dumps({"type": "notice", **notice, "drone_id": drone.id if drone else None}))


@app.get("/{path:path}")
async def page(path: str) -> Response:
    file = DIST / (path or "index.html")
    headers = {"Content-Security-Policy": CSP}
    return FileResponse(file if file.is_file() else DIST / "index.html", headers=headers)


if __name__ == "__main__":
    uvicorn.run(app, host="127.0.0.1", port=int(sys.argv[1]) if len(sys.argv) > 1 else 8000, log_level="warning")
