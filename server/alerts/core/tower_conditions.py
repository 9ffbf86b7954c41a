"""Conditions of the tower itself. Pure."""

from datetime import datetime, timedelta
from typing import Final

from server.alerts.core.finding import Finding, Not
from server.alerts.core.tower_facts import TowerFacts

DISK_FULL_BYTES: Final = 256 * 1024 * 1024
"""With less the store takes no file (`MIN_FREE_BYTES` of `server/storage/file_budget.py`)."""
WAY_BACK: Final = 10
"""A tenth more than the limit must be free again."""
ENDS_SOON: Final = timedelta(days=14)
ENDS: Final = timedelta(days=3)
STANDS_STILL_S: Final = 0.25
"""Half of what the agents wait for sticks before they hold."""


def disk_full(facts: TowerFacts, at: datetime, is_open: bool) -> Finding:
    return _disk_below(facts, DISK_FULL_BYTES, is_open)


def disk_low(facts: TowerFacts, at: datetime, is_open: bool) -> Finding:
    return _disk_below(facts, facts.disk_low_bytes, is_open)


def certificate_ends(facts: TowerFacts, at: datetime, is_open: bool) -> Finding:
    return _ends_within(facts, at, ENDS)


def certificate_ends_soon(facts: TowerFacts, at: datetime, is_open: bool) -> Finding:
    return _ends_within(facts, at, ENDS_SOON)


def database_damaged(facts: TowerFacts, at: datetime, is_open: bool) -> Finding:
    if not facts.database_fault:
        return Not.SO
    return f"The file of the database is damaged: {facts.database_fault}."


def stands_still(facts: TowerFacts, at: datetime, is_open: bool) -> Finding:
    held = facts.stood_still
    if held is None or held.for_s < (0.0 if is_open else STANDS_STILL_S):
        return Not.SO
    return f"The tower stood still for {held.for_s * 1000:.0f} ms, in {held.where}. Sticks came late."


def part_fails(facts: TowerFacts, at: datetime, is_open: bool) -> Finding:
    failing = facts.failing
    if failing is None:
        return Not.SO
    return f"The tower's part {failing.part} had errors in the last ten minutes: {failing.errors}. All else goes on."


def _disk_below(facts: TowerFacts, limit_bytes: int, is_open: bool) -> Finding:
    disk = facts.disk
    if disk is None:
        return Not.KNOWN
    if disk.free_bytes >= limit_bytes + (limit_bytes // WAY_BACK if is_open else 0):
        return Not.SO
    return f"The disk with {disk.holds} has {disk.free_bytes // 1_000_000} MB left."


def _ends_within(facts: TowerFacts, at: datetime, within: timedelta) -> Finding:
    certificate = facts.certificate
    if certificate is None:
        return Not.KNOWN
    left = certificate.ends_at - at
    if left > within:
        return Not.SO
    verb = "expires" if left > timedelta() else "expired"
    return f"The TLS certificate ({certificate.where}) {verb} on {certificate.ends_at:%Y-%m-%d at %H:%M} UTC."
