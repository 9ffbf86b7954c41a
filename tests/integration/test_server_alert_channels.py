"""Alerts reach people: by mail and webhook, signed, again after a failure, never twice, and only who may know."""

import asyncio
import hashlib
import hmac
import json
import re
from collections import Counter
from collections.abc import AsyncIterator
from contextlib import suppress
from functools import partial
from pathlib import Path

import pytest
from alert_scene import CHANNELS, AlertScene, Inbox, listening
from control_world import ask, until
from tower_world import assert_problem, start_tower

from server.alerts.core.alert import Alert
from server.alerts.core.rules import RULES
from server.alerts.io import guarded_post, webhook
from server.alerts.io import message as notify
from server.alerts.io.sending_threads import MAX_OF_ONE
from server.alerts.store.channels.deliverer import MAX_MESSAGES, MESSAGES_WITHIN_S
from server.alerts.store.channels.outbox import RETRY_AFTER
from wire.ids import DroneId


@pytest.fixture
async def scene(tmp_path: Path) -> AsyncIterator[AlertScene]:
    inbox = Inbox()
    async with (
        listening(inbox, inbox.mail) as mail_port,
        listening(inbox, inbox.hook) as inbox.port,
        start_tower(tmp_path, **inbox.settings(mail_port)) as world,
    ):
        scene = AlertScene(world, inbox)
        await scene.settle()
        yield scene


async def test_every_rule_reaches_mail_and_webhook_once(scene: AlertScene) -> None:
    """Its beginning and its end, after a failure of both as well."""
    await scene.hook("Root", severity="notice")
    await scene.mail("Root", severity="notice")
    scene.agent.state(armed=True, airborne=True)
    scene.inbox.mails.clear()
    drone = scene.world.tower.hub.state.drones[DroneId(scene.drone_id)]
    await until("it to be in the air", lambda: drone.airborne)
    scene.inbox.busy = 6
    announcer, now = scene.world.tower.announcer, scene.world.clock()
    alerts = []
    for number, rule in enumerate(RULES, 1):
        drone_id = None if rule.tower_condition else DroneId(scene.drone_id)
        alerts.append(Alert(number, rule, "", drone_id, f"Words of {rule.name}.", now))
        announcer.changed(alerts[-1])
    names = {rule.name for rule in RULES}
    everything = Counter(f"{what} {name}" for what in ("opened", "closed") for name in names)

    def kept() -> Counter[str]:
        bodies = (json.loads(body) for body in scene.inbox.kept)
        # On a busy machine the drone of this scene opens alerts of its own meanwhile.
        ours = (body for body in bodies if body["words"] == f"Words of {body['rule']}.")
        return Counter(f"{body['happening']} {body['rule']}" for body in ours)

    def mailed() -> Counter[str]:
        found = Counter[str]()
        for mail in scene.inbox.mails:
            text = str(mail.get_payload())
            name = re.search(r"Words of ([a-z-]+)\.", text)
            if name is not None:
                found[f"{'closed' if text.startswith('Over') else 'opened'} {name[1]}"] += 1
        return found

    opened = Counter({one: 1 for one in everything if one.startswith("opened")})
    await until("the failures", lambda: scene.world.tower.alert_deliverer.counts["failed"] == 6)
    await until("the others", lambda: (kept() + mailed()).total() == 2 * len(RULES) - 6)
    scene.later(10)
    await until("all beginnings", lambda: kept() == mailed() == opened)
    for alert in alerts:
        alert.closed_at = scene.world.clock()
        announcer.changed(alert)
    await until("all ends", lambda: kept() == mailed() == everything)


async def test_a_webhook_is_called_with_a_signature_and_again_after_a_failure(scene: AlertScene) -> None:
    secret = (await scene.hook("Anna"))["secret"]
    await scene.hook("Mallory")
    scene.inbox.busy = 1
    scene.agent.state(armed=True, airborne=True)
    await scene.hears("Anna", "opened unattended")
    await until("the failure", lambda: scene.world.tower.alert_deliverer.counts["failed"] == 1)
    (channel,) = (await scene.clients["Anna"].get(CHANNELS)).json()
    assert (channel["problem"], channel["waiting"], channel["sent_at"]) == ("the server answers 500", 1, None)

    scene.later(10)
    await scene.hears("Anna", "opened unattended", "opened unattended")
    assert (await ask(scene.clients["Anna"], scene.drone_id, "acquire")).status_code == 200
    await scene.hears("Anna", "opened unattended", "opened unattended", "closed unattended")
    keys = [headers["x-tower-delivery"] for headers, _ in scene.inbox.calls]
    assert keys[0] == keys[1] != keys[2]
    for headers, body in scene.inbox.calls:
        signed = f"{headers['x-tower-timestamp']}.".encode() + body
        assert headers["x-tower-signature"] == "v1=" + hmac.new(secret.encode(), signed, hashlib.sha256).hexdigest()
    told = json.loads(scene.inbox.calls[0][1])
    assert told["words"] == "hawk is in the air, and nobody has the controls."
    assert told["drone"] == {"id": scene.drone_id, "name": "hawk"}
    assert scene.heard("Mallory") == []
    # What was sent is written down a moment after the answer.
    await until("all to be written down", lambda: scene.world.tower.alert_deliverer.counts["sent"] == 2)
    (channel,) = (await scene.clients["Anna"].get(CHANNELS)).json()
    assert (channel["problem"], channel["waiting"], channel["sent_at"] is None) == ("", 0, False)


