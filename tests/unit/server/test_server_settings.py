"""Settings: defaults, accepted values, and refusals."""

from dataclasses import FrozenInstanceError
from pathlib import Path

import pytest

from server.runtime.settings import Settings, SettingsError, read_settings, variables

REFERENCE = Path(__file__).parents[3] / "docs" / "settings.md"


def test_defaults() -> None:
    settings = read_settings({})
    assert (settings.host, settings.port, settings.udp_host, settings.udp_port) == (
        "127.0.0.1",
        8000,
        "127.0.0.1",
        14650,
    )
    assert settings.var == Path("var").absolute()
    assert settings.database_url == f"sqlite+aiosqlite:///{settings.var}/tower.sqlite3"
    assert settings.is_sqlite
    assert (settings.session_idle_s, settings.session_lifetime_s) == (12 * 3600, 7 * 24 * 3600)


def test_what_is_set_is_taken_and_what_is_empty_is_not_set() -> None:
    settings = read_settings({"TOWER_PORT": " 9000 ", "TOWER_UDP_PORT": "", "TOWER_HOST": "::1", "TOWER_VAR": "/srv/x"})
    assert (settings.port, settings.udp_port, settings.host, settings.udp_host) == (9000, 14650, "::1", "::1")
    assert settings.database_url.endswith(":////srv/x/tower.sqlite3")


@pytest.mark.parametrize(
    ("given", "used"),
    [
        ("postgres://u:p@h/d", "postgresql+asyncpg://u:p@h/d"),
        ("postgresql://u:p@h/d", "postgresql+asyncpg://u:p@h/d"),
        ("sqlite:////srv/t.db", "sqlite+aiosqlite:////srv/t.db"),
    ],
)
def test_the_database_url_gets_its_driver(given: str, used: str) -> None:
    assert read_settings({"DATABASE_URL": given}).database_url == used


@pytest.mark.parametrize(
    ("variable", "value"),
    [
        ("TOWER_PORT", "http"),
        ("TOWER_TRAFFIC_FEED", "aircraft.json"),
        ("TOWER_TRAFFIC_FEED", "https://127.0.0.1/aircraft.json"),
        ("TOWER_TRAFFIC_FEED", "http://user@127.0.0.1/"),
        ("TOWER_PORT", "65536"),
        ("TOWER_PORT", "-1"),
        ("TOWER_UDP_PORT", "1.5"),
        ("TOWER_HOST", "http://x"),
        ("TOWER_PUBLIC_URL", "tower.example"),
        ("TOWER_PUBLIC_URL", "https://tower.example/path"),
        ("DATABASE_URL", "mysql://secret@x"),
        ("DATABASE_URL", "sqlite://"),
        ("DATABASE_URL", "sqlite:///:memory:"),
        ("TOWER_SESSION_IDLE_S", "soon"),
        ("TOWER_SESSION_IDLE_S", "nan"),
        ("TOWER_SESSION_LIFETIME_S", "1"),
        ("TOWER_ARGON2_CONCURRENCY", "0"),
        ("TOWER_ARGON2_MEMORY_KIB", "64"),
        ("TOWER_LOG_FORMAT", "xml"),
        ("TOWER_SHARES", "zoens=80"),
        ("TOWER_SHARES", "zones=100000"),
        ("TOWER_DISK_LOW_MB", "-1"),
        ("TOWER_CERTIFICATE_ADDRESS", "proxy"),
        ("TOWER_CERTIFICATE_ADDRESS", "https://proxy:443"),
        ("TOWER_CERTIFICATE_ADDRESS", "proxy:https"),
        ("TOWER_CERTIFICATE_ADDRESS", "secret@proxy:443"),
        ("OTEL_EXPORTER_OTLP_ENDPOINT", "127.0.0.1:4318"),
        ("OTEL_EXPORTER_OTLP_ENDPOINT", "grpc://secret@127.0.0.1:4317"),
    ],
)
def test_a_bad_value_names_its_variable_and_is_not_repeated(variable: str, value: str) -> None:
    with pytest.raises(SettingsError) as caught:
        read_settings({variable: value})
    assert str(caught.value).startswith(f"{variable} must ")
    assert "secret" not in str(caught.value)


@pytest.mark.parametrize(
    ("variable", "words"),
    [
        ("TOWER_UDP_PRT", "TOWER_UDP_PRT is not a setting of the tower: did you mean TOWER_UDP_PORT?"),
        ("TOWER_QQ", "TOWER_QQ is not a setting of the tower; docs/settings.md has all of them"),
    ],
)
def test_a_misspelt_variable_is_named_with_the_nearest(variable: str, words: str) -> None:
    with pytest.raises(SettingsError) as caught:
        read_settings({variable: "secret"})
    assert str(caught.value) == words
    read_settings({variable: "", "TOWER_AGENT_STATE": "/agent", "TOWER_URL": "https://tower", "TOWERS_OWN": "1"})


def test_a_session_cannot_be_idle_for_longer_than_it_lives() -> None:
    with pytest.raises(SettingsError, match="TOWER_SESSION_IDLE_S"):
        read_settings({"TOWER_SESSION_LIFETIME_S": "3600"})


def test_settings_cannot_be_changed() -> None:
    with pytest.raises(FrozenInstanceError):
        Settings().port = 1  # type: ignore[misc]


def test_the_reference_has_every_field() -> None:
    rows = [line for line in REFERENCE.read_text().splitlines() if line.startswith("| `")]
    reported = {tuple(cell.strip().strip("`") for cell in row.split("|")[1:3]) for row in rows}
    assert reported == {(variable, name) for name, variable in variables().items()}
