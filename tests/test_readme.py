"""The README says what the code does: its tables against signatures, its code by running it."""

import inspect
import re
from pathlib import Path

from clarke_gym.envs.config import all_keywords
from clarke_gym.registration import ENVIRONMENTS, make_vector_env
from clarke_gym.representations import representation_names
from clarke_gym.representations.instruments import INSTRUMENTS

README = (Path(__file__).parent.parent / "README.md").read_text()


def names_in_first_column(heading):
    table = README.split(heading)[1].split("\n\n")[0]
    return {
        name for row in table.splitlines() for name in re.findall(r"`(\w+)`", row.split("|")[1])
    }


def test_keyword_table_is_complete():
    said = names_in_first_column("| keyword | default | meaning |\n")
    entry = set(inspect.signature(make_vector_env).parameters) - {"keywords"}
    ours = {name for name, owner in all_keywords() if "test_" not in owner}
    assert said == ours | entry


def test_every_id_and_representation_is_named():
    for env_id in ENVIRONMENTS:
        assert f"`{env_id}`" in README
    published = [name for name in representation_names() if re.search(r"_20\d\d$", name)]
    assert any(f"`{name}`" in README for name in published)
    ours = {name for name in representation_names() if not name.endswith("_doctest")}
    for name in ours - set(published) - set(INSTRUMENTS):
        assert f"`{name}`" in README, name
    study = (Path(__file__).parent.parent / "docs" / "why_clarke.md").read_text()
    for name in INSTRUMENTS:  # of the study alone
        assert f"`{name}`" in study, name


def test_code_runs():
    space = {}
    for block in re.findall(r"```python\n(.*?)```", README, flags=re.DOTALL):
        exec(block, space)  # our own README, not input
    assert space["position"].shape == (3,)
    assert space["envs"].num_envs == 256


def test_linked_files_exist():
    root = Path(__file__).parent.parent
    for page in [root / "README.md", *root.glob("docs/**/*.md"), root / "CONTRIBUTING.md"]:
        for link in re.findall(r"\]\(([^)#:]+)\)", page.read_text()):
            assert (page.parent / link).exists(), f"{page.name}: {link}"
