"""The tower's settings: one frozen object, read once from the environment. `docs/settings.md` describes each.

Why not pydantic-settings: it makes this file longer (by 13 lines, tried with 2.16). Each reader stays, because an error
names the variable and the rule in our words and never shows the value. A source for a given environment and the
translation of its errors would be added.
"""

from __future__ import annotations

import ipaddress
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from datetime import UTC, datetime
from difflib import get_close_matches
from pathlib import Path
from typing import Any, Final
from urllib.parse import urlsplit

from server.airspace.io import read_feed_address
from server.alerts.io.mail import MailServer
from server.alerts.io.mail_source import read_mail_address, read_mail_server
from server.kernel.shares import ShareName, read_limits
from server.maps.io.tile_source import TileSource, read_tiles
from server.runtime.packaged import CONSOLE
from server.runtime.vault import KEY_FILE, Vault, parse_keys

_DAY_S: Final = 86_400
_VAR: Final = Path("var")
_UNSET: Final = Path()


class SettingsError(ValueError):
    """A variable holds an invalid value. The message names the variable, and never shows its value."""

    def __init__(self, variable: str, problem: str) -> None:
        super().__init__(f"{variable} {problem}")
        self.variable = variable


def _number(least: float, most: float, kind: type[int] | type[float] = int) -> Callable[[str], Any]:
    def read(text: str) -> int | float:
        try:
            value = kind(text)
        except ValueError:
            raise ValueError("must be a number" if kind is float else "must be a whole number") from None
        if not least <= value <= most:
            raise ValueError(f"must be between {least:g} and {most:g}")
        return value

    return read


def _database_url(text: str) -> str:
    """Accepts common database URLs and adds the asynchronous driver."""
    scheme, separator, rest = text.partition("://")
    drivers = {
        "sqlite": "sqlite+aiosqlite",
        "sqlite+aiosqlite": "sqlite+aiosqlite",
        "postgres": "postgresql+asyncpg",
        "postgresql": "postgresql+asyncpg",
        "postgresql+asyncpg": "postgresql+asyncpg",
    }
    if not separator or scheme not in drivers:
        raise ValueError("must begin with sqlite:// or postgresql://")
    if drivers[scheme].startswith("sqlite") and rest in {"", "/", "/:memory:"}:
        raise ValueError("must name a file: the tower's database cannot live in memory")
    return f"{drivers[scheme]}://{rest}"


def _public_url(text: str) -> str:
    parts = urlsplit(text)
    if parts.scheme not in {"http", "https"} or not parts.hostname or parts.path.strip("/"):
        raise ValueError("must look like https://tower.example.org, without a path")
    return f"{parts.scheme}://{parts.netloc}"


def _own_url(text: str) -> str:
    url = _public_url(text)
    if url.startswith("http:") and not _is_loopback(urlsplit(url).hostname or ""):
        raise ValueError("must begin with https:// unless it is on this machine: agents go there")
    return url


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _bus_url(text: str) -> str:
    """Beyond this machine: over TLS, and with a user of its own. What towers say is sealed besides."""
    parts = urlsplit(text)
    if parts.scheme not in {"nats", "tls"} or not parts.hostname:
        raise ValueError("must look like nats://127.0.0.1:4222 or tls://user:password@bus.example.org:4222")
    if parts.scheme == "nats" and not _is_loopback(parts.hostname):
        raise ValueError("must begin with tls:// unless the bus is on this machine: it carries sign-ins")
    if not _is_loopback(parts.hostname) and not (parts.username and parts.password):
        raise ValueError("must have a user and a password, as tls://user:password@host:4222, beyond this machine")
    return text


def _host(text: str) -> str:
    if not text or any(letter in text for letter in "/ "):
        raise ValueError("must be a host name or an address")
    return text


def _address(text: str) -> str:
    host, _, port = text.rpartition(":")
    if not re.fullmatch(r"[A-Za-z0-9.-]+|\[[0-9A-Fa-f:.]+\]", host) or not re.fullmatch(r"[0-9]{1,5}", port):
        raise ValueError("must look like proxy:443")
    return text


