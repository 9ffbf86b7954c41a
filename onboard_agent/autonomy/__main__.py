"""`python -m onboard_agent.autonomy`: a controller's process. The flight process starts it, and kills it at its end.
Not meant to be started by hand."""

from onboard_agent.autonomy.step_back import step_back

NICE = 5

if __name__ == "__main__":
    step_back(NICE)
    from onboard_agent.autonomy.runner import main

    main()
