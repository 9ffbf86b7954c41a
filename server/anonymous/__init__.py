"""Strangers: what somebody who is not signed in may cost the tower."""
