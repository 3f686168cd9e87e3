"""Configurations for rl-zoo3's commands: ``python -m rl_zoo3.train --conf-file fixation_policies.rl.zoo.sac``."""
