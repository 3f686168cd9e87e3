"""Configurations of rl-zoo3: ``python -m rl_zoo3.train --conf-file policies.rl.zoo.sac`` and its other commands."""
