"""``python -m fixation_gym`` is the command ``fixation-gym``."""

import sys

from fixation_gym.cli import main

sys.exit(main())
