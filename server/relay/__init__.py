"""The relay: live links, live browsers, and the hub between them. The database is not on any path in here."""
