"""`tower doctor`: tests each part that a tower needs, and says what to do about each that does not work.

It changes nothing, and may run beside the tower.
"""

from __future__ import annotations

import asyncio
import errno
import os
import shutil
import socket
import ssl
import subprocess
import tempfile
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from email.utils import parsedate_to_datetime
from pathlib import Path
from typing import Final
from urllib.parse import urlsplit

import typer
from cryptography import x509

from server.runtime.listening import CannotListen, listen
from server.runtime.settings import Settings, SettingsError
from server.runtime.vault import VaultError
from server.storage.database import DatabaseError, DatabaseUnavailable, open_database
from server.storage.integrity import fault_in, sqlite_file
from server.storage.schema import DatabaseNotReady, check_schema

ANSWER_WITHIN_S: Final = 5.0
MAX_CLOCK_OFF_S: Final = 5.0
SET_NTP: Final = "`timedatectl set-ntp true`: sign-ins depend on the clock"
SOON: Final = 14
"""Days. A certificate that ends sooner is told of: whatever renews it has not."""


@dataclass(frozen=True)
class Finding:
    """What was found of one part. `good`: None if it could not be tested, or is not set. `remedy`: what to do."""

    part: str
    good: bool | None
    found: str
    remedy: str = ""


def doctor() -> None:
    """Test settings, database, keys, disk, ports, address, certificate, clock and bus; say what to do about each."""
    from server.app.commands.session import settings_now

    try:
        settings = settings_now()
    except SettingsError as error:
        _say([Finding("settings", False, str(error), "docs/settings.md has every setting")])
        raise typer.Exit(1) from None
    if not _say([Finding("settings", True, "each is one that the tower knows"), *examine(settings)]):
        raise typer.Exit(1)


def examine(settings: Settings) -> Iterator[Finding]:
    """Each part in turn. Blocks."""
    yield _database(settings)
    yield _keys(settings)
    yield _disk(settings)
    serves = _answers(settings)
    yield _tcp_port(settings, serves=serves)
    yield _udp_port(settings, serves=serves)
    yield from _address(settings)
    yield _certificate_file(settings.tls_certificate)
    yield _bus(settings)


def _say(findings: list[Finding]) -> bool:
    width = max(len(one.part) for one in findings)
    for one in findings:
        mark = {True: "ok", False: "!!", None: "--"}[one.good]
        typer.echo(f"{mark} {one.part:<{width}} {one.found}")
        if one.remedy:
            typer.echo(f"   {'':<{width}} -> {one.remedy}")
    return all(one.good is not False for one in findings)


def _database(settings: Settings) -> Finding:
    file = sqlite_file(settings.database_url)
    if file is not None:
        if not file.exists():
            first = "`tower serve` makes it at its first start; is TOWER_VAR the folder that you mean?"
            return Finding("database", None, f"there is no {file}", first)
        if fault := fault_in(file, whole=True):
            return Finding("database", False, f"{file} is damaged: {fault}", "restore a backup (docs/how-to/backup.md)")

    async def check() -> None:
        database = open_database(settings.database_url, timeout_s=ANSWER_WITHIN_S)
        try:
            await check_schema(database)
        finally:
            await database.close()

    try:
        asyncio.run(check())
    except (DatabaseNotReady, DatabaseUnavailable, DatabaseError, OSError) as error:
        return Finding("database", False, str(error).splitlines()[0], "docs/deploy.md, Databases")
    return Finding("database", True, "whole and up to date" if file is not None else "reached and up to date")


def _keys(settings: Settings) -> Finding:
    vault = settings.vault()
    try:
        if vault.find_keys():
            return Finding("keys", True, "there is a key for what is sealed in the database")
    except VaultError as error:
        return Finding("keys", False, str(error), "restore it from the backup")
    file = sqlite_file(settings.database_url)
    if file is not None and not file.exists():
        return Finding("keys", None, "there are none yet: the first start makes one")
    restore = "restore it from the backup; a new database gets one by itself (docs/deploy.md)"
    return Finding("keys", False, vault.where, restore)


