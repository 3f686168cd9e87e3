"""Public recordings by name, from a server on this machine: what arrives, and what is left of what does not."""

import hashlib
import http.server
import re
import sys
import tarfile
import threading
from dataclasses import replace as changed
from functools import partial
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from made_recordings import made_frames, write_layout

from fixation_gym import cli
from fixation_gym.errors import UsageError
from fixation_gym.recordings import public
from fixation_gym.recordings.catalogue import open_recording
from fixation_gym.recordings.public import PUBLIC, PublicRecording, located

NAME = "made-up"


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, format, *args):
        pass


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache" / "fixation-gym"


@pytest.fixture
def served(tmp_path):
    """A recording as an archive on a server, and the folder that the server shows."""
    write_layout(tmp_path / "made" / NAME, made_frames()[:4])
    folder = tmp_path / "served"
    folder.mkdir()
    with tarfile.open(folder / f"{NAME}.tgz", "w:gz") as archive:
        archive.add(tmp_path / "made" / NAME, NAME)
    digest = hashlib.sha256((folder / f"{NAME}.tgz").read_bytes()).hexdigest()
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=str(folder)))
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    source = f"http://127.0.0.1:{server.server_port}/{NAME}.tgz"
    yield PublicRecording(source, "none", "made up", sha256=digest), folder
    server.shutdown()
    thread.join()
    server.server_close()


def test_a_recording_is_downloaded_once_and_kept_without_its_archive(served, cache):
    wanted, folder = served
    place = located(Path(NAME), None, {NAME: wanted})
    assert place == cache / NAME
    assert len(open_recording(place)) == 4
    assert [path.name for path in cache.iterdir()] == [NAME]
    (folder / f"{NAME}.tgz").unlink()  # from now on the server has nothing
    assert located(Path(NAME), None, {NAME: wanted}) == place


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda wanted: changed(wanted, sha256="0" * 64), "hash of downloaded file .* does not match"),
        (lambda wanted: changed(wanted, source=f"{wanted.source}.no"), "404 Client Error"),
        (lambda wanted: changed(wanted, source="http://127.0.0.1:9/a.tgz"), "Connection refused"),
    ],
)
def test_what_does_not_arrive_is_one_sentence_and_leaves_nothing(served, cache, change, message):
    wanted = change(served[0])
    with pytest.raises(UsageError, match=message) as raised:
        located(Path(NAME), None, {NAME: wanted})
    assert "\n" not in str(raised.value)
    assert f"{NAME} cannot be downloaded from {wanted.source}" in str(raised.value)
    assert str(raised.value).endswith("give --data FOLDER")
    assert not any(cache.iterdir())


@pytest.mark.parametrize("content", [b"no archive", None])
def test_an_archive_without_the_recording_leaves_nothing(served, cache, content, tmp_path):
    wanted, folder = served
    archive = folder / f"{NAME}.tgz"
    if content is None:
        with tarfile.open(archive, "w:gz") as files:
            files.add(tmp_path / "made" / NAME, "another")
    else:
        archive.write_bytes(content)
    wanted = changed(wanted, sha256=hashlib.sha256(archive.read_bytes()).hexdigest())
    with pytest.raises(UsageError, match="cannot be downloaded"):
        located(Path(NAME), None, {NAME: wanted})
    assert not any(cache.iterdir())


def test_a_folder_of_data_serves_without_a_network(tmp_path, cache, capsys):
    write_layout(tmp_path / "data" / "dragon")
    given = ["--data", str(tmp_path / "data"), "--out", str(tmp_path / "out")]
    assert cli.main(["replay", "dragon", *given]) == 0
    assert "24 of 24 pictures" in capsys.readouterr().out
    assert cli.main(["replay", "wrist-board", *given]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not cache.exists()


def test_a_path_that_is_there_is_no_name(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "dragon").mkdir()
    assert located(Path("dragon"), None) == Path("dragon")
    assert located(Path("of/my/own"), None) == Path("of/my/own")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["no-such-name"], f"there is no recording no-such-name; public ones can be named: {', '.join(PUBLIC)}"),
        (["dragon"], "no checksum of dragon is known, so it is not downloaded; it comes from https://"),
        (["dragon", "--data", "."], ". has no dragon; it comes from https://github.com/lagadic/visp-images"),
        (["no-such-name", "--data", "."], ". has no no-such-name"),
        (["rgbd_dataset_freiburg1_xyz"], "to download it: pip install 'fixation-gym[fetch]', or get https://cvg.cit"),
    ],
)
def test_what_cannot_be_had_is_one_line(arguments, message, tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "pooch", None)
    monkeypatch.chdir(tmp_path)
    assert cli.main(["replay", *arguments, "--out", "out"]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert not any(tmp_path.iterdir())


def test_the_page_lists_what_can_be_named():
    page = (Path(public.__file__).parents[2] / "docs" / "recordings.md").read_text()
    rows = dict(re.findall(r"^\| `([\w-]+)` \| (.*) \|$", page, re.MULTILINE))
    for name, recording in PUBLIC.items():
        row = rows[name]
        assert recording.licence in row
        assert urlsplit(recording.source).netloc in row
        assert (recording.sha256 is None) == (recording.size_bytes is None)
        if recording.sha256 is not None:
            assert re.fullmatch(r"[0-9a-f]{64}", recording.sha256)
            assert f"{recording.size_bytes / 1e6:.0f} MB" in row
