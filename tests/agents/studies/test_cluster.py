"""Studies on a Ray cluster: a real one of two nodes on this machine."""

import pytest

from agents.files import DONE, ConfigError, run_folder
from agents.studies import cluster
from agents.studies.config import StudyConfig
from agents.studies.study import run_study
from tests.attack.world import LONGER, STUDY, popen, wait_for, write

TWICE = STUDY | {"base": STUDY["base"] | LONGER, "seeds": [0, 1]}


@pytest.mark.parametrize("address", ["127.0.0.1:1", "nowhere", "127.0.0.1:x", ""])
def test_an_address_that_does_not_answer_is_one_line_and_writes_nothing(tmp_path, address):
    pytest.importorskip("ray", reason="needs the dependency group cluster")
    with pytest.raises(ConfigError, match=r"no cluster answers") as error:
        run_study(StudyConfig.model_validate(STUDY), tmp_path / "out", ray=address)
    assert "\n" not in str(error.value)
    assert not (tmp_path / "out").exists()


def test_without_ray_the_group_is_named(monkeypatch):
    def absent(name):
        raise ImportError(f"No module named {name!r}")

    monkeypatch.setattr(cluster.importlib, "import_module", absent)
    with pytest.raises(ConfigError, match="pip install --group cluster"):
        cluster.connect("auto")


@pytest.fixture
def two_nodes():
    """Return a cluster of two nodes of one core, and the second of them."""
    pytest.importorskip("ray", reason="needs the dependency group cluster")
    from ray.cluster_utils import Cluster

    nodes = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
    second = nodes.add_node(num_cpus=1)
    yield nodes, second
    nodes.shutdown()


def test_a_node_that_is_lost_costs_nothing(tmp_path, two_nodes):
    """Four runs on two nodes, one of which is killed: all complete, as in the pool."""
    nodes, second = two_nodes
    path, out = write(tmp_path / "study.yaml", TWICE), tmp_path / "out"
    command = ("study", "--config", path, "--out", out, "--ray", nodes.address)
    with popen(*command) as process:
        wait_for(lambda: len(list(out.glob("*/*/checkpoint/step_*"))) >= 2, process=process)
        nodes.remove_node(second, allow_graceful=False)
        output, error = process.communicate(timeout=300)
    assert process.returncode == 0, (output, error)
    assert "continuing it (1 of 3 times)" in output
    assert f"study {out}: complete" in output
    assert error == ""
    study = StudyConfig.model_validate(TWICE)
    assert run_study(study, tmp_path / "pool", 2) == {"done": 4}
    for run in study.runs():
        ours, theirs = (run_folder(tmp_path / name, run.name, run.seed) for name in ("out", "pool"))
        assert (ours / "evals.npz").read_bytes() == (theirs / "evals.npz").read_bytes()
        assert (ours / DONE).exists()


def test_a_study_that_is_stopped_leaves_the_cluster_idle_and_continues(tmp_path, two_nodes):
    nodes, _ = two_nodes
    path, out = write(tmp_path / "study.yaml", TWICE), tmp_path / "out"
    command = ("study", "--config", path, "--out", out, "--ray", nodes.address)
    with popen(*command) as process:
        wait_for(lambda: list(out.glob("*/*/checkpoint/step_*")), process=process)
        process.terminate()
        _, error = process.communicate(timeout=30)
    assert process.returncode == 143
    assert error.splitlines() == ["stopped; the same command continues from the last checkpoint"]
    with popen(*command) as process:
        output, error = process.communicate(timeout=300)
    assert process.returncode == 0, (output, error)
    assert not list(out.rglob("FAILED"))
    assert len(list(out.glob("*/*/DONE"))) == 4
