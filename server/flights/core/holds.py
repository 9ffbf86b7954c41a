"""The holds in the index of a flight. Pure."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any


def holds_in(index: Iterable[dict[str, Any]]) -> list[list[dict[str, Any]]]:
    """Returns the steps of each hold, in order. A hold begins with its first step: another epoch or cause, or the
    order."""
    holds: list[list[dict[str, Any]]] = []
    for entry in index:
        if entry.get("kind") != "hold":
            continue
        last = holds[-1][0] if holds else None
        key = (entry.get("epoch"), entry.get("cause"))
        if last is None or entry.get("step") == "ordered" or key != (last.get("epoch"), last.get("cause")):
            holds.append([])
        holds[-1].append(entry)
    return holds
