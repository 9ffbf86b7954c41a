"""Log lines that strangers cause: within the budget, and the sum of those that were left out."""

from __future__ import annotations

import time

import structlog

from server.live.anonymous.budget import AnonymousBudget

_log = structlog.get_logger(__name__)


def log_refusal(budget: AnonymousBudget, event: str, status: int, why: str) -> None:
    """Logs a refused sign-in. `left_out`: lines about strangers that were omitted before this one."""
    if budget.may_log(time.monotonic()):
        left_out = budget.log.take_unreported()
        more = {"left_out": left_out} if left_out else {}
        _log.warning(event, status=status, why=why, **more)
