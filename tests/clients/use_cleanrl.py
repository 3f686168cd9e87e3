"""CleanRL's script for PPO with continuous actions, as it is; it flattens the observation itself."""

import runpy
import sys
import tempfile
from contextlib import chdir

ARGUMENTS = ["--env-id", "fixation_gym:FixationPickZFC-v0", "--total-timesteps", "64", "--num-steps", "32"]
ARGUMENTS += ["--num-minibatches", "2", "--update-epochs", "1", "--cuda", "False"]

if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder, chdir(folder):  # it writes where it is
        sys.argv[1:] = ARGUMENTS
        runpy.run_module("cleanrl.ppo_continuous_action", run_name="__main__")