async def test_mail_needs_the_code_that_was_sent_there(scene: AlertScene) -> None:
    anna, mails = scene.clients["Anna"], scene.inbox.mails
    asked = {"kind": "mail", "target": "anna@example.org", "drones": "own"}
    made = (await anna.post(CHANNELS, json=asked)).json()
    assert (made["secret"], made["problem"], made["channel"]["is_confirmed"]) == ("", "", False)
    path = f"{CHANNELS}/{made['channel']['id']}"
    (mail,) = mails
    assert (mail["To"], mail["From"]) == ("anna@example.org", "tower@example.org")
    code = re.search(r"(?m)^    (\w{8})\s*$", mail.get_payload())
    assert code is not None

    assert_problem(await anna.post(f"{path}/test"), 409, "bad-alert-channel")
    assert_problem(await anna.post(f"{path}/confirm", json={"code": "WRONG"}), 409, "bad-alert-channel")
    assert (await anna.post(f"{path}/confirm", json={"code": code[1].lower()})).json()["is_confirmed"]
    assert (await anna.post(f"{path}/test")).json() == {"is_sent": True, "problem": ""}
    scene.agent.state(armed=True, airborne=True)
    await until("the beginning", lambda: len(mails) == 3)
    assert (await ask(anna, scene.drone_id, "acquire")).status_code == 200
    await until("the end", lambda: len(mails) == 4)
    subjects = ["A test of your alerts", "hawk: Unattended", "Over: hawk: Unattended"]
    assert [mail["Subject"] for mail in mails[1:]] == subjects
    scene.inbox.busy = 1
    assert (await anna.post(f"{path}/test")).json() == {"is_sent": False, "problem": "the mail server answers 451"}


async def test_what_nobody_answers_goes_to_the_admins(scene: AlertScene) -> None:
    await scene.hook("Anna", severity="critical")
    await scene.hook("Root", severity="critical")
    scene.agent.state(armed=True, airborne=True)
    hub = scene.world.tower.hub
    await until("it to be in the air", lambda: bool(hub.alerts.live()))
    hub.detach_link(scene.agent.link)
    for name in ("Anna", "Root"):
        await scene.hears(name, "opened link-lost")
    scene.later(121)
    await scene.hears("Root", "opened link-lost", "unanswered link-lost")
    assert scene.heard("Anna") == ["opened link-lost"]


async def test_an_answer_stops_what_nobody_answered(scene: AlertScene) -> None:
    await scene.hook("Root", severity="critical")
    scene.agent.state(armed=True, airborne=True)
    hub, counts = scene.world.tower.hub, scene.world.tower.alert_deliverer.counts
    await until("it to be in the air", lambda: bool(hub.alerts.live()))
    hub.detach_link(scene.agent.link)
    await scene.hears("Root", "opened link-lost")
    scene.inbox.busy = 1
    scene.later(121)
    await until("the failure", lambda: counts["failed"] == 1)
    alert = next(one for one in hub.alerts.live() if one.rule.name == "link-lost")
    assert (await scene.clients["Anna"].post(f"/api/v1/alerts/{alert.id}/acknowledge")).status_code == 200
    scene.later(10)
    await until("it to be forgotten", lambda: counts["forgotten"] == 1)
    assert scene.heard("Root") == ["opened link-lost", "unanswered link-lost"], "the first attempt only"