def _addresses(text: str) -> str:
    """Addresses and networks, separated by commas."""
    parts = [part.strip() for part in text.split(",")]
    for part in parts:
        try:
            ipaddress.ip_network(part)
        except ValueError:
            raise ValueError("must be addresses or networks (172.28.5.0/24), with commas between") from None
    return ",".join(parts)


def _moment(text: str) -> datetime:
    try:
        moment = datetime.fromisoformat(text)
    except ValueError:
        raise ValueError("must be a date (2027-01-31) or a moment (2027-01-31T12:00:00Z)") from None
    return moment if moment.tzinfo is not None else moment.replace(tzinfo=UTC)


def _secret(text: str) -> str:
    if len(text) < 20 or not text.isascii() or not text.isprintable() or " " in text:
        raise ValueError("must be at least 20 printable characters without spaces (openssl rand -hex 32 makes one)")
    return text


def _keys(text: str) -> str:
    try:
        parse_keys(text, ",")
    except ValueError:
        raise ValueError("must be keys as `tower new-key` prints them, with commas between, newest first") from None
    return text


def _attribution(text: str) -> str:
    if len(text) > 200 or not text.isprintable():
        raise ValueError("must be at most 200 printable characters")
    return text


def _contact(text: str) -> str:
    if not text.startswith(("mailto:", "https://")) or not text.isascii() or not text.isprintable() or " " in text:
        raise ValueError("must look like mailto:security@example.org or https://example.org/security")
    return text


def _collector_url(text: str) -> str:
    parts = urlsplit(text)
    if parts.scheme not in {"http", "https"} or not parts.hostname:
        raise ValueError("must look like http://127.0.0.1:4318")
    return text.rstrip("/")


def _shares(text: str) -> tuple[tuple[ShareName, int], ...]:
    return tuple(read_limits(text).items())


def _log_format(text: str) -> str:
    if text not in {"auto", "human", "json"}:
        raise ValueError("must be auto, human or json")
    return text


def _yes_or_no(text: str) -> bool:
    if text not in {"yes", "no"}:
        raise ValueError("must be yes or no")
    return text == "yes"


def _from(variable: str, read: Callable[[str], Any]) -> dict[str, Any]:
    return {"variable": variable, "read": read}


def _setting(default: Any, variable: str, read: Callable[[str], Any]) -> Any:
    return field(default=default, metadata=_from(variable, read))


