"""`python -m onboard_agent.landing PAD CAMERA`: the process that looks for the landing pad. The flight process starts
it, and kills it at its end. Not meant to be started by hand."""

import sys

from onboard_agent.step_back import step_back

if __name__ == "__main__":
    step_back()
    from onboard_agent.landing.watcher import watch

    watch(*sys.argv[1:3])
