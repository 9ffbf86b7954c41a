"""Flight files of other programs, made into telemetry logs that the replay reads."""
