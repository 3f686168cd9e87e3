"""Who may import whom, checked in the source and by importing with modules blocked."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
MUJOCO_FILES = {f"fixation_gym/envs/{name}.py" for name in ("pick_sim", "contacts", "rendering", "truth_view")}
FORBIDDEN = {
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
    "policies/servo": ("gymnasium", "mujoco", "robosuite", "torch", "fixation_gym.envs", "fixation_gym.evaluation"),
    "fixation_gym/envs": ("torch", "fixation_gym.evaluation", "fixation_gym.experiments", "policies"),
}
FORBIDDEN["fixation_gym/geometry"] += ("fixation_gym.control", "fixation_gym.envs")
FORBIDDEN["fixation_gym/control"] += ("fixation_gym.envs",)


def imported_modules(path: Path) -> set[str]:
    modules = set()
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
        assert "mujoco" not in packages or name in MUJOCO_FILES | {"fixation_gym/doctor.py"}, name


def test_modules_import_without_simulator_and_torch():
    modules = ("fixation_gym", "fixation_gym.perception", "policies.servo.servo_policy", "fixation_gym.envs.pick_env")
    code = "import sys\n"
    code += "".join(f"sys.modules[{name!r}] = None\n" for name in ("mujoco", "robosuite", "torch"))
    code += "".join(f"import {name}\n" for name in modules)
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=False)
    assert result.returncode == 0, result.stderr
