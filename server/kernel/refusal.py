"""The exception that every rule raises to refuse. Independent of HTTP: `problems.py` maps it."""


class Refusal(Exception):
    """A valid request that is refused. The message is for people and contains no secrets."""

    def __init__(self, message: str) -> None:
        super().__init__(message)
        self.message = message


class RetryLater(Refusal):
    """Refused for now. `retry_after_s`: when a retry makes sense."""

    def __init__(self, message: str, *, retry_after_s: float) -> None:
        super().__init__(message)
        self.retry_after_s = retry_after_s