async def test_no_beginning_comes_after_the_end(scene: AlertScene) -> None:
    await scene.hook("Anna")
    counts = scene.world.tower.alert_deliverer.counts
    scene.inbox.busy = 1
    scene.agent.state(armed=True, airborne=True)
    await until("the failure", lambda: counts["failed"] == 1)
    assert (await ask(scene.clients["Anna"], scene.drone_id, "acquire")).status_code == 200
    await scene.hears("Anna", "opened unattended", "closed unattended")
    await until("the end to be stored", lambda: not scene.world.tower.alert_writer.waiting())
    scene.later(10)
    await until("it to be forgotten", lambda: counts["forgotten"] == 1)
    assert scene.heard("Anna") == ["opened unattended", "closed unattended"]


async def test_slow_servers_of_one_user_delay_nobody_else(scene: AlertScene) -> None:
    release = asyncio.Event()

    async def silent(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await release.wait()
        writer.close()

    async with listening(scene.inbox, silent) as port:
        mallory = scene.clients["Mallory"]
        tests = []
        for number in range(5):
            body = {"kind": "webhook", "target": f"http://127.0.0.1:{port}/{number}"}
            made = (await mallory.post(CHANNELS, json=body)).json()
            tests.append(asyncio.create_task(mallory.post(f"{CHANNELS}/{made['channel']['id']}/test")))
        await until("some to be refused", lambda: sum(one.done() for one in tests) == 5 - MAX_OF_ONE)
        await scene.hook("Anna")
        scene.agent.state(armed=True, airborne=True)
        await scene.hears("Anna", "opened unattended")
        assert sum(one.done() for one in tests) == 5 - MAX_OF_ONE, "while the slow ones go on"
        release.set()
        answers = [(await one).json()["problem"] for one in tests]
    assert answers.count("others are still on their way: try again in a moment") == 5 - MAX_OF_ONE


@pytest.mark.parametrize("beginning", [b"HTTP/1.1 200 ok\r\nX: ", b"HTTP/1.1 200 ok\r\n\r\n"], ids=["head", "body"])
async def test_a_server_that_drips_is_cut_off(monkeypatch: pytest.MonkeyPatch, beginning: bytes) -> None:
    monkeypatch.setattr(guarded_post, "IN_ALL_S", 0.3)
    ended = asyncio.Event()

    async def drips(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with suppress(OSError):
            await reader.readuntil(b"\r\n\r\n")
            writer.write(beginning)
            while True:
                writer.write(b"a")
                await writer.drain()
                await asyncio.sleep(0.05)
        writer.close()
        ended.set()

    async with listening(Inbox(), drips) as port:
        message = notify.Message("key", "", "", {})
        call = partial(webhook.call_webhook, f"http://127.0.0.1:{port}/", "k", message, 1, may_be_private=True)
        async with asyncio.timeout(8):  # less than the limit for one read, which never comes
            with pytest.raises(notify.NotSent, match="slow"):
                await asyncio.to_thread(call)
            await ended.wait()


async def test_a_disabled_user_is_told_nothing_more(scene: AlertScene) -> None:
    await scene.hook("Anna")
    scene.inbox.busy = 1
    counts = scene.world.tower.alert_deliverer.counts
    scene.agent.state(armed=True, airborne=True)
    await until("the failure", lambda: counts["failed"] == 1)
    path = f"/api/v1/users/{scene.people['Anna'].id}"
    answer = await scene.clients["Root"].patch(path, json={"disabled": True})
    assert answer.status_code == 200, answer.text
    scene.later(10)
    await until("it to be forgotten", lambda: counts["forgotten"] == 1)
    assert scene.heard("Anna") == ["opened unattended"], "the first attempt only"


async def test_whoever_lost_the_drone_meanwhile_is_not_told(scene: AlertScene) -> None:
    await scene.hook("Anna")
    scene.inbox.busy = 1
    scene.agent.state(armed=True, airborne=True)
    await until("the failure", lambda: scene.world.tower.alert_deliverer.counts["failed"] == 1)
    owner = f"/api/v1/drones/{scene.drone_id}/owners/{scene.people['Anna'].id}"
    assert (await scene.clients["Root"].delete(owner)).status_code == 200
    scene.later(10)

    await until("the delivery to be forgotten", lambda: scene.world.tower.alert_deliverer.counts["forgotten"] == 1)
    assert scene.heard("Anna") == ["opened unattended"], "the first attempt only"


async def test_a_delivery_survives_a_restart_and_comes_once(tmp_path: Path) -> None:
    inbox = Inbox(busy=1)
    async with listening(inbox, inbox.hook) as inbox.port:
        async with start_tower(tmp_path, webhooks_may_be_private=True) as world:
            scene = AlertScene(world, inbox)
            await scene.settle()
            await scene.hook("Anna", severity="warning")
            scene.agent.state(armed=True, airborne=True)
            await until("the failure", lambda: world.tower.alert_deliverer.counts["failed"] == 1)
            await until("the alert to be stored", lambda: not world.tower.alert_writer.waiting())
        async with start_tower(tmp_path, webhooks_may_be_private=True) as world:
            world.clock.advance(15)
            world.tower.alert_deliverer.wake()
            await until("the delivery", lambda: world.tower.alert_deliverer.counts["sent"] >= 1)
            await until("quiet", lambda: len(inbox.calls) == 2)
    assert len({headers["x-tower-delivery"] for headers, _ in inbox.calls}) == 1


async def test_bad_input_and_other_peoples_channels(scene: AlertScene) -> None:
    anna, mallory = scene.clients["Anna"], scene.clients["Mallory"]
    for body in ({"kind": "mail", "target": "nobody"}, {"kind": "webhook", "target": "ftp://example.org"}):
        assert_problem(await anna.post(CHANNELS, json=body), 409, "bad-alert-channel")
    made = await scene.hook("Anna")
    path = f"{CHANNELS}/{made['channel']['id']}"
    for request in (mallory.patch(path, json={}), mallory.delete(path), mallory.post(f"{path}/test")):
        assert_problem(await request, 404, "unknown-alert-channel")
    assert (await mallory.get(CHANNELS)).json() == []
    assert (await anna.patch(path, json={"severity": "critical", "drones": "own"})).json()["severity"] == "critical"
    for _ in range(4):
        await scene.hook("Anna")
    answer = await anna.post(CHANNELS, json={"kind": "webhook", "target": "http://127.0.0.1/x"})
    assert_problem(answer, 409, "too-many-alert-channels")
    scene.inbox.busy = 0
    assert (await anna.post(f"{path}/test")).json()["is_sent"]
    assert (await anna.delete(path)).status_code == 204
    assert_problem(await anna.post(f"{path}/test"), 404, "unknown-alert-channel")
    dead = {"kind": "webhook", "target": "http://127.0.0.1:9/"}
    made = (await anna.post(CHANNELS, json=dead)).json()
    tried = (await anna.post(f"{CHANNELS}/{made['channel']['id']}/test")).json()
    assert tried == {"is_sent": False, "problem": "the server cannot be reached (ConnectionRefusedError)"}
    for _ in range(MAX_MESSAGES - 2):
        await anna.post(f"{CHANNELS}/{made['channel']['id']}/test")
    refused = await anna.post(f"{CHANNELS}/{made['channel']['id']}/test")
    assert_problem(refused, 429, "too-many-tries")
    assert 0 < int(refused.headers["Retry-After"]) <= MESSAGES_WITHIN_S
    scene.world.clock.advance(MESSAGES_WITHIN_S)
    assert (await anna.post(f"{CHANNELS}/{made['channel']['id']}/test")).status_code == 200


async def test_admins_see_what_was_given_up(scene: AlertScene) -> None:
    await scene.hook("Anna")
    scene.inbox.busy = len(RETRY_AFTER) + 1
    scene.agent.state(armed=True, airborne=True)
    deliverer = scene.world.tower.alert_deliverer
    given_up = "/api/v1/alert-deliveries/given-up"
    for number, wait in enumerate(RETRY_AFTER, 1):
        await until(f"attempt {number}", lambda number=number: deliverer.counts["failed"] == number)
        assert (await scene.clients["Root"].get(given_up)).json() == []
        scene.later(wait.total_seconds())
        if wait.total_seconds() > 3_000:
            scene.clients["Root"] = await scene.world.signed_in(scene.people["Root"])
    await until("the last one", lambda: deliverer.counts["given_up"] == 1)
    (one,) = (await scene.clients["Root"].get(given_up)).json()
    assert one["user"]["name"] == "Anna"
    assert (one["kind"], one["target"]) == ("webhook", "127.0.0.1"), "the path may be a secret"
    assert (one["happening"], one["drone_id"], one["drone_name"]) == ("opened", scene.drone_id, "hawk")
    assert (one["problem"], one["attempts"]) == ("the server answers 500", len(RETRY_AFTER) + 1)
    assert (await scene.clients["Root"].get(given_up, params={"before": one["id"]})).json() == []
    anna = await scene.world.signed_in(scene.people["Anna"])
    assert_problem(await anna.get(given_up), 403, "admins-only")
    scene.later(31)
    await until("the metric", lambda: deliverer.given_up == 1)
    shown = (await scene.clients["Root"].get("/metrics")).text
    assert "tower_alert_deliveries_given_up 1.0" in shown
