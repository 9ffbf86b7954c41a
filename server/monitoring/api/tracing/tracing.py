"""OpenTelemetry: one trace for each request, whose id follows from the request's. Imported only if it is turned on;
FastAPI itself imports the API, but not the SDK."""

from __future__ import annotations

import asyncio
import hashlib
import logging
import re
import threading
from contextlib import suppress
from typing import Final

from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
from opentelemetry.sdk.resources import SERVICE_VERSION, OTELResourceDetector, Resource
from opentelemetry.sdk.trace import TracerProvider
from opentelemetry.sdk.trace.id_generator import RandomIdGenerator
from opentelemetry.trace import NoOpTracer, Tracer

from server import VERSION
from server.monitoring.api.tracing.span_queue import SpanQueue
from server.runtime.request_id import current_request_id

SERVICE_NAME: Final = "control-tower"
CLOSES_WITHIN_S: Final = 2.0
"""Spans that a collector has not taken by then are lost: the tower does not stay for them."""
_HEXADECIMAL: Final = re.compile(r"[0-9a-f]{16}|[0-9a-f]{32}")


def trace_id_of(request_id: str) -> int:
    """32 hexadecimal digits are the trace id. 16, as the tower makes them, are its end, after zeros. Any other text is
    hashed. 0: there is none."""
    if _HEXADECIMAL.fullmatch(request_id):
        return int(request_id, 16)
    return int.from_bytes(hashlib.sha256(request_id.encode()).digest()[:16]) if request_id else 0


class _RequestIds(RandomIdGenerator):
    def generate_trace_id(self) -> int:
        return trace_id_of(current_request_id()) or super().generate_trace_id()


class Tracing:
    """One per tower. `endpoint`: base URL of a collector's OTLP over HTTP. The SDK reads the other variables of the
    standard by itself (docs/how-to/traces.md)."""

    def __init__(self, endpoint: str) -> None:
        self._endpoint = endpoint
        self._provider: TracerProvider | None = None
        self.queue: SpanQueue | None = None
        self.tracer: Tracer = NoOpTracer()
        """Records nothing before `open`."""

    def open(self) -> None:
        """Starts the thread that sends."""
        # It logs every failure. We log the first one, and count.
        logging.getLogger("opentelemetry").setLevel(logging.CRITICAL)
        self.queue = SpanQueue(OTLPSpanExporter(endpoint=f"{self._endpoint}/v1/traces"))
        own = Resource({"service.name": SERVICE_NAME, SERVICE_VERSION: VERSION})
        self._provider = TracerProvider(
            resource=own.merge(OTELResourceDetector().detect()),
            id_generator=_RequestIds(),
            shutdown_on_exit=False,
        )
        self._provider.add_span_processor(self.queue)
        self.tracer = self._provider.get_tracer("control-tower", VERSION)

    async def close(self) -> None:
        """Sends what waits, for CLOSES_WITHIN_S at most."""
        provider, self._provider = self._provider, None
        if provider is None:
            return
        loop, ended = asyncio.get_running_loop(), asyncio.Event()

        def end() -> None:
            provider.shutdown()
            with suppress(RuntimeError):  # the loop has ended before
                loop.call_soon_threadsafe(ended.set)

        threading.Thread(target=end, name="end of telemetry", daemon=True).start()
        with suppress(TimeoutError):
            async with asyncio.timeout(CLOSES_WITHIN_S):
                await ended.wait()
