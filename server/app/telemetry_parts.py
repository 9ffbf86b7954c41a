"""Assembles the export of traces. OpenTelemetry's SDK is not imported unless it is turned on."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from fastapi import FastAPI
from prometheus_client import CollectorRegistry

from server.live.hub import Hub
from server.operations.core.operation import Operation
from server.runtime.settings import Settings, SettingsError

if TYPE_CHECKING:
    from server.monitoring.api.tracing.tracing import Tracing


def new_tracing(settings: Settings, hub: Hub) -> Tracing | None:
    """None without a collector. Raises SettingsError if OpenTelemetry is not installed."""
    if not settings.telemetry_endpoint:
        return None
    try:
        from server.monitoring.api.tracing.operation_spans import OperationSpans
        from server.monitoring.api.tracing.tracing import Tracing
    except ImportError:
        raise SettingsError(
            "OTEL_EXPORTER_OTLP_ENDPOINT", "needs OpenTelemetry: pip install 'control-tower[telemetry]'"
        ) from None
    tracing = Tracing(settings.telemetry_endpoint)
    spans = OperationSpans(tracing)
    operations = hub.operations
    operations.on_ordered, operations.on_answered = spans.ordered, spans.answered
    operations.on_ended = _then(operations.on_ended, spans.ended)
    return tracing


def trace_requests(app: FastAPI, tracing: Tracing, registry: CollectorRegistry) -> None:
    from server.monitoring.api.tracing.collector import TelemetryCollector
    from server.monitoring.api.tracing.request_spans import RequestSpans

    registry.register(TelemetryCollector(tracing))
    app.add_middleware(RequestSpans, tracing=tracing)


def _then(first: Callable[[Operation], None], second: Callable[[Operation], None]) -> Callable[[Operation], None]:
    def both(operation: Operation) -> None:
        first(operation)
        second(operation)

    return both
