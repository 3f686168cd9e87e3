"""The paper's behaviour picks the object up; prints each phase with the distance it believes and the true one."""

import gymnasium as gym

import fixation_gym  # noqa: F401
from fixation_policies.catalogue import make_policy


def main(scenario: str = "opaque", seed: int = 1) -> bool:
    """Run one episode; returns whether the object was lifted."""
    env = gym.make("FixationPick-v0", scenario=scenario)
    policy = make_policy("servo", env)
    obs, info = env.reset(seed=seed)
    policy.reset(seed)
    phase = ""
    done = False
    while not done:
        action = policy.act(obs)
        estimate = policy.estimate
        if estimate is not None and estimate.phase != phase:
            phase = estimate.phase
            believed, true = 1000 * estimate.distance_m, 1000 * info["distance_true_m"]
            print(f"{obs['time'][0]:5.1f} s  {phase:9s}  distance {believed:4.0f} mm, true {true:4.0f} mm")
        obs, _, terminated, truncated, info = env.step(action)
        done = terminated or truncated
    print("lifted" if info["is_success"] else "not lifted", "- with a collision" if info["collision"] else "")
    env.close()
    return info["is_success"]


if __name__ == "__main__":
    main()
