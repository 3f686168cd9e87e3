"""Agent files: what is written is read; anything else is refused in one line."""

import io
import json
import os
import zipfile
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

from fixation_gym.cli import main
from fixation_gym.errors import UsageError
from fixation_policies import agents
from fixation_policies.catalogue import check_policy, needed_environment
from fixation_policies.rl.agent_file import AgentCard, read_agent, read_card, write_agent
from fixation_policies.rl.config import CONFIGS
from fixation_policies.rl.network import weight_shapes

CARD = AgentCard("zfc", "sac", (96, 128), "mixed", 3, 1000, 9000, {"torch": "2"})
SHAPES = weight_shapes("sac", CONFIGS["zfc"], 4)
WEIGHTS = {name: np.random.default_rng(0).normal(size=shape).astype(np.float32) for name, shape in SHAPES.items()}


@pytest.fixture
def agent(tmp_path):
    path = tmp_path / "agent.zip"
    write_agent(path, CARD, WEIGHTS)
    return path


def rewrite(path, **members):
    with zipfile.ZipFile(path) as file:
        old = {name: file.read(name) for name in file.namelist()}
    with zipfile.ZipFile(path, "w") as file:
        for name, data in {**old, **members}.items():
            file.writestr(name, data)


def test_what_is_written_is_read(agent):
    card, weights = read_agent(agent)
    assert card == read_card(agent) == CARD
    assert set(weights) == set(WEIGHTS)
    assert all(np.array_equal(weights[name], WEIGHTS[name]) for name in WEIGHTS)
    assert os.listdir(agent.parent) == ["agent.zip"]


def test_an_agent_acts_where_it_was_trained(agent):
    place = needed_environment(str(agent))
    assert place.env_id.endswith("FixationPickZFC-v0")
    assert place.arguments == {"observation": "zfc"}
    assert place.image_size == (96, 128)
    assert needed_environment("servo").env_id.endswith("FixationPick-v0")


def damage_nothing_there(path):
    path.unlink()


def damage_truncated(path):
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def damage_no_zip(path):
    path.write_text("weights")


def damage_foreign(path):
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("data", "{}")
        file.writestr("policy.npz", b"")


def damage_other_version(path):
    with zipfile.ZipFile(path) as file:
        card = json.loads(file.read("agent.json"))
    rewrite(path, **{"agent.json": json.dumps({**card, "format": 99})})


def damage_flipped(path):
    data = bytearray(path.read_bytes())
    with zipfile.ZipFile(path) as file:
        begin = file.getinfo("actor.npz").header_offset + 50
    data[begin : begin + 40] = bytes(byte ^ 0xFF for byte in data[begin : begin + 40])
    path.write_bytes(data)


def damage_names(path):
    rewrite(path, **{"agent.json": json.dumps({**asdict(CARD), "config": ["zfc"]})})


def damage_size(path):
    rewrite(path, **{"agent.json": json.dumps({**asdict(CARD), "image_size": ["96", "128"]})})


def damage_card(path):
    rewrite(path, **{"agent.json": '{"config": "zfc"}'})


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (damage_nothing_there, "No such file"),
        (damage_truncated, "is damaged or no agent"),
        (damage_no_zip, "is damaged or no agent"),
        (damage_foreign, "no agent: `fixation-gym train` writes those"),
        (damage_other_version, "agent of another version"),
        (damage_card, "is damaged or no agent"),
        (damage_names, "is damaged or no agent"),
        (damage_size, "is damaged or no agent"),
        (damage_flipped, "is damaged or no agent"),
    ],
)
def test_evaluate_says_in_one_line_what_is_wrong_with_a_file(agent, damage, message, capsys, tmp_path):
    damage(agent)
    assert main(["evaluate", "--policy", str(agent), "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert len(error.splitlines()) == 1
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "change", [{"mu.bias": np.zeros(5, np.float32)}, {"mu.bias": None}, {"mu.bias": np.array(["a"] * 4)}]
)
def test_weights_of_another_network_are_refused(agent, change):
    weights = {name: array for name, array in {**WEIGHTS, **change}.items() if array is not None}
    write_agent(agent, CARD, weights)
    with pytest.raises(UsageError, match="does not hold the weights of a sac agent; train it again"):
        check_policy(str(agent))  # before any environment is built


def test_a_single_array_is_no_agent(agent):
    array = io.BytesIO()
    np.save(array, np.zeros(3))
    rewrite(agent, **{"actor.npz": array.getvalue()})
    with pytest.raises(UsageError, match="is damaged or no agent"):
        read_agent(agent)


def test_a_file_of_format_1_has_the_weights_of_pytorch(agent):
    import torch

    with zipfile.ZipFile(agent) as file:
        card = json.loads(file.read("agent.json"))
    packed = io.BytesIO()
    torch.save({name: torch.tensor(array) for name, array in WEIGHTS.items()}, packed)
    with zipfile.ZipFile(agent, "w") as file:
        file.writestr("agent.json", json.dumps({**card, "format": 1}))
        file.writestr("actor.pth", packed.getvalue())
    _, weights = read_agent(agent)
    assert all(np.array_equal(weights[name], WEIGHTS[name]) for name in WEIGHTS)


class Evil:
    def __reduce__(self):
        return (os.mkdir, ("executed",))


def test_weights_cannot_execute_anything(agent, monkeypatch):
    monkeypatch.chdir(agent.parent)
    buffer = io.BytesIO()
    np.savez(buffer, allow_pickle=True, **{**WEIGHTS, "mu.bias": np.array([Evil()] * 4, object)})
    rewrite(agent, **{"actor.npz": buffer.getvalue()})
    with pytest.raises(UsageError, match="damaged"):
        read_agent(agent)
    assert not (agent.parent / "executed").exists()


SHIPPED = sorted(Path(agents.__file__).parent.glob("*.zip"))


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_an_agent_that_comes_with_the_package_is_small_and_described_by_its_card(path):
    card, weights = read_agent(path)
    assert weights
    assert path.stem.startswith(card.config)
    assert path.stat().st_size < 2_000_000
    about = path.with_name("README.md").read_text()
    (line,) = (line for line in about.splitlines() if line.startswith(f"| `{path.name}` |"))
    assert f"`{card.scenario}`, seed {card.seed}, {card.decisions} decisions" in line
