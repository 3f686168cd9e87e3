"""Robosuite's part of the model is kept in a cache folder: the same model, with or without the folder."""

import mujoco
import numpy as np
import pytest

from fixation_gym.envs import robosuite_backend, task_mjcf, task_model
from fixation_gym.envs.task_model import compile_model

pytestmark = pytest.mark.sim


def model_bytes(looks: bool) -> bytes:
    model = compile_model(looks=looks).model
    buffer = np.zeros(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, buffer)
    return buffer.tobytes()


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "fixation-gym"


def test_the_model_out_of_the_cache_is_the_one_that_robosuite_builds(folder, monkeypatch):
    built = model_bytes(looks=False)
    assert [file.suffix for file in folder.iterdir()] == [".xml"]
    monkeypatch.setattr(robosuite_backend, "robot_at_table", lambda *_: pytest.fail("robosuite was asked again"))
    assert model_bytes(looks=False) == built


def test_another_robosuite_has_another_file(folder, monkeypatch):
    task_mjcf.build_xml(None, looks=False)
    monkeypatch.setattr(task_mjcf, "version", lambda _: "9.9")
    task_mjcf.build_xml(None, looks=False)
    assert len(list(folder.iterdir())) == 2


def test_a_cache_that_cannot_be_written_is_done_without(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("not a folder")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert "robot0_" in task_mjcf.build_xml(None, looks=False)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_user_without_a_home_has_no_cache(monkeypatch):
    def no_home():
        raise RuntimeError("Could not determine home directory.")

    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(task_mjcf.Path, "home", no_home)
    assert "robot0_" in task_mjcf.build_xml(None, looks=False)


def test_half_a_file_is_written_again(folder):
    whole = task_mjcf.build_xml(None, looks=False)
    (file,) = folder.iterdir()
    file.write_text(file.read_text()[:1000])
    assert task_mjcf.build_xml(None, looks=False) == whole


@pytest.mark.parametrize("looks", [False, True])
def test_only_people_see_the_legs_of_the_table(looks):
    model = compile_model(looks=looks).model
    textures = {model.tex(index).name for index in range(model.ntex)}
    assert ("tex-steel-brushed" in textures) == looks
    assert {"tex_table_wood", "tex-light-gray-plaster"} <= textures


def test_compiling_is_what_mujoco_does_and_leaves_no_files_in_its_cache(monkeypatch):
    ours = model_bytes(looks=False)
    assert mujoco.mj_getCacheSize(mujoco.mj_getCache()) == 0
    monkeypatch.setattr(task_model, "_compiled", mujoco.MjModel.from_xml_string)
    assert model_bytes(looks=False) == ours
    mujoco.mj_clearCache(mujoco.mj_getCache())
