"""Policies and detectors of one's own, named as module:Class."""

import sys
import uuid

import numpy as np
import pytest

from fixation_gym.errors import UsageError
from fixation_gym.strangers import is_class_name
from fixation_policies import catalogue
from fixation_policies.base import decision
from fixation_policies.baselines import RandomPolicy
from fixation_policies.catalogue import check_detector, check_policy, make_policy, source_hashes

CODE = """
import numpy as np

class Still:
    def __init__(self, env):
        self.env = env
    def reset(self, seed=None):
        pass
    def act(self, obs):
        return np.zeros(7, np.float32)

class Blind:
    def __init__(self, intrinsics):
        self.shape = intrinsics.height, intrinsics.width
    def reset(self):
        pass
    def detect(self, observation, expected):
        return np.zeros(self.shape, bool)

class Mute:
    def reset(self, seed=None):
        pass

class Broken(Still):
    def act(self, obs):
        raise KeyError("speed")

number = 3
"""


@pytest.fixture
def module(tmp_path, monkeypatch):
    """Name of a module with some classes, in the present folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    name = f"mine_{uuid.uuid4().hex}"
    (tmp_path / f"{name}.py").write_text(CODE)
    return name


class Env:
    """As much of an environment as policies are made for."""

    unwrapped = property(lambda self: self)


def test_a_class_of_one_s_own_is_made_with_the_environment(module):
    env = Env()
    check_policy(f"{module}:Still")
    policy = make_policy(f"{module}:Still", env)
    assert policy.env is env
    np.testing.assert_array_equal(policy.act({}), np.zeros(7))


def test_variants_are_no_classes_of_one_s_own():
    assert all(not is_class_name(name) or name in catalogue.POLICY_NAMES for name in catalogue.POLICY_NAMES)
    assert is_class_name("package.module:Class")
    assert not is_class_name("servo")
    assert not is_class_name("a b:c")
    assert not is_class_name("agent.zip")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("nowhere_at_all:Still", "there is no module 'nowhere_at_all'; install it, or run in the folder that holds it"),
        ("{module}:Other", "has no class 'Other'"),
        ("{module}:number", "has no class 'number'"),
        ("{module}:Mute", r"needs reset\(\) and act\(\), and lacks act"),
        ("clever", "or module:Class"),
    ],
)
def test_a_policy_that_cannot_be_had_is_said_in_one_sentence(module, name, message):
    with pytest.raises(UsageError, match=message) as error:
        check_policy(name.format(module=module))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("name", "policy", "message"),
    [
        ("{module}:Mute", "servo", r"needs reset\(\) and detect\(\), and lacks detect"),
        ("eyes", "servo", "unknown detector 'eyes'; choose one of colour, mean_shift, box, or module:Class"),
        ("colour", "oracle", "goes with the policies that look"),
    ],
)
def test_a_detector_that_cannot_be_had_is_said_in_one_sentence(module, name, policy, message):
    with pytest.raises(UsageError, match=message):
        check_detector(name.format(module=module), policy)
    check_detector(f"{module}:Blind", "servo")
    check_detector(None, "oracle")


def test_what_a_module_needs_itself_keeps_its_own_error(module, tmp_path):
    (tmp_path / f"{module}_b.py").write_text("import a_package_that_is_not_there\n")
    with pytest.raises(ModuleNotFoundError, match="a_package_that_is_not_there"):
        check_policy(f"{module}_b:Still")


def test_changed_code_is_another_policy(module, tmp_path):
    before = source_hashes(f"{module}:Still", f"{module}:Blind")
    assert set(before) == {"policy_sha256", "detector_sha256"}
    (tmp_path / f"{module}.py").write_text(CODE + "\n# changed\n")
    assert source_hashes(f"{module}:Still", f"{module}:Blind") != before
    assert source_hashes("servo", "box") == {}


def test_a_failing_policy_is_named_and_keeps_its_traceback(module):
    broken = make_policy(f"{module}:Broken", Env())
    with pytest.raises(RuntimeError, match=rf"the policy {module}.Broken failed: KeyError: 'speed'") as error:
        decision(broken, {})
    assert isinstance(error.value.__cause__, KeyError)


def test_what_the_project_s_own_policies_raise_stays_as_it_is():
    with pytest.raises(ZeroDivisionError):
        decision(RandomPolicy(hold_steps=0), {})
