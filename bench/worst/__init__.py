"""`python -m bench worst`: how long a single request or message can keep the tower's event loop."""
