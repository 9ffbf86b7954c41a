"""What every rule raises when the answer is no. Knows nothing of HTTP: `problems.py` maps it."""


class Refusal(Exception):
    """A request that was understood and turned down. The message is for people and holds no secrets."""

    def __init__(self, message: str) -> None:
        super().__init__(message)
        self.message = message


class RetryLater(Refusal):
    """Refused for now. `retry_after_s`: when to try again."""

    def __init__(self, message: str, *, retry_after_s: float) -> None:
        super().__init__(message)
        self.retry_after_s = retry_after_s
