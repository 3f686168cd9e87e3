"""The environments under the libraries that people use, unchanged."""

import os
import subprocess
import sys
import threading

import gymnasium as gym
import numpy as np
import pytest

import fixation_gym  # noqa: F401
from fixation_gym import gl
from fixation_gym.envs.pick_env import FixationPickEnv
from fixation_gym.envs.zfc_env import FixationPickZFC

pytestmark = pytest.mark.sim
SMALL = (64, 80)


def python(code):
    """What a fresh process prints and complains about; it has two minutes."""
    ours = ("LP_NUM_THREADS", "MUJOCO_GL", "PYOPENGL_PLATFORM", "FIXATION_GYM_GL")
    inherited = {key: value for key, value in os.environ.items() if key not in ours}
    return subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code],
        capture_output=True,
        text=True,
        timeout=120,
        env=inherited,
        check=False,
    )


@pytest.mark.parametrize("algorithm", ["PPO", "SAC"])
def test_stable_baselines_learns_on_the_map_with_its_own_policy(algorithm):
    import stable_baselines3

    arguments = {"PPO": {"n_steps": 8, "batch_size": 8}, "SAC": {"learning_starts": 4, "buffer_size": 50}}[algorithm]
    env = gym.make("FixationPickZFC-v0", image_size=SMALL)
    model = getattr(stable_baselines3, algorithm)("MultiInputPolicy", env, **arguments)
    before = model.policy.state_dict()["action_net.bias" if algorithm == "PPO" else "actor.mu.bias"].clone()
    model.learn(12)
    after = model.policy.state_dict()["action_net.bias" if algorithm == "PPO" else "actor.mu.bias"]
    assert not np.array_equal(before.numpy(), after.numpy())
    env.close()


def test_the_unwrapped_environment_has_the_same_spaces():
    env = gym.make("FixationPickZFC-v0", image_size=SMALL)
    assert isinstance(env.unwrapped, FixationPickZFC)
    assert env.unwrapped.action_space == env.action_space
    assert env.unwrapped.observation_space == env.observation_space


def test_lists_of_frames_are_rendered_by_both_ids():
    for name in ("FixationPick-v0", "FixationPickZFC-v0"):
        env = gym.make(name, image_size=SMALL, render_mode="rgb_array_list")
        env.reset(seed=0)
        env.step(env.action_space.sample())
        frames = env.render()
        assert len(frames) == 2
        assert frames[0].ndim == 3
        env.close()


FORKED = """
import gymnasium as gym, fixation_gym
if __name__ == "__main__":
    env = gym.make("FixationPick-v0", image_size=(64, 80))
    here, _ = env.reset(seed=3)
    workers = gym.make_vec("FixationPick-v0", num_envs=2, vectorization_mode="async", image_size=(64, 80))
    there, _ = workers.reset(seed=3)
    print((there["rgb"][0] == here["rgb"]).all())
    workers.close()
"""


def test_workers_forked_after_the_parent_rendered_see_the_same():
    result = python(FORKED)
    assert result.stdout.splitlines()[-1:] == ["True"], result.stderr


@pytest.mark.parametrize(("renderer", "threads"), [("llvmpipe (LLVM)", "2"), ("NVIDIA", "0")])
def test_where_a_forked_process_would_wait_for_ever_it_says_how_not_to(monkeypatch, renderer, threads):
    monkeypatch.setattr(gl, "_first_process", 1)
    monkeypatch.setattr(gl, "_renderer_name", renderer)
    monkeypatch.setenv("LP_NUM_THREADS", threads)
    env = FixationPickEnv(image_size=SMALL)
    with pytest.raises(RuntimeError, match=r"start workers by spawn, as gym\.make_vec does"):
        env.reset(seed=0)
    env.close()


def test_any_thread_may_step():
    env = gym.make("FixationPick-v0", image_size=SMALL)
    env.reset(seed=0)
    seen = []
    for _ in range(2):
        thread = threading.Thread(target=lambda: seen.append(env.step(np.zeros(7, np.float32))[0]["rgb"]))
        thread.start()
        thread.join()
        seen.append(env.step(np.zeros(7, np.float32))[0]["rgb"])
    assert len(seen) == 4
    assert all(image.std() > 10 for image in seen)
    env.close()


