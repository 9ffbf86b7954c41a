"""How the tower logs: text on a terminal, JSON lines otherwise. State changes only, never frames, never secrets."""

from __future__ import annotations

import asyncio
import logging
import sys
import time
from typing import Any, Final

import structlog

from server.anonymous.core.limits import LIMITS
from server.anonymous.core.log_lines import LogBudget
from server.runtime.request_id import current_request_id


def _with_request_id(_logger: Any, _method: str, line: structlog.typing.EventDict) -> structlog.typing.EventDict:
    request_id = current_request_id()
    if request_id:
        line.setdefault("request_id", request_id)
    return line


_REPEATED: Final = frozenset({"database_unavailable", "unexpected_error"})
"""Errors that each request of a stranger can cause again, as long as the fault lasts."""

_SHARED: Final[tuple[structlog.typing.Processor, ...]] = (
    structlog.contextvars.merge_contextvars,
    _with_request_id,
    structlog.processors.add_log_level,
    structlog.processors.TimeStamper(fmt="iso", utc=True),
)


def configure_log(log_format: str = "auto") -> None:
    """Everything goes to standard error, including the lines of the server and the libraries."""
    human = log_format == "human" or (log_format == "auto" and sys.stderr.isatty())
    renderer: tuple[structlog.typing.Processor, ...] = (
        # The default format of an exception shows every local variable: passwords, codes, tokens.
        (structlog.dev.ConsoleRenderer(exception_formatter=structlog.dev.plain_traceback),)
        if human
        else (structlog.processors.format_exc_info, structlog.processors.JSONRenderer())
    )
    structlog.configure(
        processors=[_FewOfAKind(time.monotonic()), *_SHARED, *renderer],
        wrapper_class=structlog.make_filtering_bound_logger(logging.INFO),
        logger_factory=structlog.PrintLoggerFactory(file=sys.stderr),
        cache_logger_on_first_use=False,
    )
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(
        structlog.stdlib.ProcessorFormatter(
            foreign_pre_chain=_SHARED,
            processors=[structlog.stdlib.ProcessorFormatter.remove_processors_meta, *renderer],
        )
    )
    handler.addFilter(_is_no_cut_off_reset)
    logging.basicConfig(handlers=[handler], level=logging.WARNING, force=True)
    logging.getLogger("uvicorn.error").addFilter(_is_our_fault)
    logging.getLogger("uvicorn.error").addFilter(_FewWarnings(time.monotonic()))


def _is_our_fault(record: logging.LogRecord) -> bool:
    """uvicorn logs a traceback for each text message that is not UTF-8, so any client could flood the log. Closing the
    connection (1007) and counting the message is enough."""
    return not (record.exc_info and isinstance(record.exc_info[1], UnicodeDecodeError))


def _is_no_cut_off_reset(record: logging.LogRecord) -> bool:
    """SQLAlchemy logs an error if the tower ends, by a signal or a fault, while a task gives a connection back. The
    connection is discarded, and nothing was written through it."""
    is_of_pool = record.name.startswith("sqlalchemy.pool")
    return not (is_of_pool and record.exc_info and isinstance(record.exc_info[1], asyncio.CancelledError))


class _FewOfAKind:
    """Bounds the lines of a storm. `left_out`: the number of such lines that were dropped before this one."""

    def __init__(self, now: float) -> None:
        self._budgets = {event: LogBudget(LIMITS.log_lines_per_s, LIMITS.log_lines_burst, now) for event in _REPEATED}

    def __call__(self, _logger: object, _method: str, line: structlog.typing.EventDict) -> structlog.typing.EventDict:
        budget = self._budgets.get(str(line.get("event")))
        if budget is None:
            return line
        if not budget.admits(time.monotonic()):
            raise structlog.DropEvent
        left_out = budget.take_unreported()
        return {**line, "left_out": left_out} if left_out else line


class _FewWarnings(logging.Filter):
    """All warnings of uvicorn concern data from strangers ("Invalid HTTP request received.")."""

    def __init__(self, now: float) -> None:
        super().__init__()
        self._budget = LogBudget(LIMITS.log_lines_per_s, LIMITS.log_lines_burst, now)

    def filter(self, record: logging.LogRecord) -> bool:
        if record.levelno != logging.WARNING:
            return True
        if not self._budget.admits(time.monotonic()):
            return False
        left_out = self._budget.take_unreported()
        if left_out:
            record.msg = f"{record.msg} ({left_out} such lines were left out)"
        return True
