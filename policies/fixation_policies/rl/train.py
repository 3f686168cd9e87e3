"""Training on Stable-Baselines3: in worker processes, resumable, with an evaluation curve."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import torch
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.vec_env import VecEnv
from tqdm import tqdm

from fixation_gym.doctor import installed_versions
from fixation_gym.errors import UsageError
from fixation_gym.evaluation.files import write_json
from fixation_gym.evaluation.source import source_commit
from fixation_gym.evaluation.storage import RUN_FILE, SUMMARY_FILE, check_same_run, folder_lock, make_folder
from fixation_policies.rl.agent_file import AgentCard, write_agent
from fixation_policies.rl.checkpoints import Progress, latest_checkpoint, load_model, read_progress, save_checkpoint
from fixation_policies.rl.config import BEST_FILE, FINAL_FILE, TrainConfig
from fixation_policies.rl.environments import closing, draw_new_scenes, start_workers, worker_deaths
from fixation_policies.rl.hyperparameters import settings_of
from fixation_policies.rl.network import Weights, acting_weights
from fixation_policies.rl.overlap import BusyEnvs, learn_meanwhile
from fixation_policies.rl.validation import validate
from fixation_policies.rl.watch import Watch

TENSORBOARD_FOLDER = "tensorboard"
_KINDS: dict[str, type[BaseAlgorithm]] = {"sac": SAC, "ppo": PPO}


def train(config: TrainConfig, out: Path, resume: bool = False) -> dict[str, Any]:
    """Train an agent, or go on with a run that was killed.

    Args:
        config: must have passed ``check``.
        out: folder; made if needed.
        resume: whether to go on with the run in that folder.

    Returns:
        The summary, as in ``summary.json``.

    Raises:
        UsageError: if the folder cannot be used, holds another run, the disk is full, or a worker process died.
    """
    if resume and not out.exists():
        raise _nothing_to_resume(out)
    make_folder(out)
    with folder_lock(out), _writing(out):
        checkpoint = _check_folder(config, out, resume)
        progress = Progress() if checkpoint is None else read_progress(checkpoint)
        _check_steps(config, out, progress)
        write_json(out / RUN_FILE, config.identity())
        with worker_deaths(lambda: _advice(out)):
            if progress.decisions < config.steps:
                _learn(config, out, checkpoint, progress)
        summary = summary_of(config, progress)
        write_json(out / SUMMARY_FILE, summary)
    return summary


def summary_of(config: TrainConfig, progress: Progress) -> dict[str, Any]:
    """The content of ``summary.json``."""
    return {
        **config.identity(),
        "decisions": progress.decisions,
        "env_steps": progress.env_steps,
        "wall_s": progress.wall_s,
        "seconds": progress.seconds,
        "curve": progress.curve,
        "best": max(progress.curve, key=rank, default=None),
        "final": progress.curve[-1] if progress.curve else None,
        "versions": installed_versions(),
        "commit": source_commit(),
    }


def make_model(config: TrainConfig, envs: VecEnv, out: Path | None) -> BaseAlgorithm:
    """A new SB3 model with this project's settings; TensorBoard logs go to ``out``."""
    log = None if out is None else str(out / TENSORBOARD_FOLDER)
    settings = settings_of(config.algorithm, config.learner)
    if config.algorithm == "ppo":
        return PPO("MultiInputPolicy", envs, seed=config.seed, tensorboard_log=log, device="cpu", **settings)
    return SAC(
        "MultiInputPolicy",
        envs,
        seed=config.seed,
        tensorboard_log=log,
        device="cpu",
        buffer_size=config.buffer_size,
        learning_starts=config.learning_starts,
        **settings,
    )


def agent_weights(config: TrainConfig, model: BaseAlgorithm) -> Weights:
    """What acting needs of a model."""
    weights = (model.actor if isinstance(model, SAC) else model.policy).state_dict()
    return acting_weights(config.algorithm, config.learner, {name: value.numpy() for name, value in weights.items()})


