"""Keeps faults of the recorder from what calls it: a change of holder does so before the browsers hear of it."""

from __future__ import annotations

import functools
from collections import Counter
from collections.abc import Callable
from typing import Any, Final, Protocol, TypeVar, cast

import structlog

_log = structlog.get_logger(__name__)

MAX_LOGGED: Final = 20
"""Faults whose traceback is logged. All are counted."""


class _Counting(Protocol):
    counts: Counter[str]


Method = TypeVar("Method", bound=Callable[..., None])


def harmless(method: Method) -> Method:
    """Decorates a method that returns nothing: an error is counted and logged instead of raised."""

    @functools.wraps(method)
    def guarded(self: _Counting, *arguments: Any, **named: Any) -> None:
        try:
            method(self, *arguments, **named)
        except Exception:
            self.counts["faults"] += 1
            if self.counts["faults"] <= MAX_LOGGED:
                _log.exception("flight_recorder_failed", what=method.__name__)

    return cast("Method", guarded)