@dataclass(frozen=True)
class Settings:
    """All configurable settings. Each field's environment variable is in its metadata."""

    host: str = _setting("127.0.0.1", "TOWER_HOST", _host)
    port: int = _setting(8000, "TOWER_PORT", _number(0, 65_535))
    udp_host: str = _setting("", "TOWER_UDP_HOST", _host)
    """Address of the data channel. Empty: the same as `host`."""
    udp_port: int = _setting(14_650, "TOWER_UDP_PORT", _number(0, 65_535))
    public_url: str = _setting("", "TOWER_PUBLIC_URL", _public_url)
    """The tower's address for browsers, if a proxy hides it. Empty: the Host header counts."""
    tls_certificate: Path | None = field(default=None, metadata=_from("TOWER_TLS_CERTIFICATE", Path))
    """The certificate that the proxy shows to agents, in PEM; agents bind their signatures to it. None: not known."""
    drone_credentials_until: datetime | None = field(
        default=None, metadata=_from("TOWER_DRONE_CREDENTIALS_UNTIL", _moment)
    )
    """From then on no agent may sign in with a bearer credential of an older version. None: no limit."""
    trusted_proxies: str = _setting("127.0.0.1,::1", "TOWER_TRUSTED_PROXIES", _addresses)
    """Proxies whose X-Forwarded-For and X-Forwarded-Proto headers are trusted."""
    var: Path = field(default=_VAR, metadata=_from("TOWER_VAR", Path))
    database_url: str = _setting("", "DATABASE_URL", _database_url)
    database_timeout_s: float = _setting(2.0, "TOWER_DATABASE_TIMEOUT_S", _number(0.1, 60, float))
    """Maximum time to wait for one response of the database."""
    bus_url: str = field(default="", repr=False, metadata=_from("TOWER_BUS_URL", _bus_url))
    """NATS, through which several towers share one PostgreSQL. Empty: one tower on one database."""
    bus_authority: Path | None = field(default=None, metadata=_from("TOWER_BUS_AUTHORITY", Path))
    """Certificates in PEM to believe for a bus over TLS. None: the system's."""
    own_url: str = _setting("", "TOWER_OWN_URL", _own_url)
    """Where agents reach this tower and no other one. Empty: through a proxy only."""
    web: Path = field(default=CONSOLE, metadata=_from("TOWER_WEB", Path))
    secret_keys: str = field(default="", repr=False, metadata=_from("TOWER_SECRET_KEYS", _keys))
    """Keys that seal secrets in the database that must be read again. Empty: those in `secret_key_file`."""
    secret_key_file: Path = field(default=_UNSET, metadata=_from("TOWER_SECRET_KEY_FILE", Path))
    session_idle_s: float = _setting(float(_DAY_S / 2), "TOWER_SESSION_IDLE_S", _number(60, 366 * _DAY_S, float))
    session_lifetime_s: float = _setting(
        float(7 * _DAY_S), "TOWER_SESSION_LIFETIME_S", _number(60, 366 * _DAY_S, float)
    )
    admins_need_second_factor: bool = _setting(False, "TOWER_ADMINS_NEED_SECOND_FACTOR", _yes_or_no)
    """An admin without a second factor may only set one up."""
    token_longest_days: int = _setting(365, "TOWER_TOKEN_LONGEST_DAYS", _number(1, 365))
    """The maximum lifetime of a new API token."""
    argon2_concurrency: int = _setting(2, "TOWER_ARGON2_CONCURRENCY", _number(1, 64))
    argon2_memory_kib: int = _setting(65_536, "TOWER_ARGON2_MEMORY_KIB", _number(19_456, 4_194_304))
    argon2_rounds: int = _setting(3, "TOWER_ARGON2_ROUNDS", _number(2, 100))
    argon2_process: bool = _setting(True, "TOWER_ARGON2_PROCESS", _yes_or_no)
    """Passwords are hashed in a separate process. False: in threads of the tower, where a hash can delay frames."""
    user_frames_per_s: int = _setting(500, "TOWER_USER_FRAMES_PER_S", _number(100, 1_000_000))
    user_frames_burst: int = _setting(4_000, "TOWER_USER_FRAMES_BURST", _number(100, 1_000_000))
    drone_frames_per_s: int = _setting(300, "TOWER_DRONE_FRAMES_PER_S", _number(100, 1_000_000))
    drone_frames_burst: int = _setting(3_000, "TOWER_DRONE_FRAMES_BURST", _number(100, 1_000_000))
    agent_frames_per_s: int = _setting(10_000, "TOWER_AGENT_FRAMES_PER_S", _number(100, 1_000_000))
    agent_frames_burst: int = _setting(20_000, "TOWER_AGENT_FRAMES_BURST", _number(100, 1_000_000))
    shares: tuple[tuple[ShareName, int], ...] = _setting((), "TOWER_SHARES", _shares)
    """Limits of shares, until an admin chooses others. Those that are not here: as in docs/shares.md."""
    user_sockets: int = _setting(20, "TOWER_USER_SOCKETS", _number(1, 100_000))
    address_sockets: int = _setting(200, "TOWER_ADDRESS_SOCKETS", _number(1, 100_000))
    user_video_sockets: int = _setting(60, "TOWER_USER_VIDEO_SOCKETS", _number(1, 100_000))
    address_video_sockets: int = _setting(200, "TOWER_ADDRESS_VIDEO_SOCKETS", _number(1, 100_000))
    metrics_token: str = field(default="", repr=False, metadata=_from("TOWER_METRICS_TOKEN", _secret))
    """A token that allows reading the metrics. Empty: only admins, and API tokens with the metrics scope."""
    separation_horizontal_m: float = _setting(15.0, "TOWER_SEPARATION_HORIZONTAL_M", _number(0, 1_000, float))
    """An alert is raised if two drones will be nearer than this horizontally, and nearer than the next setting
    vertically. 0: no separation watch."""
    separation_vertical_m: float = _setting(10.0, "TOWER_SEPARATION_VERTICAL_M", _number(1, 1_000, float))
    separation_ahead_s: float = _setting(30.0, "TOWER_SEPARATION_AHEAD_S", _number(5, 120, float))
    """How far ahead the separation watch predicts."""
    height_limit_m: float = _setting(120.0, "TOWER_HEIGHT_LIMIT_M", _number(0, 100_000, float))
    """An alert is raised above this height over home. 0: no limit of the tower."""
    traffic_feed: str = _setting("", "TOWER_TRAFFIC_FEED", read_feed_address)
    """The `aircraft.json` of a receiver on the ground (dump1090, readsb): a file or an http address. Empty: none."""
    ground_clearance_m: float = _setting(5.0, "TOWER_GROUND_CLEARANCE_M", _number(0, 1_000, float))
    """A mission that comes nearer to the ground between its points is refused, where the tower knows the ground."""
    tiles: TileSource | None = field(default=None, metadata=_from("TOWER_TILES", read_tiles))
    """Map tiles over the built-in coastline; None: none."""
    tiles_attribution: str = _setting("", "TOWER_TILES_ATTRIBUTION", _attribution)
    tiles_most_zoom: int = _setting(19, "TOWER_TILES_MOST_ZOOM", _number(0, 24))
    """Maximum zoom of tiles from elsewhere; beyond it they are stretched. A tile file has its own."""
    tile_cache_mb: int = _setting(2_000, "TOWER_TILE_CACHE_MB", _number(1, 1_000_000))
    """Total of cached map tiles of other servers, in millions of bytes; the least recently used are removed first."""
    map_file_largest_mb: int = _setting(10_000, "TOWER_MAP_FILE_LARGEST_MB", _number(1, 1_000_000))
    maps: Path = field(default=_UNSET, metadata=_from("TOWER_MAPS", Path))
    """Folder of map files: each is a layer of the map. Not set: `maps` in `var`."""
    agent_releases: Path = field(default=_UNSET, metadata=_from("TOWER_AGENT_RELEASES", Path))
    """Folder of packages with which admins update agents. Not set: `agent_releases` in `var`."""
    files: Path = field(default=_UNSET, metadata=_from("TOWER_FILES", Path))
    """Folder of flight logs, recordings and flights. Not set: `files` in `var`."""
    files_budget_mb: int = _setting(5_000, "TOWER_FILES_BUDGET_MB", _number(1, 100_000_000))
    """Total of all flight logs, in millions of bytes; the oldest are removed first."""
    file_largest_mb: int = _setting(500, "TOWER_FILE_LARGEST_MB", _number(1, 100_000))
    recordings_budget_mb: int = _setting(20_000, "TOWER_RECORDINGS_BUDGET_MB", _number(1, 100_000_000))
    """Total of all video recordings, in millions of bytes; the oldest are removed first."""
    record_flights: bool = _setting(True, "TOWER_RECORD_FLIGHTS", _yes_or_no)
    flight_before_s: float = _setting(60.0, "TOWER_FLIGHT_BEFORE_S", _number(0, 300, float))
    """How much of what came before arming is in a flight."""
    flights_budget_mb: int = _setting(5_000, "TOWER_FLIGHTS_BUDGET_MB", _number(1, 100_000_000))
    """Total of all recorded flights, in millions of bytes; the oldest are removed first."""
    flight_largest_mb: int = _setting(500, "TOWER_FLIGHT_LARGEST_MB", _number(1, 100_000))
    """A flight that reaches it goes on as another one."""
    flights_keep_days: float = _setting(0.0, "TOWER_FLIGHTS_KEEP_DAYS", _number(0, 36_500, float))
    flight_imports_budget_mb: int = _setting(1_000, "TOWER_FLIGHT_IMPORTS_BUDGET_MB", _number(0, 1_000_000))
    """Room for the imported flights of one person, in millions of bytes. 0: nobody imports flights."""
    flight_import_largest_mb: int = _setting(300, "TOWER_FLIGHT_IMPORT_LARGEST_MB", _number(1, 10_000))
    """The largest file that is taken for it."""
    audit_keep_days: float = _setting(0.0, "TOWER_AUDIT_KEEP_DAYS", _number(0, 36_500, float))
    """Audit events older than this are removed. 0: none."""
    audit_most_events: int = _setting(0, "TOWER_AUDIT_MOST_EVENTS", _number(0, 1_000_000_000))
    """Of more events than this the oldest are removed. 0: no limit."""
    flight_logs_keep_days: float = _setting(0.0, "TOWER_FLIGHT_LOGS_KEEP_DAYS", _number(0, 36_500, float))
    recordings_keep_days: float = _setting(0.0, "TOWER_RECORDINGS_KEEP_DAYS", _number(0, 36_500, float))
    alerts_keep_days: float = _setting(90.0, "TOWER_ALERTS_KEEP_DAYS", _number(0, 36_500, float))
    """Alerts that were closed longer ago are removed. 0: none, but their number is bounded all the same."""
    alert_unanswered_s: float = _setting(120.0, "TOWER_ALERT_UNANSWERED_S", _number(0, 86_400, float))
    """A critical alert that nobody has acknowledged by then is sent to the admins. 0: never."""
    disk_low_mb: int = _setting(2_000, "TOWER_DISK_LOW_MB", _number(0, 1_000_000_000))
    """Admins are alerted when less is free on a disk of the tower, in millions of bytes. 0: only when it is full."""
    certificate_address: str = _setting("", "TOWER_CERTIFICATE_ADDRESS", _address)
    """Where the tower reads the certificate that its proxy shows, `proxy:443`. Empty: only `tls_certificate`."""
    mail: MailServer = field(default=MailServer(), metadata=_from("TOWER_MAIL_SERVER", read_mail_server))
    mail_password: str = field(default="", repr=False, metadata=_from("TOWER_MAIL_PASSWORD", str))
    mail_from: str = _setting("", "TOWER_MAIL_FROM", read_mail_address)
    """Sender of all mail. Required with a mail server."""
    webhooks_may_be_private: bool = _setting(False, "TOWER_WEBHOOKS_MAY_BE_PRIVATE", _yes_or_no)
    """Users may name webhooks in the tower's own network, also without TLS."""
    recording_largest_mb: int = _setting(2_000, "TOWER_RECORDING_LARGEST_MB", _number(1, 100_000))
    recording_longest_s: float = _setting(7_200.0, "TOWER_RECORDING_LONGEST_S", _number(10, 7 * _DAY_S, float))
    security_contact: str = _setting("", "TOWER_SECURITY_CONTACT", _contact)
    """Contact for reports of vulnerabilities, published in `/.well-known/security.txt`. Empty: no such page."""
    log_format: str = _setting("auto", "TOWER_LOG_FORMAT", _log_format)
    telemetry_endpoint: str = _setting("", "OTEL_EXPORTER_OTLP_ENDPOINT", _collector_url)
    """A collector that takes traces by OTLP over HTTP. Empty: none, and no exporter is imported."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "var", self.var.absolute())
        if self.secret_key_file == _UNSET:
            object.__setattr__(self, "secret_key_file", self.var / KEY_FILE)
        object.__setattr__(self, "maps", (self.var / "maps" if self.maps == _UNSET else self.maps).absolute())
        own = self.var / "agent_releases" if self.agent_releases == _UNSET else self.agent_releases
        object.__setattr__(self, "agent_releases", own.absolute())
        object.__setattr__(self, "files", (self.var / "files" if self.files == _UNSET else self.files).absolute())
        if not self.udp_host:
            object.__setattr__(self, "udp_host", self.host)
        if not self.database_url:
            object.__setattr__(self, "database_url", f"sqlite+aiosqlite:///{self.var / 'tower.sqlite3'}")

    @property
    def secret_key_list(self) -> tuple[str, ...]:
        """Newest first."""
        return parse_keys(self.secret_keys, ",") if self.secret_keys else ()

    @property
    def mail_server(self) -> MailServer:
        """With its password and sender."""
        return replace(self.mail, password=self.mail_password, sender=self.mail_from)

    def vault(self) -> Vault:
        """A vault with these keys. It reads its key file only when asked to find its keys."""
        return Vault(keys=self.secret_key_list, key_file=self.secret_key_file)

    @property
    def is_sqlite(self) -> bool:
        return self.database_url.startswith("sqlite")


_OF_OTHERS: Final = frozenset(
    {"TOWER_URL", "TOWER_TOKEN", "TOWER_TOKEN_FILE", "TOWER_ADMIN_PASSWORD", "TOWER_RELEASE_KEY"}
    | {"TOWER_DOMAIN", "TOWER_ADDRESSES", "TOWER_BALANCING"}
)
"""Of `tower connect` and the SDK, `make run`, the release, and the compose file; `TOWER_AGENT_...`: of the agent."""


def _refuse_unknown(environment: Mapping[str, str]) -> None:
    known = set(variables().values())
    for name in sorted(environment.keys() - known - _OF_OTHERS):
        if name.startswith("TOWER_") and not name.startswith("TOWER_AGENT_") and environment[name].strip():
            near = get_close_matches(name.removeprefix("TOWER_"), [one.removeprefix("TOWER_") for one in known], 1)
            meant = f": did you mean TOWER_{near[0]}?" if near else "; docs/settings.md has all of them"
            raise SettingsError(name, f"is not a setting of the tower{meant}")


def variables() -> dict[str, str]:
    """Field name -> environment variable."""
    return {one.name: one.metadata["variable"] for one in fields(Settings)}


def read_settings(environment: Mapping[str, str]) -> Settings:
    """Reads the settings from `environment`. An empty variable counts as not set. Raises SettingsError, also for a
    variable that looks like a setting of the tower and is none: a misspelt one would leave the default in place."""
    _refuse_unknown(environment)
    values: dict[str, Any] = {}
    for one in fields(Settings):
        variable = one.metadata["variable"]
        text = environment.get(variable, "").strip()
        if not text:
            continue
        try:
            values[one.name] = one.metadata["read"](text)
        except ValueError as error:
            raise SettingsError(variable, str(error)) from None
    settings = Settings(**values)
    if settings.session_idle_s > settings.session_lifetime_s:
        raise SettingsError("TOWER_SESSION_IDLE_S", "must not be longer than TOWER_SESSION_LIFETIME_S")
    if settings.bus_url and settings.is_sqlite:
        raise SettingsError("TOWER_BUS_URL", "needs PostgreSQL: set DATABASE_URL")
    if settings.bus_authority and not settings.bus_url.startswith("tls:"):
        raise SettingsError("TOWER_BUS_AUTHORITY", "is for a bus over TLS: set TOWER_BUS_URL to tls://...")
    if settings.own_url and not settings.bus_url:
        raise SettingsError("TOWER_OWN_URL", "is for one of several towers: set TOWER_BUS_URL")
    if settings.mail.host and not settings.mail_from:
        raise SettingsError("TOWER_MAIL_FROM", "is needed with TOWER_MAIL_SERVER")
    return settings
