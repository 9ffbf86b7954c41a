"""Delivers announcements of alerts: writes them into the outbox, and sends what is due, again and again.

The path of a frame, the rules of alerts and a person's acknowledgement wait for none of this. What the tower has sent
but not noted when it is killed is sent once more, with the same key.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Callable
from datetime import datetime, timedelta
from functools import partial
from typing import Any, Final

import structlog
from sqlalchemy.exc import IntegrityError, SQLAlchemyError
from sqlalchemy.ext.asyncio import AsyncSession

from server.alerts.core.announcer import Announcement, Announcer, Happening
from server.alerts.io.message import Message, NotSent, SubscriptionGone
from server.alerts.io.sending_threads import SendingThreads
from server.alerts.store.channels import outbox
from server.alerts.store.channels.browsers import end_gone_browser
from server.alerts.store.channels.channels import about
from server.alerts.store.channels.given_up import count_given_up
from server.alerts.store.channels.outbox import Taken
from server.alerts.store.channels.push_key import PushKey
from server.alerts.store.channels.refusals import TooManyMessages
from server.kernel.clock import Clock
from server.kernel.people import Principal
from server.kernel.shares import ShareName
from server.live.hub import Hub
from server.runtime.vault import Vault, VaultError
from server.storage.database import Database
from wire.ids import DroneId

EVERY_S: Final = 5.0
"""How often it looks for alerts that nobody has answered."""
LOOKS_EVERY: Final = timedelta(seconds=30)
"""How often it looks for what another tower has written, or taken on and left."""
TIDIES_EVERY: Final = timedelta(hours=1)
WITHIN_S: Final = 40.0
"""More than a webhook may take in all; a name or a mail server may take longer, and keeps its thread."""
MAX_MESSAGES: Final = 10
MESSAGES_WITHIN_S: Final = 600.0
"""A user has at most ten tests and codes sent in ten minutes."""
OUTCOMES: Final = ("sent", "failed", "given_up", "forgotten", "dropped")
"""`failed`: an attempt, which is repeated; `forgotten`: its user may not know of it any more, or its browser is
gone; `dropped`: no room."""
_log = structlog.get_logger(__name__)

Send = Callable[[str, str, str, Message], None]
"""(kind, target, secret, message). Blocks; raises NotSent."""


class AlertDeliverer:
    """One instance per tower."""

    def __init__(
        self,
        hub: Hub,
        announcer: Announcer,
        database: Database,
        vault: Vault,
        clock: Clock,
        send: Send,
        push_key: PushKey,
        public_url: str,
    ) -> None:
        self._hub = hub
        self._announcer = announcer
        self._database = database
        self._vault = vault
        self._clock = clock
        self._send = send
        self.push_key = push_key
        self._public_url = public_url
        self._something = asyncio.Event()
        announcer.on_waiting = self.wake
        self._threads = SendingThreads()
        self._busy: set[int] = set()
        """Channels with a delivery on its way: one at a time, so that they stay in order."""
        self._tasks: set[asyncio.Task[None]] = set()
        self._due_at = self._tidy_at = clock()
        self.counts: Counter[str] = Counter()
        """Of OUTCOMES, since the start."""
        self.given_up = 0
        """In the list for admins (`given_up.py`), of all towers, as counted last."""
        self._counted_at = clock() - LOOKS_EVERY
        self._numbered = int(clock().timestamp())
        self._messages: dict[int, list[float]] = {}
        """When a user had tests and codes sent, within MESSAGES_WITHIN_S. One entry for each user at most."""

    def admit(self, user_id: int) -> None:
        """Before a test or a code. Raises TooManyMessages."""
        now_s = self._clock().timestamp()
        recent = [at_s for at_s in self._messages.get(user_id, ()) if now_s - at_s < MESSAGES_WITHIN_S]
        if len(recent) >= MAX_MESSAGES:
            raise TooManyMessages(MESSAGES_WITHIN_S - (now_s - recent[0]))
        self._messages[user_id] = [*recent, now_s]

    def next_number(self) -> int:
        """For tests: each is a message of its own."""
        self._numbered += 1
        return self._numbered

    def wake(self) -> None:
        """Something may be due."""
        self._something.set()

    def close(self) -> None:
        """What is on its way may still arrive, and is sent again after the next start."""
        for task in self._tasks:
            task.cancel()

    async def work(self) -> None:
        """Runs until cancelled."""
        while True:
            try:
                async with asyncio.timeout(EVERY_S):
                    await self._something.wait()
            except TimeoutError:
                pass
            self._something.clear()
            try:
                await self.step()
            except (SQLAlchemyError, OSError) as error:
                _log.error("alerts_not_delivered_yet", error=type(error).__name__)
                await asyncio.sleep(EVERY_S)

    async def step(self) -> None:
        """Stores what is announced, and sends what is due. Raises SQLAlchemyError and OSError of the database."""
        now = self._clock()
        self._announcer.tick(now)
        if await self._store(now):
            self._due_at = now
        while self._due_at <= self._clock():
            if not await self._deliver():
                break
        if self._tidy_at <= now:
            self._tidy_at = now + TIDIES_EVERY
            async with self._database.writing() as session:
                await outbox.tidy(session, now)

    async def _store(self, now: datetime) -> bool:
        taken = self._announcer.taken()
        if not taken:
            return False
        ready = [(one, self._content(one)) for one in taken]
        try:
            for is_last in (False, True):
                try:
                    async with self._database.writing() as session:
                        of_a_drone = self._hub.state.shares.limit(ShareName.DELIVERIES)
                        dropped = await outbox.put(
                            session, ready, knows=self._knows, owns=self._owns, now=now, of_a_drone=of_a_drone
                        )
                    break
                except IntegrityError:  # another tower has written the same ones just now
                    if is_last:
                        raise
        except (SQLAlchemyError, OSError):
            self._announcer.give_back(taken)
            raise
        if dropped:
            self.counts["dropped"] += dropped
            _log.error("alerts_not_delivered", count=dropped, reason="too many wait")
        return True

    async def _deliver(self) -> bool:
        """Begins what is due and has room. Whether there may be more."""
        now, room = self._clock(), self._threads.room
        if not room:
            return False
        busy, full = list(self._busy), self._threads.full
        async with self._database.writing() as session:
            taken, forgotten = await outbox.take(session, now, room=room, busy_channels=busy, full_users=full)
            next_due = await outbox.next_due(session)
            if self._counted_at + LOOKS_EVERY <= now:
                self.given_up, self._counted_at = await count_given_up(session), now
        self.counts["forgotten"] += forgotten
        for one in taken:
            self._busy.add(one.channel_id)
            task = asyncio.create_task(self._carry_out(one))
            self._tasks.add(task)
            task.add_done_callback(self._tasks.discard)
        await asyncio.sleep(0)  # their threads start
        self._due_at = min(next_due or now + LOOKS_EVERY, now + LOOKS_EVERY)
        return bool(taken)

    async def _carry_out(self, one: Taken) -> None:
        try:
            try:
                problem = await self._attempt(one)
            except SubscriptionGone:
                await self.end_gone(one.channel_id)
                self.counts["forgotten"] += 1
                return
            async with self._database.writing() as session:
                what = await self._note(session, one, problem)
            self.counts[what] += 1
        except (SQLAlchemyError, OSError) as error:  # sent or not, it is tried again
            _log.error("alert_delivery_not_noted", channel=one.channel_id, error=type(error).__name__)
        finally:
            self._busy.discard(one.channel_id)
            self._due_at = self._clock()
            self.wake()

    async def _note(self, session: AsyncSession, one: Taken, problem: str | None) -> str:
        """Returns what to count once it is kept."""
        now = self._clock()
        if problem is None:
            await outbox.forget(session, one)
            return "forgotten"
        if not problem:
            await outbox.sent(session, one, now)
            return "sent"
        if not await outbox.failed(session, one, problem, now):
            return "failed"
        _log.warning("alert_delivery_given_up", channel=one.channel_id, problem=problem)
        return "given_up"

    async def _attempt(self, one: Taken) -> str | None:
        """Returns the problem; empty: it was sent; None: its user may not know of it any more, or it is no news."""
        is_answered = self._hub.alerts.acknowledgement_of(int(one.content["id"])) is not None
        if not self._still_knows(one) or (is_answered and one.happening == Happening.UNANSWERED.value):
            return None
        message = message_of(one.happening, one.content, f"{one.content['id']}-{one.happening}-{one.channel_id}")
        return await self.send_now(one.kind, one.target, one.secret_sealed, int(one.user.user_id), message)

    async def send_now(self, kind: str, target: str, secret_sealed: str | None, user_id: int, message: Message) -> str:
        """Returns the problem in words; empty: it was sent. Raises SubscriptionGone: call `end_gone`."""
        if not self._threads.room or user_id in self._threads.full:
            return "others are still on their way: try again in a moment"
        try:
            secret = "" if secret_sealed is None else self._vault.open(secret_sealed, about=about(user_id))
            outcome = self._threads.start(user_id, partial(self._send, kind, target, secret, message))
            async with asyncio.timeout(WITHIN_S):
                await outcome
        except SubscriptionGone:
            raise
        except (NotSent, VaultError) as error:
            return str(error) or "it could not be sent"
        except TimeoutError:
            return "the other side is too slow"
        return ""

    async def end_gone(self, channel_id: int) -> None:
        """Deletes the channel of a browser that has ended its subscription, and what is on its way there."""
        async with self._database.writing() as session:
            await end_gone_browser(session, channel_id, self._clock())

    def _content(self, one: Announcement) -> dict[str, Any]:
        alert = one.alert
        return {
            "id": str(alert.id),
            "rule": alert.rule.name,
            "severity": alert.rule.severity.value,
            "badge": alert.rule.badge,
            "words": alert.words,
            "advice": alert.rule.advice,
            "drone": None if alert.drone_id is None else {"id": int(alert.drone_id), "name": one.drone_name},
            "other_drone_id": None if alert.about_stranger or alert.other_id is None else int(alert.other_id),
            "about_stranger": alert.about_stranger,
            "opened_at": alert.opened_at.isoformat(),
            "closed_at": None if alert.closed_at is None else alert.closed_at.isoformat(),
            "closed_why": alert.closed_why,
            "happening": one.happening.value,
            "url": f"{self._public_url}/{page_of(alert.drone_id)}" if self._public_url else "",
        }

    def _knows(self, user: Principal, one: Announcement) -> bool:
        alert = one.alert
        about = alert.about_stranger
        return self._hub.alerts.may_know(user, alert.drone_id, alert.other_id, about_stranger=about, at=alert.opened_at)

    def _still_knows(self, one: Taken) -> bool:
        content = one.content
        other = content["other_drone_id"]
        at = datetime.fromisoformat(content["opened_at"])
        drone_id = None if content["drone"] is None else DroneId(content["drone"]["id"])
        if one.drones == "own" and not self._is_owner(int(one.user.user_id), drone_id):
            return False
        if content["about_stranger"]:  # the other one is not named: who sees both has another alert
            return self._hub.alerts.may_know(one.user, drone_id, None, about_stranger=False, at=at)
        other_id = None if other is None else DroneId(other)
        return self._hub.alerts.may_know(one.user, drone_id, other_id, about_stranger=False, at=at)

    def _owns(self, user_id: int, one: Announcement) -> bool:
        return self._is_owner(user_id, one.alert.drone_id)

    def _is_owner(self, user_id: int, drone_id: DroneId | None) -> bool:
        if drone_id is None:
            return True  # the tower is everybody's who administers it
        drone = self._hub.state.drones.get(drone_id)
        return drone is not None and any(int(owner.id) == user_id for owner in drone.record.owners)


_BEGINNING: Final = {
    Happening.OPENED.value: "",
    Happening.CLOSED.value: "Over: ",
    Happening.UNANSWERED.value: "Nobody has answered: ",
}


def page_of(drone_id: int | None) -> str:
    """The page of the console for an alert, below the address of the tower."""
    return "#/admin/system" if drone_id is None else f"#/drone/{drone_id}"


def message_of(happening: str, content: dict[str, Any], key: str) -> Message:
    """Words and document of an announcement."""
    beginning = _BEGINNING[happening]
    lines = [f"{beginning}{content['words']}", ""]
    if happening != Happening.CLOSED.value:
        lines += [content["advice"], ""]
    lines += [f"Since {content['opened_at'][:19].replace('T', ' ')} UTC"]
    if content["closed_at"]:
        lines += [f"Over at {content['closed_at'][:19].replace('T', ' ')} UTC"]
    if content.get("closed_why"):  # one that waits since an older version has none
        lines += [content["closed_why"]]
    if content["url"]:
        lines += ["", content["url"]]
    about = "Control Tower" if content["drone"] is None else content["drone"]["name"]
    subject = f"{beginning}{about}: {content['badge']}"
    public = {name: value for name, value in content.items() if name != "about_stranger"}
    return Message(key, subject, "\n".join(lines) + "\n", {"type": "alert", **public})
