"""People: signing in and out, passwords, passkeys, second factors, tokens, preferences."""
