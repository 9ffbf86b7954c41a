"""`python -m onboard_agent.autonomy`: a controller's process. The flight process starts it, and kills it at its end.
Not meant to be started by hand."""

import sys

from onboard_agent.step_back import step_back

if __name__ == "__main__":
    step_back()
    if sys.argv[1:]:
        from onboard_agent.autonomy.describing import main
    else:
        from onboard_agent.autonomy.runner import main
    main()
