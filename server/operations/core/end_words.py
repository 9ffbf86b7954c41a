"""Texts for operations that end without a report of the agent. Pure."""

from server.operations.core.operation import Lane, Operation


def moved_words(operation: Operation) -> str:
    """The controls changed hands between two steps."""
    return f"It was stopped after this step, because the controls moved: {operation.step.phase}."


def overruled_words(operation: Operation) -> str:
    """Between two steps the drone was made to hold, or got another command."""
    step = operation.step.phase
    return f"It was stopped after this step: {step}. The rest was not sent because a hold or another command came."


def not_sent_words(operation: Operation, why: str) -> str:
    """While the next step waited for its moment."""
    return f"It was stopped before this step: {operation.step.phase}. {why}"


def unknown_words(operation: Operation, what: str) -> str:
    """`what`: what the agent did instead of telling the end."""
    advice = ": check what is on board before you fly it" if operation.order.writes else ""
    if operation.order.lane is Lane.COMMANDS:
        advice = ": it is not known whether the command was carried out"
    elif operation.order.lane in (Lane.FOLLOWING, Lane.CONTROLLER):
        advice = ": it is not known whether it holds, check it"
    return f"The agent of {operation.drone_name} {what}{advice}."
