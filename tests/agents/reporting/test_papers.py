"""What a report writes for papers: tables in LaTeX, figures as vectors, the methods paragraph."""

import re
import shutil
import subprocess

import pytest
import yaml

from agents.registration import registration
from agents.reporting.latex import escaped, latex
from agents.reporting.loading import load_study
from agents.reporting.methods import methods
from agents.reporting.report import write_report
from agents.reporting.summary import summarise

EVIL = "\\input{/etc/passwd} 50% of $x_1$ & ~#^"


def test_labels_are_letters_to_latex():
    text = escaped(EVIL)
    assert "\\input" not in text
    plain = re.sub(r"\\textbackslash\{\}|\\text[a-z]+\{\}|\\[&%$#_{}]", "", text)
    assert not set(plain) & set("\\&%$#_{}~^")


def test_a_table_has_as_many_cells_as_columns():
    text = latex([["a", "b & c"], ["1", "2"]])
    assert [len(re.findall(r"(?<!\\)&", line)) for line in text.splitlines()] == [
        0,
        0,
        1,
        0,
        1,
        0,
        0,
    ]


def test_the_report_writes_them(make_study):
    folder = make_study({"n = 3": {"raw": 0.6, "clarke": 1.5}}, 5, title=EVIL)
    page = write_report(folder, reps=20)
    tex = (page.parent / "table.tex").read_text()
    assert tex.count(r"\begin{tabular}") == tex.count(r"\end{tabular}") == 2
    assert "$-$" in tex or "raw" in tex
    svg, pdf = ((page.parent / f"forest.{kind}").read_bytes() for kind in ("svg", "pdf"))
    assert svg.startswith(b"<?xml")
    assert b"<dc:date>" not in svg
    assert pdf.startswith(b"%PDF")
    assert b"CreationDate" not in pdf


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="pdflatex is not installed")
def test_latex_sets_the_tables(make_study, tmp_path):
    folder = make_study({EVIL: {"raw": 0.6, "clarke": 1.5}}, 5)
    page = write_report(folder, reps=20)
    (tmp_path / "paper.tex").write_text(
        "\\documentclass{article}\\usepackage{booktabs}\\begin{document}\n"
        + (page.parent / "table.tex").read_text()
        + "\\end{document}"
    )
    command = ["pdflatex", "-halt-on-error", "paper.tex"]
    subprocess.run(command, cwd=tmp_path, check=True, capture_output=True)
    assert (tmp_path / "paper.pdf").is_file()


def test_the_paragraph_says_what_the_study_knows(make_study):
    folder = make_study({"n = 3": {"raw": 0.6, "clarke": 1.5}}, 5, tuning="none")
    text = methods(summarise(load_study(folder), seed=0, reps=20))
    assert (
        "\u201craw\u201d and \u201cclarke\u201d were compared on n = 3, with 5 seeds an arm" in text
    )
    assert "Hyper-parameters: none." in text
    assert "registered before the runs" not in text


def test_the_paragraph_names_learner_environment_and_registration(make_study):
    base = {
        "algo": {"name": "ppo", "learning_rate": 0.001},
        "env": {"id": "clarke_gym/Reach-v0", "num_envs": 32, "kwargs": {"n_tendons": 7}},
        "evaluation": {"n_goals": 50},
    }
    folder = make_study({"t": {"raw": 1.0}}, 2, base=base)
    data = yaml.safe_load((folder / "study.yaml").read_text())
    found = registration(data)
    (folder / "study.yaml").write_text(yaml.safe_dump(data | {"registered": found}))
    text = methods(summarise(load_study(folder), seed=0, reps=20))
    assert "PPO (learning_rate 0.001) of Stable-Baselines3 on 32 environments" in text
    assert "clarke_gym/Reach-v0 (n_tendons 7)" in text
    assert "50 held-out goals" in text
    assert f"(SHA-256 {found[:12]})" in text


def test_the_paragraph_names_the_library_that_has_the_algorithm(make_study):
    base = {"algo": {"name": "tqc"}, "env": {"id": "clarke_gym/Reach-v0", "num_envs": 2}}
    text = methods(
        summarise(load_study(make_study({"t": {"raw": 1.0}}, 2, base=base)), seed=0, reps=20)
    )
    assert "TQC () of SB3-Contrib" in text
