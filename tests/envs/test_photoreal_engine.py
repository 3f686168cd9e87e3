"""Which variant of Mitsuba is chosen, and what is said where there is none."""

import importlib.util

import pytest

from fixation_gym.cli import main
from fixation_gym.envs.photoreal import engine
from fixation_gym.envs.pick_env import FixationPickEnv
from fixation_gym.envs.zfc_env import FixationPickZFC
from fixation_gym.errors import UsageError


@pytest.fixture(autouse=True)
def nothing_chosen(monkeypatch):
    for name in (engine.VARIANT, "FIXATION_GYM_MITSUBA_CHECKED"):
        monkeypatch.setenv(name, "")  # so that what the test leaves there goes when it ends
        monkeypatch.delenv(name)


def test_missing_mitsuba_names_the_extra(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(UsageError, match=r"not installed; pip install 'fixation-gym\[photoreal\]'$"):
        engine.load()


def test_unknown_variant_says_what_is_allowed(monkeypatch):
    monkeypatch.setattr(engine, "is_installed", lambda: True)
    monkeypatch.setenv(engine.VARIANT, "cuda_ad_rgb")
    with pytest.raises(UsageError, match="must be llvm_ad_rgb or scalar_rgb, got 'cuda_ad_rgb'"):
        engine.choose_variant()


def test_llvm_is_chosen_where_it_works_and_asked_once(monkeypatch):
    asked = []
    monkeypatch.setattr(engine, "is_installed", lambda: True)
    monkeypatch.setattr(engine, "why_no_llvm", lambda: asked.append(1) or "")
    assert [engine.choose_variant(), engine.choose_variant()] == [engine.LLVM, engine.LLVM]
    assert len(asked) == 1


def test_scalar_variant_is_taken_without_an_llvm_library(monkeypatch, tmp_path):
    pytest.importorskip("mitsuba")
    pytest.importorskip("pyoidn")
    monkeypatch.setenv("DRJIT_LIBLLVM_PATH", str(tmp_path / "libLLVM.so"))
    assert "libllvm19" in engine.why_no_llvm()
    assert engine.choose_variant() == engine.SCALAR
    monkeypatch.setenv(engine.VARIANT, engine.LLVM)
    with pytest.raises(UsageError, match="FIXATION_GYM_MITSUBA=llvm_ad_rgb does not work here"):
        engine.choose_variant()


def test_reasons_are_told_with_the_choice(monkeypatch):
    monkeypatch.setattr(engine, "is_installed", lambda: True)
    monkeypatch.setattr(engine, "why_no_llvm", lambda: "it is too old")
    assert engine.explain_choice() == "scalar_rgb, for llvm_ad_rgb does not work: it is too old"
    monkeypatch.setenv(engine.VARIANT, engine.SCALAR)
    assert engine.explain_choice() == "scalar_rgb, as FIXATION_GYM_MITSUBA says"
    monkeypatch.setenv(engine.VARIANT, engine.LLVM)
    assert engine.explain_choice() == "FIXATION_GYM_MITSUBA=llvm_ad_rgb does not work here: it is too old"


@pytest.mark.parametrize("make", [FixationPickEnv, FixationPickZFC])
def test_environments_say_which_renderers_there_are_and_what_is_missing(make, monkeypatch):
    with pytest.raises(ValueError, match="unknown renderer 'blender'; choose one of mujoco, mitsuba"):
        make(renderer="blender")
    monkeypatch.setattr(engine, "is_installed", lambda: False)
    with pytest.raises(ValueError, match=r"not installed; pip install 'fixation-gym\[photoreal\]'"):
        make(renderer="mitsuba")


def test_command_line_says_so_too(monkeypatch, capsys):
    assert main(["evaluate", "--renderer", "blender"]) == 2
    assert "unknown renderer 'blender'; choose one of mujoco, mitsuba" in capsys.readouterr().err
    monkeypatch.setattr(engine, "is_installed", lambda: False)
    assert main(["evaluate", "--renderer", "mitsuba"]) == 2
    assert "pip install 'fixation-gym[photoreal]'" in capsys.readouterr().err
