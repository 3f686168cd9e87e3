"""Whatever is given, it works or one clear sentence says what is allowed: no traceback from the depths, no hang."""

import dataclasses
import io
import json
import math
import zipfile

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fixation_gym import cli
from fixation_gym.envs.config import Scenario, resolve_scenario
from fixation_gym.envs.pick_env import FixationPickEnv
from fixation_gym.envs.zfc_env import FixationPickZFC
from fixation_gym.errors import UsageError
from fixation_gym.geometry.camera import Intrinsics
from fixation_gym.perception.pipeline import Perception
from fixation_gym.types import Observation
from fixation_policies.rl.agent_file import AgentCard, read_card
from fixation_policies.rl.config import CONFIGS

settings.register_profile(
    "same every time",
    derandomize=True,
    database=None,
    deadline=None,
    max_examples=60,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)
settings.load_profile("same every time")

NUMBERS = st.one_of(st.integers(-3, 3), st.integers(), st.floats(), st.sampled_from([2047, 2048, 2049, True, 1e308]))
JUNK = st.one_of(
    st.none(),
    NUMBERS,
    st.text(max_size=8),
    st.lists(st.one_of(NUMBERS, st.text(max_size=4)), max_size=4),
    st.dictionaries(st.one_of(st.text(max_size=4), st.integers()), NUMBERS, max_size=2),
)


def works_or_says(error_type, make):
    """The result; None if one line with words in it says what is wrong."""
    try:
        return make()
    except error_type as error:
        sentence = str(error)
        assert len(sentence.splitlines()) == 1, sentence
        assert len(sentence.split()) > 3, sentence
        return None


def changed(good, junk=JUNK):
    """The fields of a good value, some of them replaced by junk."""
    fields = st.dictionaries(st.sampled_from(sorted(good)), junk, min_size=1, max_size=3)
    return fields.map(lambda wrong: {**good, **wrong})


SCENARIO = dataclasses.asdict(resolve_scenario("mixed"))
ARGUMENTS = {
    "scenario": "opaque",
    "image_size": (96, 128),
    "sensor_noise": "nominal",
    "control_frequency": 25,
    "render_mode": None,
    "render_view": "front",
    "reward": "dense",
    "reward_weights": {"time_cost": 0.01},
}


@given(st.one_of(changed(SCENARIO), st.dictionaries(st.one_of(st.text(max_size=6), st.integers()), JUNK, max_size=4)))
def test_fields_of_scenarios(values):
    scenario = works_or_says(ValueError, lambda: resolve_scenario(values))
    assert scenario is None or isinstance(scenario, Scenario)


@pytest.mark.parametrize("make", [FixationPickEnv, FixationPickZFC])
@given(values=changed(ARGUMENTS))
def test_arguments_of_environments(make, values):
    env = works_or_says(ValueError, lambda: make(**values))
    assert env is None or env.observation_space.contains(env.observation_space.sample())


COMMANDS = {
    name: kind
    for name, kind in (
        ("demo", cli.Demo),
        ("evaluate", cli.Evaluate),
        ("ablate", cli.Ablate),
        ("ladder", cli.Ladder),
        ("export", cli.Export),
        ("record", cli.Record),
        ("replay", cli.Replay),
        ("report", cli.Report),
        ("train", cli.Train),
        ("compare", cli.Compare),
        ("distance", cli.Distance),
        ("scenarios", cli.Scenarios),
        ("necessity", cli.Necessity),
        ("bench", cli.Bench),
        ("doctor", cli.Doctor),
    )
}
NAMES = st.sampled_from(["clear", "clear,opaque", "servo", "blind", "zfc,blind", "a.zip", "nowhere:Class", "nominal"])
WORDS = st.one_of(
    NAMES,
    NUMBERS.map(str),
    st.text(st.characters(exclude_characters="\0", exclude_categories=[]), max_size=6),
)


