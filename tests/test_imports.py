"""Who may import whom, checked in the source and in a process where heavy modules are watched and cannot be had."""

import ast
import json
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
MUJOCO_FILES = {
    f"fixation_gym/envs/{name}.py"
    for name in ("pick_sim", "rehearsal", "task_model", "contacts", "offscreen", "rendering", "textures", "truth_view")
} | {f"fixation_gym/envs/{name}.py" for name in ("privileged_map", "photoreal/solids", "photoreal/view")}
FORBIDDEN = {
    "fixation_gym/robots": ("fixation_gym.envs", "gymnasium", "mujoco", "robosuite", "torch"),
    "fixation_gym/geometry": ("cv2", "gymnasium", "mujoco", "robosuite", "torch", "fixation_gym.perception"),
    "fixation_gym/control": ("cv2", "gymnasium", "mujoco", "robosuite", "torch", "fixation_gym.perception"),
    "fixation_gym/perception": (
        "gymnasium",
        "mujoco",
        "robosuite",
        "torch",
        "fixation_gym.envs",
        "fixation_gym.control",
        "fixation_gym.experiments",
    ),
    "policies/fixation_policies/servo": (
        "gymnasium",
        "mujoco",
        "robosuite",
        "torch",
        "fixation_gym.envs",
        "fixation_gym.evaluation",
    ),
    "fixation_gym/replay": (
        "gymnasium",
        "mujoco",
        "robosuite",
        "torch",
        "fixation_gym.envs",
        "fixation_gym.experiments",
    ),
    "fixation_gym/envs": ("torch", "fixation_gym.evaluation", "fixation_gym.experiments", "fixation_policies"),
}
FORBIDDEN["fixation_gym/robots"] += ("fixation_gym.control", "fixation_gym.geometry", "fixation_gym.perception")
FORBIDDEN["fixation_gym/geometry"] += ("fixation_gym.control", "fixation_gym.envs")
FORBIDDEN["fixation_gym/control"] += ("fixation_gym.envs",)


@cache
def imported_modules(path: Path) -> frozenset[str]:
    modules: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            modules |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            modules |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
    return modules


@pytest.mark.parametrize("package", FORBIDDEN)
def test_packages_import_only_what_they_may(package):
    for path in (ROOT / package).rglob("*.py"):
        for module in imported_modules(path):
            broken = [name for name in FORBIDDEN[package] if module == name or module.startswith(f"{name}.")]
            assert not broken, f"{path.relative_to(ROOT)} imports {module}"


def test_only_few_files_know_the_simulators():
    for path in [*(ROOT / "fixation_gym").rglob("*.py"), *(ROOT / "policies").rglob("*.py")]:
        name = str(path.relative_to(ROOT))
        packages = {module.split(".")[0] for module in imported_modules(path)}
        assert "robosuite" not in packages or name == "fixation_gym/envs/robosuite_backend.py", name
        assert "mujoco" not in packages or name in MUJOCO_FILES | {"fixation_gym/doctor.py", "fixation_gym/gl.py"}, name


WATCHED = """
import contextlib, io, json, sys

class Watch:  # a guarded import is found as well as one that would fail
    tried = []
    def find_spec(self, name, path=None, target=None):
        if name in ("mujoco", "robosuite", "torch", "OpenGL"):
            self.tried.append(name)
            raise ModuleNotFoundError(name)

sys.meta_path.insert(0, Watch())
seen = {}

def stage(name):
    seen[name], Watch.tried = Watch.tried, []

import fixation_gym.gl
stage("backend")
import fixation_gym.cli
with contextlib.redirect_stdout(io.StringIO()) as shown:
    try:
        fixation_gym.cli.main(["evaluate", "--help"])
    except SystemExit as end:
        assert not end.code
stage("help")
slow = [name for name in ("scipy", "cv2", "numba", "tqdm", "joblib", "matplotlib") if name in sys.modules]
import fixation_gym.evaluation.demo
import fixation_gym.perception, fixation_policies.servo.servo_policy, fixation_gym.envs.zfc_env
stage("modules")
print(json.dumps({**seen, "slow": slow, "text": shown.getvalue()}))
"""


@pytest.fixture(scope="module")
def watched():
    """What one fresh process tried to import at each stage, and the help text; a process takes most of a second."""
    result = subprocess.run([sys.executable, "-c", WATCHED], capture_output=True, text=True, cwd=ROOT, check=False)
    assert result.returncode == 0, result.stderr
    return json.loads(result.stdout)


def test_choosing_a_backend_does_not_import_the_simulator(watched):
    assert watched["backend"] == []


def test_help_loads_neither_simulator_nor_torch_nor_anything_slow_that_the_doctor_may_find_missing(watched):
    assert watched["help"] == watched["slow"] == []
    assert "--scenario" in watched["text"]


def test_modules_import_without_simulator_and_torch(watched):
    assert watched["modules"] == []


ON_A_ROBOT = """
import sys

class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ("gymnasium", "mujoco", "robosuite", "torch", "stable_baselines3"):
            raise ModuleNotFoundError(name, name=name)

sys.meta_path.insert(0, Absent())
import importlib.util
real = importlib.util.find_spec
importlib.util.find_spec = lambda name, *rest: None if name == "gymnasium" else real(name, *rest)
import numpy as np
import fixation_gym.control.servo_laws
from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception import Perception
import fixation_gym.fixator, fixation_policies.paper
from fixation_policies.servo.servo_policy import ServoPolicy
camera = Intrinsics.from_fovy(96, 128, 0.7)
policy = ServoPolicy(Perception(camera))
obs = {"rgb": np.zeros((96, 128, 3), np.uint8), "time": [0.0], "gripper_width": [0.08], "joint_pos": np.zeros(7),
       "joint_vel": np.zeros(7), "camera_pose": [0.4, 0, 0.5, 0, 1, 0, 0], "camera_twist": np.zeros(6)}
print(policy.act(obs).shape)
"""


def test_perception_and_servo_run_without_gymnasium_and_simulator():
    result = subprocess.run([sys.executable, "-c", ON_A_ROBOT], capture_output=True, text=True, cwd=ROOT, check=False)
    assert result.returncode == 0, result.stderr
    assert result.stdout.strip() == "(7,)"
