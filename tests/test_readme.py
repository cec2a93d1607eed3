"""README and pages say what the code does: tables against signatures, numbers against results."""

import inspect
import re
from pathlib import Path

import pytest

from benchmarks.badges import FOLDER, badge, facts
from clarke_gym.envs.config import all_keywords
from clarke_gym.registration import ENVIRONMENTS, make_vector_env
from clarke_gym.representations import representation_names
from clarke_gym.representations.instruments import INSTRUMENTS

ROOT = Path(__file__).resolve().parent.parent
README = (ROOT / "README.md").read_text()
ENVIRONMENTS_PAGE = (ROOT / "docs" / "environments.md").read_text()
BLOCK = re.compile(r"```python\n(.*?)```", flags=re.DOTALL)


def names_in_first_column(page, heading):
    table = page.split(heading)[1].split("\n\n")[0]
    return {
        name for row in table.splitlines() for name in re.findall(r"`(\w+)`", row.split("|")[1])
    }


def test_the_readme_breathes():
    assert len(README.splitlines()) <= 120
    for picture in re.findall(r"docs/media/\S+?\.(?:gif|png)", README):
        assert (ROOT / picture).stat().st_size < 2e6, picture


def test_badges_say_what_the_package_says():
    shown = set(re.findall(r"docs/media/badges/(\w+)\.svg", README))
    assert shown == set(facts())
    for name, says in facts().items():
        assert (FOLDER / f"{name}.svg").read_text() == badge(name, says), name


def test_keyword_table_is_complete():
    said = names_in_first_column(ENVIRONMENTS_PAGE, "| keyword | default | meaning |\n")
    entry = set(inspect.signature(make_vector_env).parameters) - {"keywords"}
    ours = {name for name, owner in all_keywords() if "test_" not in owner}
    assert said == ours | entry


@pytest.mark.parametrize("env_id", ENVIRONMENTS)
def test_every_id_is_named_and_pictured(env_id):
    for page in (README, ENVIRONMENTS_PAGE):
        assert f"`{env_id}`" in page
        if "task" in ENVIRONMENTS[env_id]:
            assert f"media/tasks/{ENVIRONMENTS[env_id]['task']}.png" in page


def test_every_representation_is_named():
    published = [name for name in representation_names() if re.search(r"_20\d\d$", name)]
    assert any(f"`{name}`" in ENVIRONMENTS_PAGE for name in published)
    ours = {name for name in representation_names() if not name.endswith("_doctest")}
    for name in ours - set(published) - set(INSTRUMENTS):
        assert f"`{name}`" in ENVIRONMENTS_PAGE, name
    study = (ROOT / "docs" / "why_clarke.md").read_text()
    for name in INSTRUMENTS:  # of the study alone
        assert f"`{name}`" in study, name


def test_code_of_the_readme_runs_and_learns(monkeypatch):
    monkeypatch.chdir(ROOT)
    first, *others = BLOCK.findall(README)
    space = {}
    exec(first, space)  # our own README, not input
    assert space["env"].unwrapped.robot.n_joints == 32
    seen, _ = space["env"].reset(seed=0)
    assert space["policy"].act(seen).shape == (2,)
    for block in others:
        exec(block, space)
    assert space["envs"].num_envs == 256
    model, held_out = (
        space["model"],
        space["gym"].make_vec(
            "clarke_gym/Reach-v0", num_envs=100, n_tendons=7, representation="clarke"
        ),
    )
    observations, _ = held_out.reset(seed=9_000)
    for _ in range(49):
        observations, *_, infos = held_out.step(model.predict(observations, deterministic=True)[0])
    assert infos["is_success"].mean() >= 0.98


@pytest.mark.parametrize("page", ["environments", "learning", "extend"])
def test_code_of_pages_runs(page, monkeypatch):
    """Blocks of a page in one name space; a signature with "..." in it is no code to run."""
    monkeypatch.chdir(ROOT)
    space = {}
    exec("import gymnasium as gym, clarke_gym", space)
    for block in BLOCK.findall((ROOT / "docs" / f"{page}.md").read_text()):
        if page == "extend":  # the class is shown without its methods, which the examples hold
            block = re.sub(r"@clarke_gym.*?\.\.\.[^\n]*\n", "", block, flags=re.DOTALL)
        exec(block, space)


def test_cells_of_get_started_run_and_learn(capsys):
    """As `make docs` runs them, without what a notebook is needed for."""
    text = (ROOT / "docs" / "get_started.md").read_text()
    space = {}
    for cell in re.findall(r"```\{code-cell\} python\n(.*?)```", text, flags=re.DOTALL):
        if "env.render()" in cell:
            continue  # pictures need OpenGL
        exec(cell, space)
    rates = re.findall(r"\d+ tendons: (\d\.\d\d)", capsys.readouterr().out)
    assert len(rates) == 4
    assert min(map(float, rates)) >= 0.9


def test_linked_files_exist():
    pages = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *ROOT.glob("docs/**/*.md")]
    for page in pages:
        if {"_build", "node_modules"} & set(page.parts):
            continue
        text = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.DOTALL | re.MULTILINE)
        for link in re.findall(r"\]\(([^)#:]+)\)", text):
            assert (page.parent / link).exists(), f"{page.name}: {link}"
