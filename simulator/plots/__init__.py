"""Pictures of flights, as SVG."""