def _learn(config: TrainConfig, out: Path, checkpoint: Path | None, progress: Progress) -> None:
    torch.set_num_threads(1)
    with closing(start_workers(config)) as envs, _bar(config, progress) as bar:
        busy = BusyEnvs(envs)
        if checkpoint is None:
            model = make_model(config, busy, out)
        else:
            model = load_model(checkpoint, _KINDS[config.algorithm], env=busy, device="cpu")

        def save() -> None:
            save_checkpoint(out, model, progress)

        watch = Watch(busy, progress, bar, save, 60.0 * config.checkpoint_minutes)
        while progress.decisions < config.steps:
            # In pieces, so that one set of worker processes serves learning and evaluation.
            draw_new_scenes(envs, config, progress.decisions)
            model.set_env(busy, force_reset=True)
            if isinstance(model, SAC):
                learn_meanwhile(model, busy, config.gradient_steps * config.workers)
            piece = min(config.eval_every - progress.decisions % config.eval_every, config.steps - progress.decisions)
            model.learn(piece, callback=watch, reset_num_timesteps=False, tb_log_name="run")
            busy.meanwhile = None
            _evaluate(config, out, model, envs, progress)
            # Before the checkpoint: a run that has its last one has an agent, too.
            write_agent(out / FINAL_FILE, card_of(config, progress), agent_weights(config, model))
            save()


def _bar(config: TrainConfig, progress: Progress) -> tqdm:
    return tqdm(total=config.steps, initial=progress.decisions, unit="decision", dynamic_ncols=True)


def _evaluate(config: TrainConfig, out: Path, model: BaseAlgorithm, envs: VecEnv, progress: Progress) -> None:
    """Add to the curve, and keep the agent if it is the best so far."""
    started = time.monotonic()
    measures = validate(lambda inputs: model.predict(inputs, deterministic=True)[0], envs, config.eval_episodes)
    entry = {
        "decisions": progress.decisions,
        "env_steps": progress.env_steps,
        "wall_s": progress.wall_s,
        **measures,
    }
    if all(rank(entry) > rank(earlier) for earlier in progress.curve):
        write_agent(out / BEST_FILE, card_of(config, progress), agent_weights(config, model))
    progress.curve.append(entry)
    progress.spend("evaluating", time.monotonic() - started)
    for name, value in measures.items():
        model.logger.record(f"eval/{name}", value)
    model.logger.dump(progress.decisions)
    tqdm.write(
        f"{progress.decisions} decisions, {entry['wall_s'] / 60:.1f} min: success {measures['success']:.2f}, "
        f"without collision {measures['collision_free']:.2f}, return {measures['return']:.2f}"
    )


def rank(entry: dict[str, Any]) -> tuple[float, float, float]:
    """Order of evaluations: by success without collision, then any success, then return."""
    return entry["collision_free"], entry["success"], entry["return"]


def card_of(config: TrainConfig, progress: Progress) -> AgentCard:
    """What an agent of this run is, now."""
    return AgentCard(
        config=config.config,
        algorithm=config.algorithm,
        image_size=config.image_size,
        scenario=config.scenario,
        seed=config.seed,
        decisions=progress.decisions,
        env_steps=progress.env_steps,
        versions=installed_versions(),
    )


def _check_folder(config: TrainConfig, out: Path, resume: bool) -> Path | None:
    """The checkpoint to go on from; None to begin.

    Raises:
        UsageError: if the folder holds another run, or one that was not asked to be resumed.
    """
    path, checkpoint = out / RUN_FILE, latest_checkpoint(out)
    if not path.exists():
        if checkpoint is not None:
            raise UsageError(f"{out} has {checkpoint.name} but no {RUN_FILE}; choose another --out")
        if resume:
            raise _nothing_to_resume(out)
        return None
    check_same_run(path, config.identity())
    if not resume:
        raise UsageError(f"{out} holds a training run; add --resume to go on with it, or choose another --out")
    return checkpoint


def _nothing_to_resume(out: Path) -> UsageError:
    return UsageError(f"{out} holds no training run to resume; leave out --resume to start one")


def _check_steps(config: TrainConfig, out: Path, progress: Progress) -> None:
    """Check that a run has not gone beyond the steps that are asked for, since its last evaluation.

    Raises:
        UsageError: if so; agents are written and rated at evaluations only.
    """
    evaluated = progress.curve[-1]["decisions"] if progress.curve else 0
    if config.steps <= progress.decisions != evaluated:
        raise UsageError(f"{out} has {progress.decisions} decisions already; --steps must be above that")


@contextlib.contextmanager
def _writing(out: Path) -> Iterator[None]:
    """Report what cannot be written, for lack of space or permission, as an error of use."""
    try:
        yield
    except OSError as error:
        raise UsageError(f"cannot write to {out} ({error.strerror or error}); {_advice(out)}") from error


def _advice(out: Path) -> str:
    checkpoint = latest_checkpoint(out)
    if checkpoint is None:
        return "there is no checkpoint yet"
    return f"`train --resume`, or the same `compare` again, goes on from {checkpoint.name}"
