"""What any server process needs: settings, timers, secrets, background work."""
