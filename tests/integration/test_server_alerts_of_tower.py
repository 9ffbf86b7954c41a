"""The tower's own alerts, from its certificate file to mail, webhook, list and acknowledgement of admins."""

import asyncio
import ssl
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from alert_scene import AlertScene, Inbox, listening
from control_world import until
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric.ec import SECP256R1, generate_private_key
from cryptography.x509.oid import NameOID
from sqlalchemy import select
from tower_world import assert_problem, start_tower

from server.alerts.store.channels.tables import AlertDeliveryRow
from server.app.tower_watch import TowerWatch
from server.link.api.fault_log import FaultLog
from server.runtime.tower_condition import disk_space, shown_certificate_ends_at, stored_certificate_ends_at


def write_certificate(path: Path, ends_at: datetime) -> Path:
    """Writes a certificate, and beside it its key. Returns the path of the key."""
    key = generate_private_key(SECP256R1())
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "tower.example.org")])
    made = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(ends_at - timedelta(days=90))
        .not_valid_after(ends_at)
        .sign(key, hashes.SHA256())
    )
    path.write_bytes(made.public_bytes(serialization.Encoding.PEM))
    plain = serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    path.with_suffix(".key").write_bytes(key.private_bytes(serialization.Encoding.PEM, *plain))
    return path.with_suffix(".key")


async def test_a_certificate_that_ends_reaches_admins_and_is_renewed(tmp_path: Path) -> None:
    certificate = tmp_path / "proxy.pem"
    write_certificate(certificate, datetime.now(UTC) + timedelta(days=2))
    inbox = Inbox()
    async with (
        listening(inbox, inbox.mail) as mail_port,
        listening(inbox, inbox.hook) as inbox.port,
        start_tower(tmp_path, tls_certificate=certificate, **inbox.settings(mail_port)) as world,
    ):
        scene = AlertScene(world, inbox)
        await scene.settle()
        hub, root, anna = world.tower.hub, scene.clients["Root"], scene.clients["Anna"]
        both = {"tower-certificate", "tower-certificate-ends"}
        await until("both rules", lambda: {alert.rule.name for alert in hub.alerts.live()} == both)
        await scene.mail("Root", severity="critical", drones="own")
        await scene.hook("Root")
        await scene.hook("Anna")
        mails = len(inbox.mails)
        scene.later(121)
        await scene.hears("Root", "unanswered tower-certificate-ends")
        await until("the mail", lambda: len(inbox.mails) == mails + 1)
        assert inbox.mails[-1]["Subject"] == "Nobody has answered: Control Tower: Certificate ends"

        listed = (await root.get("/api/v1/alerts")).json()
        assert [(one["drone_id"], one["closed_at"]) for one in listed] == [(None, None)] * 2
        assert (await anna.get("/api/v1/alerts")).json() == []
        critical = next(one for one in listed if one["severity"] == "critical")
        path = f"/api/v1/alerts/{critical['id']}/acknowledge"
        assert_problem(await anna.post(path), 404, "unknown-alert")
        assert (await root.post(path)).json()["acknowledged_by"]["name"] == "Root"

        write_certificate(certificate, datetime.now(UTC) + timedelta(days=80))
        watch = TowerWatch(world.settings, hub.alerts, world.tower.loop_watch, FaultLog(hub.state.traffic))
        await watch.measure(with_certificate=True)
        await until("the end", lambda: hub.alerts.live() == [])
        await until("it to be stored", lambda: not world.tower.alert_writer.waiting())
        listed = (await root.get("/api/v1/alerts", params={"state": "closed"})).json()
        assert {one["rule"] for one in listed} == both
        async with world.database.writing() as session:
            row = (await session.scalars(select(AlertDeliveryRow).limit(1))).one()
            row.ended_at, row.problem = world.clock(), "the server answers 500"
        (given_up,) = (await root.get("/api/v1/alert-deliveries/given-up")).json()
        assert (given_up["drone_id"], given_up["drone_name"]) == (None, "")

        trail = (await root.get("/api/v1/audit", params={"action": "alert.acknowledged"})).json()
        assert [event["drone_id"] for event in trail] == [None]


async def test_the_certificate_that_a_proxy_shows(tmp_path: Path) -> None:
    ends_at = datetime(2030, 5, 1, 12, tzinfo=UTC)
    key = write_certificate(tmp_path / "shown.pem", ends_at)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(tmp_path / "shown.pem", key)
    async with await asyncio.start_server(lambda _, writer: writer.close(), "127.0.0.1", 0, ssl=context) as server:
        address = f"127.0.0.1:{server.sockets[0].getsockname()[1]}"
        shown = await asyncio.to_thread(shown_certificate_ends_at, address, "tower.example.org")
    assert shown == stored_certificate_ends_at(tmp_path / "shown.pem") == ends_at
    with pytest.raises(OSError, match="refused"):
        await asyncio.to_thread(shown_certificate_ends_at, address, "")
    (tmp_path / "empty.pem").write_text("nothing")
    with pytest.raises(ValueError):
        stored_certificate_ends_at(tmp_path / "empty.pem")


def test_the_disk_of_a_folder_that_does_not_exist_yet_is_that_of_its_parent(tmp_path: Path) -> None:
    there, missing = disk_space(tmp_path), disk_space(tmp_path / "a" / "b")
    assert there.device == missing.device == tmp_path.stat().st_dev
    assert missing.free_bytes > 0
