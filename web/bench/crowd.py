"""A tower of invented drones, and nothing else: the real console, a real socket, real MAVLink, as many as one likes.

python crowd.py PORT DRONES RATE_HZ [FOLDER]

FOLDER has the map files of the simulated land (python -m simulator.land_map --home 47.3977,8.5456 --out FOLDER).
"""

import asyncio
import itertools
import json
import math
import struct
import sys
from pathlib import Path
from typing import Any

import uvicorn
from fastapi import FastAPI, WebSocket, WebSocketDisconnect
from fastapi.responses import FileResponse, JSONResponse
from fastapi.staticfiles import StaticFiles
from pymavlink.dialects.v20 import ardupilotmega as dialect

DIST = Path(__file__).resolve().parent.parent / "dist"
HOME = (47.3977, 8.5456)
ARMED_COPTER = 217
GUIDED = 4
USER = {"id": 1, "name": "admin", "role": "admin"}


def drone(number: int) -> dict[str, Any]:
    return {
        "id": number,
        "name": f"Drone {number}",
        "online": True,
        "owners": [{"id": 2, "name": "olga"}],
        "holder": {"id": 2, "name": "olga"},
        "epoch": 1,
        "taken_from": None,
        "autopilot_heard": True,
        "armed": True,
        "airborne": True,
    }


class Crowd:
    """Each drone flies a circle of its own over a square of two kilometres."""

    def __init__(self, drones: int, rate_hz: float) -> None:
        self.drones = drones
        self.rate_hz = rate_hz
        self._mav = dialect.MAVLink(None, srcSystem=1, srcComponent=1)

    def beat(self, tick: int) -> bytes:
        """The newest state of all, as one binary message."""
        parts = []
        each_second = tick % max(1, round(self.rate_hz)) == 0
        side = math.ceil(math.sqrt(self.drones))
        for index in range(self.drones):
            angle = tick / self.rate_hz * 0.2 + index
            north, east = (index // side) / side - 0.5, (index % side) / side - 0.5
            lat = HOME[0] + north * 0.018 + math.sin(angle) * 0.0004
            lon = HOME[1] + east * 0.026 + math.cos(angle) * 0.0006
            height = 30 + 10 * math.sin(angle)
            heading = math.degrees(-angle) % 360
            said = [
                dialect.MAVLink_global_position_int_message(
                    0,
                    int(lat * 1e7),
                    int(lon * 1e7),
                    int(height * 1000),
                    int(height * 1000),
                    0,
                    0,
                    0,
                    int(heading * 100),
                ),
                dialect.MAVLink_vfr_hud_message(0, 9 + math.sin(angle), int(heading), 48, height, math.cos(angle)),
                dialect.MAVLink_attitude_message(0, 0.1, 0.1, math.radians(heading), 0, 0, 0),
            ]
            if each_second:
                said.append(dialect.MAVLink_heartbeat_message(2, 3, ARMED_COPTER, GUIDED, 4, 3))
                said.append(dialect.MAVLink_extended_sys_state_message(0, 2))
                said.append(
                    dialect.MAVLink_sys_status_message(0, 0, 0, 0, 15800, 900, 100 - index % 60, 0, 0, 0, 0, 0, 0)
                )
                said.append(dialect.MAVLink_gps_raw_int_message(0, 6, 0, 0, 0, 0, 0, 0, 0, 14))
            parts += [struct.pack("<I", index + 1) + message.pack(self._mav) for message in said]
        return b"".join(parts)


def layer(file: Path) -> dict[str, Any]:
    above = "above" in file.name
    heights = "heights" in file.name
    return {
        "id": file.stem,
        "name": file.stem,
        "role": "imagery" if above else "terrain" if heights else "map",
        "kind": "raster" if above or heights else "vector",
        "source": "file",
        "url": f"/maps/{file.name}",
        "tile_size": 256 if heights else 512,
        "max_zoom": None,
        "attribution": "",
    }


def create_app(crowd: Crowd, maps: Path | None) -> FastAPI:
    app = FastAPI()

    @app.get("/api/v1/me")
    async def me() -> JSONResponse:
        return JSONResponse(USER)

    @app.get("/api/v1/map")
    async def layers() -> JSONResponse:
        return JSONResponse({"layers": [layer(file) for file in sorted(maps.glob("*.pmtiles"))] if maps else []})

    @app.get("/maps/{name}")
    async def map_file(name: str) -> FileResponse:
        assert maps is not None
        return FileResponse(maps / Path(name).name)

    @app.websocket("/api/v1/live")
    async def live(socket: WebSocket) -> None:
        await socket.accept(subprotocol="tower.v1")
        squad = [drone(number) for number in range(1, crowd.drones + 1)]
        await socket.send_text(json.dumps({"type": "welcome", "user": USER, "drones": squad, "server_time": ""}))
        try:
            for tick in itertools.count():
                await socket.send_bytes(crowd.beat(tick))
                await asyncio.sleep(1 / crowd.rate_hz)
        except (WebSocketDisconnect, RuntimeError):
            return

    app.mount("/", StaticFiles(directory=DIST, html=True))
    return app


if __name__ == "__main__":
    port, drones, rate_hz = int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3])
    folder = Path(sys.argv[4]) if len(sys.argv) > 4 else None
    uvicorn.run(create_app(Crowd(drones, rate_hz), folder), host="127.0.0.1", port=port, log_level="warning")
