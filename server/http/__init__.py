"""What every route uses: sign-in, access, problem documents, middleware."""
