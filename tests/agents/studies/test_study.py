"""A study around its runs."""

import json

from agents.files import ROOT
from agents.learning.config import load_config
from agents.studies import study
from agents.studies.config import StudyConfig


def test_a_task_that_classical_control_cannot_do_has_no_reference(tmp_path, monkeypatch):
    def refuse(name, env):
        raise ValueError(f"{name} steers the tip to a position")

    monkeypatch.setattr(study, "make_controller", refuse)
    config = load_config(StudyConfig, ROOT / "configs" / "studies" / "quick.yaml")
    study.write_references(config, tmp_path)
    assert json.loads((tmp_path / "references.json").read_text()) == {}
