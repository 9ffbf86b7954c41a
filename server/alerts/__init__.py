"""Alerts: the rules, their history, and delivery by mail, web push and webhook."""
