"""Log lines that strangers cause: limited by the budget, with a count of the lines that were dropped."""

from __future__ import annotations

import time

import structlog

from server.anonymous.core.budget import AnonymousBudget

_log = structlog.get_logger(__name__)


def log_refusal(budget: AnonymousBudget, event: str, status: int, why: str) -> None:
    """Logs a refused connection. `left_out`: the number of such lines that were dropped before this one."""
    if budget.may_log(time.monotonic()):
        left_out = budget.log.take_unreported()
        more = {"left_out": left_out} if left_out else {}
        _log.warning(event, status=status, why=why, **more)
