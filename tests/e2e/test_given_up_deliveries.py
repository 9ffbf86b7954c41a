"""Admins see in the console which alerts reached nobody, to whom and why; nobody else does."""

import json
import shutil
import sqlite3
from contextlib import closing
from datetime import UTC, datetime, timedelta
from pathlib import Path

from console_page import visitors
from playwright.sync_api import Browser, expect
from worlds.processes import DATABASE, World


def give_up(
    database: Path, *, kind: str, target: str, happening: str, words: str, problem: str, ago: timedelta
) -> None:
    """Writes what nine hours of attempts would leave. For alice."""
    at = datetime.now(UTC) - ago
    moment = f"{at:%Y-%m-%d %H:%M:%S.%f}"
    with closing(sqlite3.connect(database)) as connection, connection:
        (user,) = connection.execute("SELECT id FROM users WHERE name = 'alice'").fetchone()
        channel = connection.execute(
            "INSERT INTO alert_channels (user_id, kind, target, severity, drones, code_tries, created_at, problem)"
            " VALUES (?, ?, ?, 'warning', 'all', 0, ?, ?)",
            (user, kind, target, moment, problem),
        ).lastrowid
        content = {"id": "7", "words": words, "drone": {"id": 1, "name": "Kestrel"}}
        connection.execute(
            "INSERT INTO alert_deliveries (channel_id, alert_id, happening, content, created_at, due_at, attempts,"
            " ended_at, problem) VALUES (?, 7, ?, ?, ?, ?, 8, ?, ?)",
            (channel, happening, json.dumps(content), moment, moment, moment, problem),
        )


def test_what_reached_nobody_is_listed_for_admins(chromium: Browser, tmp_path: Path, prepared_folder: Path) -> None:
    shutil.copytree(prepared_folder, tmp_path, dirs_exist_ok=True)
    lost, database = "Kestrel is lost in the air.", tmp_path / DATABASE
    give_up(
        database,
        kind="mail",
        target="alice@example.org",
        happening="closed",
        words=lost,
        problem="the mail server answers 550",
        ago=timedelta(hours=3),
    )
    give_up(
        database,
        kind="push",
        target="https://push.example.org/of/alice",
        happening="opened",
        words=lost,
        problem="the push service answers 403",
        ago=timedelta(hours=2),
    )
    with World(tmp_path, prepared=True) as world:
        world.start_tower()
        with visitors(chromium, world.address) as come:
            admin, alice = come(), come()
            admin.sign_in("admin")
            admin.open("/#/admin/system")
            entries = admin.part("given-up").get_by_role("listitem")
            expect(entries).to_have_count(2)
            newest, older = entries.nth(0), entries.nth(1)
            expect(newest).to_contain_text(lost)
            expect(newest).to_contain_text("To alice (push.example.org)")
            expect(newest).to_contain_text("after 8 attempts: the push service answers 403")
            expect(newest).not_to_contain_text("of/alice")
            expect(older).to_contain_text(f"Over: {lost}")
            expect(older).to_contain_text("To alice (alice@example.org)")

            alice.sign_in("alice")
            alice.open("/#/account/alerts")
            states = alice.part("channel-state")
            expect(states.first).to_have_text("last attempt: the mail server answers 550")
            alice.open("/#/admin/system")
            expect(alice.part("given-up")).to_have_count(0)
