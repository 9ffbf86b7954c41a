"""A mail server and a webhook on loopback, and people who let a tower tell them of alerts there."""

import asyncio
import json
import re
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from email import message_from_bytes
from email.message import Message
from typing import Any, Final

import httpx
from control_world import ObedientAgent, until
from tower_world import Person, TowerWorld

from server.alerts.io.mail import MailServer
from server.kernel.people import Role

CHANNELS: Final = "/api/v1/me/alert-channels"


@dataclass
class Inbox:
    """A mail server and a webhook on loopback. `busy`: so many of the next requests fail."""

    port: int = 0
    mails: list[Message] = field(default_factory=list)
    calls: list[tuple[dict[str, str], bytes]] = field(default_factory=list)
    kept: list[bytes] = field(default_factory=list)
    """Bodies of the calls that succeeded."""
    busy: int = 0

    def settings(self, mail_port: int) -> dict[str, Any]:
        """Of a tower that uses it."""
        mail = MailServer("127.0.0.1", mail_port, "none")
        return {"mail": mail, "mail_from": "tower@example.org", "webhooks_may_be_private": True}

    def refuses(self) -> bool:
        self.busy -= 1
        return self.busy >= 0

    async def mail(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.write(b"220 here\r\n")
        while line := await reader.readline():
            verb = line[:4].upper()
            if verb == b"DATA":
                writer.write(b"354 go on\r\n")
                text = await reader.readuntil(b"\r\n.\r\n")
                if not self.refuses():
                    self.mails.append(message_from_bytes(text[:-3]))
                    writer.write(b"250 kept\r\n")
                else:
                    writer.write(b"451 busy\r\n")
            elif verb == b"QUIT":
                break
            else:
                writer.write(b"250 well\r\n")
        writer.close()

    async def hook(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        head = (await reader.readuntil(b"\r\n\r\n")).decode()
        headers = {name.lower(): value for name, value in re.findall(r"(?m)^([\w-]+): (.*)\r$", head)}
        body = await reader.readexactly(int(headers["content-length"]))
        self.calls.append((headers | {"path": head.split()[1]}, body))
        is_refused = self.refuses()
        if not is_refused:
            self.kept.append(body)
        status = b"500 busy" if is_refused else b"204 kept"
        writer.write(b"HTTP/1.1 " + status + b"\r\nContent-Length: 0\r\nConnection: close\r\n\r\n")
        writer.close()


@asynccontextmanager
async def listening(inbox: Inbox, what: Any) -> AsyncIterator[int]:
    async with await asyncio.start_server(what, "127.0.0.1", 0) as server:
        yield server.sockets[0].getsockname()[1]


class AlertScene:
    """Anna owns hawk, Mallory nothing; Root is an admin."""

    def __init__(self, world: TowerWorld, inbox: Inbox) -> None:
        self.world, self.inbox = world, inbox
        self.people: dict[str, Person] = {}
        self.clients: dict[str, httpx.AsyncClient] = {}
        self.agent: ObedientAgent

    async def settle(self) -> None:
        for name, role in (("Anna", Role.OPERATOR), ("Mallory", Role.OPERATOR), ("Root", Role.ADMIN)):
            self.people[name] = await self.world.add_user(name, role)
            self.clients[name] = await self.world.signed_in(self.people[name])
        drone = await self.world.add_drone("hawk", self.people["Anna"])
        self.drone_id = drone.id
        self.agent = ObedientAgent(self.world.tower.hub, drone.id)

    async def hook(self, name: str, **more: Any) -> dict[str, Any]:
        target = f"http://127.0.0.1:{self.inbox.port}/{name}"
        answer = await self.clients[name].post(CHANNELS, json={"kind": "webhook", "target": target, **more})
        assert answer.status_code == 201, answer.text
        made: dict[str, Any] = answer.json()
        return made

    async def mail(self, name: str, **more: Any) -> None:
        """A channel whose user has entered the code."""
        asked = {"kind": "mail", "target": f"{name.lower()}@example.org", **more}
        made = (await self.clients[name].post(CHANNELS, json=asked)).json()
        code = re.search(r"(?m)^    (\w{8})\s*$", str(self.inbox.mails[-1].get_payload()))
        assert code is not None
        path = f"{CHANNELS}/{made['channel']['id']}/confirm"
        assert (await self.clients[name].post(path, json={"code": code[1]})).json()["is_confirmed"]

    def later(self, seconds: float) -> None:
        self.world.clock.advance(seconds)
        self.world.tower.alert_deliverer.wake()

    def heard(self, name: str) -> list[str]:
        """What the webhook of this user was told, in order."""
        bodies = (json.loads(body) for headers, body in self.inbox.calls if headers["path"] == f"/{name}")
        return [f"{body['happening']} {body['rule']}" for body in bodies]

    async def hears(self, name: str, *what: str) -> None:
        await until(f"{name}: {what}", lambda: self.heard(name) == list(what))