def test_two_environments_each_in_a_thread_see_what_they_see_alone():
    def walk(env, seed, seen):
        obs, _ = env.reset(seed=seed)
        for _ in range(5):
            obs, *_ = env.step(np.full(7, 0.2, np.float32))
        seen[seed] = obs["rgb"]

    envs = [FixationPickEnv("opaque", image_size=SMALL) for _ in range(2)]
    alone, together = {}, {}
    for seed, env in enumerate(envs):
        walk(env, seed, alone)
    threads = [threading.Thread(target=walk, args=(env, seed, together)) for seed, env in enumerate(envs)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for seed, env in enumerate(envs):
        np.testing.assert_array_equal(together[seed], alone[seed])
        env.close()


ROBOSUITE = """
import gymnasium as gym, numpy as np, fixation_gym
from fixation_gym.gl import PROBE_MODEL
env = gym.make("FixationPick-v0", image_size=(64, 80))
env.reset(seed=0)
from robosuite.utils.binding_utils import MjRenderContextOffscreen, MjSim
sim = MjSim.from_xml_string(PROBE_MODEL)
sim.forward()
context = MjRenderContextOffscreen(sim, device_id=-1)
def picture():
    context.render(32, 32, camera_id=0)
    return context.read_pixels(32, 32).copy()
before = picture()
env.step(env.action_space.sample())
print(before.std() > 0 and (picture() == before).all())
"""


def test_robosuite_renders_between_our_steps_and_the_program_ends_without_a_word():
    result = python(ROBOSUITE)
    assert result.stdout.splitlines()[-1:] == ["True"], result.stderr
    assert result.returncode == 0, result.stderr
    assert "Error" not in result.stderr


LOST = """
import gymnasium as gym, numpy as np, fixation_gym
from fixation_gym.gl import LostGLError, select_backend
if select_backend() != "egl":
    raise SystemExit("EGL is needed here")
import mujoco.egl
from OpenGL import EGL
env = gym.make("FixationPickZFC-v0", image_size=(64, 80))
env.reset(seed=0)
view = env.unwrapped._views.view("observation", env.unwrapped.sim)
context = view.renderer._gl_context._context
display = mujoco.egl.EGL_DISPLAY
{loss}
try:
    env.step(env.action_space.sample())
except LostGLError as error:
    print(error)
env.close()
env.reset(seed=0)
print(env.step(np.zeros(4, np.float32))[0]["zfc_map"].shape)
"""


@pytest.mark.parametrize(
    ("loss", "reason"),
    [("EGL.eglTerminate(display)", "EGL_BAD_DISPLAY"), ("EGL.eglDestroyContext(display, context)", "EGL_BAD_CONTEXT")],
)
def test_a_context_that_is_gone_is_told_in_one_sentence_and_a_reset_opens_another(loss, reason):
    result = python(LOST.format(loss=loss))
    told, shape = result.stdout.splitlines()
    assert told.startswith(f"the GL context is gone ({reason}): another library shut EGL down")
    assert "close() the environment and reset() it" in told
    assert shape == "(1, 32, 32)"
    assert result.stderr == ""


@pytest.mark.parametrize("make", [FixationPickEnv, FixationPickZFC])
def test_a_step_before_the_reset_or_after_the_end_says_so(make):
    env = make(image_size=SMALL)
    action = env.action_space.sample()
    with pytest.raises(gym.error.ResetNeeded, match="call reset"):
        env.step(action)
    env.reset(seed=0)
    env.step(action)
    env.close()
    with pytest.raises(gym.error.ResetNeeded, match="again after close"):
        env.step(action)


def test_scenes_do_not_depend_on_how_long_the_episodes_before_were():
    env = FixationPickEnv("opaque", image_size=SMALL)
    scenes = []
    for steps in (3, 17):
        env.reset(seed=1)
        for _ in range(steps):
            env.step(env.action_space.sample())
        env.reset()
        scenes.append(env.scene)
    assert scenes[0] == scenes[1]
    env.close()


def test_values_in_info_have_a_dtype_as_torchrl_asks():
    env = FixationPickEnv(image_size=SMALL)
    _, info = env.reset(seed=0)
    dtypes = {key: value.dtype for key, value in info.items()}
    assert {key for key, dtype in dtypes.items() if dtype.kind == "b"} == {"is_success", "success", "collision"}
    env.close()


def test_the_renderer_has_a_name():
    env = FixationPickEnv(image_size=SMALL)
    env.reset(seed=0)
    assert gl.renderer_name()
    env.close()
