"""Spans on their way to the collector: a bounded queue, a thread that sends from it, and counts of what became of them.

The event loop only appends. A collector that is slow or gone costs spans, which are counted, and delays nothing.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from typing import Final

import structlog
from opentelemetry.context import Context
from opentelemetry.sdk.trace import ReadableSpan, Span, SpanProcessor
from opentelemetry.sdk.trace.export import BatchSpanProcessor, SpanExporter, SpanExportResult

MAX_WAITING: Final = 2048
"""About 4 MB, and a minute of 30 commands per second. Beyond it the newest spans are dropped."""
AT_ONCE: Final = 128
"""Spans of one message: to encode more of them holds the interpreter for too long."""
OUTCOMES: Final = ("sent", "failed", "dropped")
_log = structlog.get_logger(__name__)


class SpanQueue(SpanProcessor):
    """`exporter`: sends spans, in the thread of this queue. `counts`: spans by outcome."""

    def __init__(self, exporter: SpanExporter) -> None:
        self.counts = dict.fromkeys(OUTCOMES, 0)
        self.waiting = 0
        """Spans that were not sent yet, those of the message on its way included."""
        self._lock = threading.Lock()
        self._sender = BatchSpanProcessor(
            _Counted(exporter, self._sent), max_queue_size=MAX_WAITING, max_export_batch_size=AT_ONCE
        )

    def on_start(self, span: Span, parent_context: Context | None = None) -> None:
        pass

    def on_end(self, span: ReadableSpan) -> None:
        if span.context is None or not span.context.trace_flags.sampled:
            return
        with self._lock:
            if self.waiting >= MAX_WAITING:
                self.counts["dropped"] += 1
                return
            self.waiting += 1
        self._sender.on_end(span)

    def shutdown(self) -> None:
        """Sends the rest; blocks meanwhile."""
        self._sender.shutdown()  # type: ignore[no-untyped-call]

    def force_flush(self, timeout_millis: int = 30_000) -> bool:
        return self._sender.force_flush(timeout_millis)

    def _sent(self, count: int, outcome: str) -> None:
        with self._lock:
            self.waiting -= count
            self.counts[outcome] += count


class _Counted(SpanExporter):
    """Says once that spans are lost, and once that they are sent again."""

    def __init__(self, exporter: SpanExporter, sent: Callable[[int, str], None]) -> None:
        self._exporter = exporter
        self._sent = sent
        self._failing = False

    def export(self, spans: Sequence[ReadableSpan]) -> SpanExportResult:
        try:
            result = self._exporter.export(spans)
        except Exception:
            result = SpanExportResult.FAILURE
        failed = result is not SpanExportResult.SUCCESS
        self._sent(len(spans), "failed" if failed else "sent")
        if failed != self._failing:
            self._failing = failed
            if failed:
                _log.warning("spans_not_exported")
            else:
                _log.info("spans_exported_again")
        return result

    def shutdown(self) -> None:
        self._exporter.shutdown()

    def force_flush(self, timeout_millis: int = 30_000) -> bool:
        return self._exporter.force_flush(timeout_millis)