@st.composite
def command_lines(draw):
    name = draw(st.sampled_from(sorted(COMMANDS)))
    options = [f"--{field.name.replace('_', '-')}" for field in dataclasses.fields(COMMANDS[name])]
    words = []
    for option in draw(st.lists(st.sampled_from([*options, "--scenario"]), max_size=3)):
        words += [option, *draw(st.lists(WORDS, min_size=0 if draw(st.booleans()) else 1, max_size=2))]
    return [name, *words]


@given(command_lines())
def test_options_of_commands(line):
    command = works_or_says(UsageError, lambda: cli.parse(line))
    if command is not None and hasattr(command, "check"):
        assert works_or_says(UsageError, command.check) is None


@given(changed({"width": 40, "height": 30, "fx": 40.0, "fy": 40.0, "cx": 19.5, "cy": 14.5}))
def test_intrinsics(values):
    camera = works_or_says(ValueError, lambda: Intrinsics(**values))
    if camera is not None and camera.width * camera.height < 1e6:
        assert camera.grid[0].shape == (camera.height, camera.width)
        assert camera.scaled(15, 20).width == 20


@given(st.tuples(NUMBERS, NUMBERS, NUMBERS))
def test_intrinsics_by_the_field_of_view(values):
    camera = works_or_says(ValueError, lambda: Intrinsics.from_fovy(*values))
    assert camera is None or math.isfinite(camera.fx)


def recording(frames=4):
    """Keys and shapes of the recording that example 03 writes."""
    rng = np.random.default_rng(0)
    return {
        "rgb": rng.integers(0, 256, (frames, 48, 64, 3), dtype=np.uint8),
        "target_box": np.tile(np.float32([20, 20, 10, 10]), (frames, 1)),
        "joint_pos": np.zeros((frames, 7), np.float32),
        "joint_vel": np.zeros((frames, 7), np.float32),
        "gripper_width": np.full((frames, 1), 0.08, np.float32),
        "camera_pose": np.tile(np.float32([0.5, 0.0, 0.5, 0.0, 1.0, 0.0, 0.0]), (frames, 1)),
        "camera_twist": np.zeros((frames, 6), np.float32),
        "time": np.arange(frames, dtype=np.float32)[:, None] / 25,
    }


ARRAYS = st.one_of(
    st.tuples(
        st.lists(st.integers(0, 8), max_size=4), st.sampled_from(["f4", "f8", "u1", "i8", "?", "U3", "c8"]), NUMBERS
    ).map(lambda drawn: np.full(drawn[0], 0, "U3") if drawn[1] == "U3" else filled(*drawn)),
    JUNK,
)


def filled(shape, dtype, value):
    """An array of a value, wrapped where the kind does not hold it."""
    with np.errstate(all="ignore"):
        return np.full(shape, float(value) if abs(value) < 1e300 else math.inf).astype(dtype)


PERCEPTION = Perception(Intrinsics.from_fovy(48, 64, 0.8), support_height_m=0.0)


@given(
    values=st.dictionaries(st.sampled_from([*recording(), "mask"]), ARRAYS, min_size=1, max_size=2),
    at=st.integers(0, 3),
)
def test_recordings(values, at):
    good = recording()
    PERCEPTION.reset()
    for frame in range(4):
        row = {key: array[frame] for key, array in good.items()}
        seen = works_or_says(
            ValueError,
            lambda row={**row, **(values if frame == at else {})}: PERCEPTION.update(Observation.from_dict(row)),
        )
        assert seen is None or seen.zfc.cells.shape == (32, 32)


CARD = dataclasses.asdict(AgentCard("zfc", "sac", (96, 128), "mixed", 3, 1000, 9000, {"torch": "2"}))


@given(values=st.one_of(changed(CARD), JUNK), cut=st.one_of(st.none(), st.integers(0, 400)))
def test_agent_cards(values, cut, tmp_path):
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as file:
        file.writestr("agent.json", json.dumps(values))
        file.writestr("actor.npz", b"")
    path = tmp_path / "agent.zip"
    path.write_bytes(packed.getvalue()[:cut])
    card = works_or_says(UsageError, lambda: read_card(path))
    if card is not None:
        assert card.config in CONFIGS
        works_or_says(UsageError, cli.Evaluate(policy=str(path)).check)
