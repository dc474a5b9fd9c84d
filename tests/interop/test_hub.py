"""Upload: the plan needs nothing, bad input gets a line, and a hub gets the manifest's files."""

from __future__ import annotations

import importlib.machinery
import os
import subprocess
import sys
import types

import pytest
from fake_hub import FakeHub, serving

from internav_data.dataset import read_manifest
from internav_data.interop import plan_upload, upload
from internav_data.records.errors import CorruptDataError, UsageError


def cli(*words, **env):
    code = "from internav_cli.main import main; main()"
    return subprocess.run(
        [sys.executable, "-c", code, "upload", *map(str, words)], capture_output=True, text=True,
        check=False, stdin=subprocess.DEVNULL, env=os.environ | env,
    )  # fmt: skip


def one_line(done, code, *words):
    lines = [line for line in done.stderr.splitlines() if not line.startswith("dataset: ")]
    assert (done.returncode, len(lines)) == (code, 1), done.stderr
    for word in words:
        assert word in lines[0]


@pytest.fixture
def stand_in(monkeypatch):
    """huggingface_hub as a module that writes down what is asked of it."""
    module = types.ModuleType("huggingface_hub")
    module.__spec__ = importlib.machinery.ModuleSpec("huggingface_hub", None)
    module.asked = []

    class HfApi:
        def __init__(self, endpoint):
            module.asked.append(("endpoint", endpoint))

        def create_repo(self, name, **arguments):
            module.asked.append(("create", name, arguments))

        def upload_folder(self, **arguments):
            module.asked.append(("upload", arguments))

    module.HfApi, module.get_token = HfApi, lambda: "hf_token"
    monkeypatch.setitem(sys.modules, "huggingface_hub", module)
    monkeypatch.delenv("HF_ENDPOINT", raising=False)
    return module


def test_the_plan_names_the_files_of_the_manifest_and_no_others(shipped):
    (shipped / "notes.txt").write_text("mine")
    (shipped / ".work").mkdir()
    (shipped / ".work" / "left").write_text("over")
    plan = plan_upload(shipped, "me/houses")
    assert set(plan.files) == read_manifest(shipped).paths()
    assert plan.bytes == sum((shipped / name).stat().st_size for name in plan.files)
    for words in ("https://huggingface.co/datasets/me/houses", "data/ (7)", "made public"):
        assert words in plan.summary()


def test_a_dataset_of_an_earlier_release_goes_with_its_card():
    from pathlib import Path

    old = Path(__file__).parents[1] / "data" / "dataset-10"
    assert {"README.md", "manifest.json"} <= set(plan_upload(old, "me/houses").files)


def test_an_upload_is_one_commit_of_these_files(shipped, stand_in):
    plan = plan_upload(shipped, "me/houses", private=True, message="mine")
    assert upload(plan) == "https://huggingface.co/datasets/me/houses"
    (_, endpoint), (_, name, made), (_, sent) = stand_in.asked
    assert (endpoint, name) == ("https://huggingface.co", "me/houses")
    assert made == {"repo_type": "dataset", "private": True, "exist_ok": True}
    assert sent["allow_patterns"] == list(plan.files)
    assert (sent["commit_message"], sent["folder_path"]) == ("mine", str(shipped))


def test_a_hub_without_a_token_gets_nothing(shipped, stand_in):
    stand_in.get_token = lambda: None
    with pytest.raises(UsageError, match="HF_TOKEN"):
        upload(plan_upload(shipped, "me/houses"))
    assert not stand_in.asked


def test_a_hub_that_is_not_there_is_a_line_and_a_bug_is_not(shipped, stand_in, monkeypatch):
    def fail(error):
        def create_repo(*_, **__):
            raise error

        monkeypatch.setattr(stand_in.HfApi, "create_repo", create_repo)

    plan = plan_upload(shipped, "me/houses")
    fail(ConnectionError("no route\nto host"))
    with pytest.raises(UsageError, match="did not take me/houses: no route to host"):
        upload(plan)
    fail(KeyError("ours"))
    with pytest.raises(KeyError):
        upload(plan)


def test_damaged_files_are_not_spread(shipped):
    (shipped / "README.md").write_text("edited")
    with pytest.raises(CorruptDataError, match=r"README\.md: edited or damaged"):
        plan_upload(shipped, "me/houses")
    (shipped / "README.md").unlink()
    with pytest.raises(CorruptDataError, match=r"README\.md"):
        plan_upload(shipped, "me/houses")


def test_bad_input_gets_a_line_each(tmp_path):
    one_line(cli("mini", "--to", "houses"), 2, "'houses'", "USER/NAME")
    one_line(cli(tmp_path / "none", "--to", "me/houses"), 5, "none")
    one_line(cli("mini", "--to", "me/houses"), 2, "nothing was sent", "--yes")
    one_line(cli("mini"), 2, "--to")


def test_a_dry_run_prints_the_plan_alone():
    done = cli("mini", "--to", "me/houses", "--dry-run", HF_ENDPOINT="http://127.0.0.1:9")
    assert done.returncode == 0, done.stderr
    assert "to       http://127.0.0.1:9/datasets/me/houses" in done.stdout


def test_without_huggingface_hub_a_line_names_the_extra(tmp_path):
    (tmp_path / "sitecustomize.py").write_text(
        "import importlib.util\nfound = importlib.util.find_spec\n"
        "importlib.util.find_spec = lambda name, *a: "
        "None if name == 'huggingface_hub' else found(name, *a)\n"
    )
    path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
    done = cli("mini", "--to", "me/houses", "--yes", PYTHONPATH=path)
    one_line(done, 1, "huggingface_hub is missing: pip install 'internav-data[hub]'")


class TestRealLibrary:
    """huggingface_hub itself, against a hub of this process."""

    @pytest.fixture
    def hub(self, tmp_path):
        pytest.importorskip("huggingface_hub")
        hub = FakeHub()
        with serving(hub) as address:
            self.env = {
                "HF_ENDPOINT": address,
                "HF_TOKEN": "hf_token",
                "HF_HOME": str(tmp_path / "home"),
                "HF_HUB_DISABLE_XET": "1",
                "NO_PROXY": "127.0.0.1",
            }
            yield hub

    def test_the_hub_has_the_dataset_afterwards(self, hub, shipped):
        hub.files["data/episodes/train-00000-00000000.parquet"] = b"of an earlier upload"
        hub.files["notes.txt"] = b"somebody's"
        done = cli(shipped, "--to", "me/houses", "--yes", **self.env)
        assert done.returncode == 0, done.stderr
        names = read_manifest(shipped).paths()
        assert hub.files.keys() - {".gitattributes"} == names | {"notes.txt"}
        for name in names:
            assert hub.files[name] == (shipped / name).read_bytes()
        assert hub.made[0]["type"] == "dataset"
        assert len(hub.commits) == 1
        assert " episodes in 40 scenes" in hub.commits[0]

    def test_a_refusal_is_a_line(self, hub, shipped):
        hub.refuses = True
        done = cli(shipped, "--to", "me/houses", "--yes", **self.env)
        one_line(done, 2, "did not take me/houses", "token")

    def test_without_a_token(self, hub, shipped):
        done = cli(shipped, "--to", "me/houses", "--yes", **self.env | {"HF_TOKEN": ""})
        one_line(done, 2, "no token of the hub")
        assert not hub.requests
