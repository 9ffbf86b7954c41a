"""Makes and keeps videos with a burnt-in flight display for a while."""
