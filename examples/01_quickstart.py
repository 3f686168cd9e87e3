"""The environment in ten lines: random actions for two seconds."""

import gymnasium as gym

import fixation_gym  # noqa: F401  (registers FixationPick-v0)


def main() -> None:
    """Run and print what the robot sees."""
    env = gym.make("FixationPick-v0", scenario="translucent")
    obs, info = env.reset(seed=0)
    for _ in range(50):
        obs, _, terminated, truncated, info = env.step(env.action_space.sample())
        if terminated or truncated:
            obs, info = env.reset()
    print("image", obs["rgb"].shape, " camera at", obs["camera_pose"][:3].round(3), "m")
    print("true distance", round(info["distance_true_m"], 3), "m  for progress", round(info["reward_progress"], 3))
    env.close()


if __name__ == "__main__":
    main()
