"""A training run in the simulator: killed, resumed, and its agent evaluated."""

import hashlib
import json
from dataclasses import replace

import numpy as np
import pytest
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from fixation_gym.cli import main
from fixation_gym.errors import UsageError
from fixation_gym.evaluation.config import EvaluationConfig
from fixation_gym.evaluation.evaluate import evaluate
from fixation_policies.rl import train as training
from fixation_policies.rl.agent_file import read_agent, read_card
from fixation_policies.rl.checkpoints import latest_checkpoint, load_model
from fixation_policies.rl.compare import CompareConfig, compare
from fixation_policies.rl.config import BEST_FILE, FINAL_FILE, TrainConfig
from fixation_policies.rl.train import TENSORBOARD_FOLDER, train

pytestmark = pytest.mark.sim
SHORT = TrainConfig(
    scenario="clear",
    steps=24,
    workers=2,
    image_size=(48, 64),
    eval_every=12,
    eval_episodes=2,
    learning_starts=8,
    buffer_size=100,
)


@pytest.fixture(scope="module")
def killed_and_resumed(tmp_path_factory):
    """A run that was killed after its first evaluation, and its folder."""
    folder = tmp_path_factory.mktemp("run")
    save = training.save_checkpoint

    def save_and_die(*arguments):
        save(*arguments)
        raise EOFError  # what a dead worker looks like

    training.save_checkpoint = save_and_die
    try:
        with pytest.raises(UsageError, match=r"a worker process ended.*--resume`.* goes on from checkpoint-0000000012"):
            train(SHORT, folder)
    finally:
        training.save_checkpoint = save
    assert (folder / FINAL_FILE).exists()  # written before the checkpoint: a run that ends here would need no resume
    return train(SHORT, folder, resume=True), folder


def test_a_resumed_run_has_the_whole_curve(killed_and_resumed):
    summary, folder = killed_and_resumed
    assert json.loads((folder / "summary.json").read_text()) == summary
    assert [entry["decisions"] for entry in summary["curve"]] == [12, 24]
    steps = [entry["env_steps"] for entry in summary["curve"]]
    assert 12 <= steps[0] < steps[1] == summary["env_steps"]
    assert all(0.0 <= entry["collision_free"] <= entry["success"] <= 1.0 for entry in summary["curve"])
    assert summary["wall_s"] == pytest.approx(sum(summary["seconds"].values()))


def test_a_resumed_run_kept_its_replay_buffer(killed_and_resumed):
    _, folder = killed_and_resumed
    checkpoint = latest_checkpoint(folder)
    replay = load_model(checkpoint, training.SAC).replay_buffer
    assert replay.pos == 24 // SHORT.workers
    assert np.unique(replay.rewards[: replay.pos]).size > 12  # what was collected before and after


def test_a_finished_run_is_not_trained_again(killed_and_resumed):
    summary, folder = killed_and_resumed
    assert train(SHORT, folder, resume=True)["curve"] == summary["curve"]


def test_the_best_agent_is_the_first_of_the_best_evaluation(killed_and_resumed):
    summary, folder = killed_and_resumed
    assert summary["best"] == max(summary["curve"], key=training.rank)
    assert read_card(folder / BEST_FILE).decisions == summary["best"]["decisions"]
    assert read_card(folder / FINAL_FILE).decisions == 24


def test_tensorboard_has_the_evaluations(killed_and_resumed):
    summary, folder = killed_and_resumed
    logs = EventAccumulator(str(folder / TENSORBOARD_FOLDER / "run_0"))
    logs.Reload()
    logged = [(event.step, event.value) for event in logs.Scalars("eval/return")]
    assert logged == [(entry["decisions"], pytest.approx(entry["return"])) for entry in summary["curve"]]


def test_its_agent_is_evaluated_and_acts_as_the_model(killed_and_resumed, tmp_path, capsys):
    _, folder = killed_and_resumed
    agent = str(folder / FINAL_FILE)
    arguments = ["evaluate", "--policy", agent, "--scenario", "clear", "--episodes", "1", "--out", str(tmp_path)]
    assert main(arguments) == 0
    assert "clear" in capsys.readouterr().out
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["image_size"] == list(SHORT.image_size)
    assert 0.0 < summary["scenarios"]["clear"]["mean_time_s"] <= 25.0
    assert summary["scenarios"]["clear"]["distance_mae_m"] is not None
    # The same file name with other weights is another policy.
    other = replace(SHORT, seed=1)
    weights = {name: 0.5 * values for name, values in read_agent(folder / FINAL_FILE)[1].items()}
    training.write_agent(folder / FINAL_FILE, training.card_of(other, training.Progress()), weights)
    assert main(arguments) == 2
    assert "holds another run, with policy_sha256" in capsys.readouterr().err


@pytest.mark.parametrize("config", ["ways", "privileged", "rgb_augmented", "depth"])
def test_other_configurations_train_and_their_agents_act(config, tmp_path):
    short = replace(SHORT, config=config, steps=12, workers=1, learning_starts=4)
    summary = train(short, tmp_path / "run")
    assert [entry["decisions"] for entry in summary["curve"]] == [12]
    agent = str(tmp_path / "run" / FINAL_FILE)
    test = EvaluationConfig(agent, scenarios=("clear",), episodes=1, image_size=(48, 64))
    assert evaluate(test, tmp_path / "test")["scenarios"]["clear"]["episodes"] == 1


def test_a_comparison_trains_and_tests_its_own_agent_and_the_servo(tmp_path):
    short = replace(SHORT, steps=12, workers=1, learning_starts=4)
    config = CompareConfig(configs=("blind",), seeds=1, training=short, scenarios=("clear",), episodes=1)
    summary = compare(config, tmp_path)
    servo, blind = summary["runs"]
    assert (servo["config"], servo["curve"], servo["scenarios"]["clear"]["successes"]) == ("servo", [], 1)
    assert (blind["config"], [entry["decisions"] for entry in blind["curve"]]) == ("blind", [12])
    assert blind["scenarios"]["clear"]["episodes"] == 1
    tested = json.loads((tmp_path / "runs" / "blind-0" / "test" / "run.json").read_text())
    assert (
        tested["policy_sha256"] == hashlib.sha256((tmp_path / "runs" / "blind-0" / FINAL_FILE).read_bytes()).hexdigest()
    )
