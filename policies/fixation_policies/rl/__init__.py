"""Reinforcement learning on ``FixationPickZFC-v0`` with Stable-Baselines3: training, agents, comparison."""