def _disk(settings: Settings) -> Finding:
    folders = {settings.var, settings.files, settings.maps}
    there = {next(one for one in (folder, *folder.parents) if one.exists()) for folder in folders}
    for folder in sorted(there):
        try:
            with tempfile.TemporaryFile(dir=folder):
                pass
        except OSError as error:
            owner = f"it belongs to user {folder.stat().st_uid}, and this is user {os.geteuid()}"
            why = f"{folder} cannot be written ({error.strerror}): {owner}"
            return Finding("disk", False, why, "run it as that user")
    free, folder = min((shutil.disk_usage(one).free // 1_000_000, one) for one in there)
    if free < settings.disk_low_mb:
        return Finding("disk", False, f"{free} MB are free for {folder}", "delete recordings, or lower their budgets")
    return Finding("disk", True, f"{free} MB are free")


def _answers(settings: Settings) -> bool:
    """Whether a tower serves this port."""
    host = "127.0.0.1" if settings.host in ("0.0.0.0", "::") else settings.host  # noqa: S104 - recognised, not bound
    try:
        return _date_of(f"http://{host}:{settings.port}") is not None
    except OSError:
        return False


def _tcp_port(settings: Settings, *, serves: bool) -> Finding:
    if serves:
        return Finding("port", True, f"a tower serves port {settings.port} here")
    try:
        listen(settings.host, settings.port).close()
    except CannotListen as error:
        return Finding("port", False, str(error), "`ss -ltnp` names who has it")
    return Finding("port", True, f"{settings.port} is free")


def _udp_port(settings: Settings, *, serves: bool) -> Finding:
    family = socket.AF_INET6 if ":" in settings.udp_host else socket.AF_INET
    with socket.socket(family, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind((settings.udp_host, settings.udp_port))
        except OSError as error:
            if serves and error.errno == errno.EADDRINUSE:
                return Finding("UDP", True, f"port {settings.udp_port} is in use, by the tower")
            refused = CannotListen("TOWER_UDP_PORT", settings.udp_host, settings.udp_port, error)
            return Finding("UDP", False, str(refused), "`ss -lunp` names who has it")
    if settings.udp_host in ("127.0.0.1", "::1") and settings.public_url.startswith("https"):
        return Finding(
            "UDP",
            False,
            f"agents elsewhere cannot reach {settings.udp_host}: their data goes over TCP",
            "set TOWER_UDP_HOST=0.0.0.0, and open the port in the firewall (docs/deploy.md)",
        )
    return Finding(
        "UDP", True, f"port {settings.udp_port} is free; `tower-agent doctor` says whether a firewall lets it in"
    )


def _address(settings: Settings) -> Iterator[Finding]:
    """Name, TLS and proxy as browsers meet them, and the clock beside that of whoever answers."""
    if not settings.public_url:
        yield Finding("address", None, "TOWER_PUBLIC_URL is not set: links, passkeys and enrolment need it", "set it")
        yield _clock(None)
        return
    host = urlsplit(settings.public_url).hostname
    try:
        date = _date_of(settings.public_url)
    except OSError as error:
        yield Finding("address", False, f"{settings.public_url}: {_why(error)}", _remedy(error, host or ""))
        yield _clock(None)
        return
    if date is None:
        yield Finding(
            "address", False, f"what answers at {settings.public_url} is no tower", "point the proxy to TOWER_PORT"
        )
    else:
        yield Finding("address", True, f"a tower answers at {settings.public_url}")
    yield _clock(date)


def _date_of(url: str) -> float | None:
    """Unix time by the answer of the tower at `url`; None: it is no tower. Raises OSError."""
    with urllib.request.urlopen(f"{url}/api/v1/health", timeout=ANSWER_WITHIN_S) as answer:  # noqa: S310 - a setting
        stamped, body = answer.headers.get("Date"), answer.read(1_000)
    if b'"status"' not in body:
        return None
    return parsedate_to_datetime(stamped).timestamp() if stamped else time.time()


def _why(error: OSError) -> str:
    reason = getattr(error, "reason", error)
    if isinstance(reason, ssl.SSLCertVerificationError):
        return f"its certificate is refused: {reason.verify_message}"
    if isinstance(reason, socket.gaierror):
        return "the name is not known"
    return str(getattr(reason, "strerror", None) or reason)


def _remedy(error: OSError, host: str) -> str:
    reason = getattr(error, "reason", error)
    if isinstance(reason, ssl.SSLCertVerificationError):
        return "renew it, or let the proxy do it; for an authority of your own: SSL_CERT_FILE"
    if isinstance(reason, socket.gaierror):
        return f"give {host} an address in the DNS"
    return "start proxy and tower; is the port open in the firewall?"


def _clock(date: float | None) -> Finding:
    if date is not None and abs(off := time.time() - date) > MAX_CLOCK_OFF_S:
        found = f"{abs(off):.0f} s {'ahead' if off > 0 else 'behind'} of who answers at the address"
        return Finding("clock", False, found, SET_NTP)
    if shutil.which("timedatectl") is not None:
        asked = subprocess.run(
            ["timedatectl", "show", "--property=NTPSynchronized", "--value"],  # noqa: S607 - the system's own
            capture_output=True,
            text=True,
            check=False,
        )
        if asked.stdout.strip() == "no":
            return Finding("clock", False, "nothing keeps it right", SET_NTP)
        if asked.stdout.strip() == "yes":
            return Finding("clock", True, "kept right by NTP")
    return Finding("clock", None, "whether something keeps it right is not known here")


def _certificate_file(path: Path | None) -> Finding:
    if path is None:
        return Finding("certificate", None, "TOWER_TLS_CERTIFICATE is not set: agents do not bind their sign-in to it")
    try:
        found = x509.load_pem_x509_certificate(path.read_bytes())
    except (OSError, ValueError) as error:
        why = error.strerror if isinstance(error, OSError) else "it has no certificate in PEM"
        return Finding("certificate", False, f"{path}: {why}", "name the file that the proxy shows, for this user")
    left = (found.not_valid_after_utc - datetime.now(UTC)).days
    if left < 0:
        return Finding("certificate", False, f"{path} ended {-left} days ago", "renew it")
    if left < SOON:
        return Finding("certificate", False, f"{path} ends in {left} days", "renew it: what should has not")
    return Finding("certificate", True, f"for another {left} days")


def _bus(settings: Settings) -> Finding:
    if not settings.bus_url:
        return Finding("bus", None, "none is set: this is the only tower on its database")
    parts = urlsplit(settings.bus_url)
    try:
        with socket.create_connection((parts.hostname or "", parts.port or 4222), timeout=ANSWER_WITHIN_S) as opened:
            opened.settimeout(ANSWER_WITHIN_S)
            greeting = opened.recv(4)
    except OSError as error:
        where = f"{parts.hostname}:{parts.port or 4222}"
        return Finding("bus", False, f"{where}: {_why(error)}", "start NATS, or correct TOWER_BUS_URL")
    if greeting != b"INFO":
        return Finding("bus", False, "what answers is not NATS", "correct TOWER_BUS_URL")
    return Finding("bus", True, "NATS answers; user and password are tried when the tower starts")
