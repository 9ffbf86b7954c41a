"""What every store uses: the database, its schema, retention."""
