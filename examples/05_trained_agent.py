"""A trained agent that sees the zero-flow map, in one episode: the same loop as for any other policy."""

from pathlib import Path

import gymnasium as gym

import fixation_gym  # noqa: F401
from fixation_policies import agents
from fixation_policies.catalogue import make_policy, needed_environment

AGENT = Path(agents.__file__).parent / "zfc.zip"


def main(agent: Path = AGENT, scenario: str = "clear", seed: int = 1) -> bool:
    """Run one episode; returns whether the object was lifted."""
    place = needed_environment(
        str(agent)
    )  # the environment, observation and image size that the agent was trained with
    env = gym.make(place.env_id, scenario=scenario, image_size=place.image_size, **place.arguments)
    policy = make_policy(str(agent), env)
    obs, info = env.reset(seed=seed)
    policy.reset(seed=seed)
    done, step = False, 0
    while not done:
        action = policy.act(obs)
        if step % 25 == 0:
            front = (obs["zfc_map"] > 0.51).mean()
            phase = policy.estimate.phase if policy.estimate else ""
            print(f"{step / 25:4.0f} s  {phase:8}  {obs['fixation'][3]:.3f} m  {front:4.0%} of the map in front")
        obs, _, terminated, truncated, info = env.step(action)
        done, step = terminated or truncated, step + 1
    print("lifted" if info["is_success"] else "not lifted", "- with a collision" if info["collision"] else "")
    env.close()
    return info["is_success"]


if __name__ == "__main__":
    main()
