"""Recordings of live video: kept on the tower, made into MP4 when they have ended (docs/recordings.md)."""
