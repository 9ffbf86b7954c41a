"""The characters on targets: faces for training and for judging, and the training of the agent's reader."""
