"""What the tower counts and traces: Prometheus, OpenTelemetry."""
