"""One page a task, docs/tasks/*.md, from the code and docs/leaderboard.json.

python -m benchmarks.task_pages
"""

from __future__ import annotations

import inspect
import json
import re
from pathlib import Path
from typing import Any

import gymnasium as gym
from gymnasium.envs.registration import parse_env_id

import clarke_gym  # noqa: F401  (registers the environments)
from benchmarks.leaderboard import DATA, LABELS, interval, last_five
from clarke_gym.disturbances import DISTURBANCES
from clarke_gym.registration import ENVIRONMENTS
from clarke_gym.tasks import TASKS, ObstructedTask

FOLDER = Path(__file__).resolve().parent.parent / "docs" / "tasks"

HISTORY = "v0: first version."


def _markdown(text: str) -> str:
    """Return reStructuredText of a docstring as Markdown: formulas, code."""
    text = re.sub(r":math:`([^`]+)`", r"$\1$", text)
    return re.sub(r"``([^`]+)``", r"`\1`", text)


def _sections(doc: str) -> dict[str, str]:
    """Return the parts of a NumPy docstring by their titles, the text before them under ''."""
    parts = re.split(r"\n(\w[\w ]*)\n-{3,}\n", "\n" + doc)
    return {"": parts[0].strip(), **dict(zip(parts[1::2], parts[2::2], strict=True))}


def _arguments(owner: Any, doc: str) -> str:
    """Return the task's arguments as a table: name, default, meaning."""
    defaults = {
        name: parameter.default
        for name, parameter in inspect.signature(owner).parameters.items()
        if parameter.kind is parameter.KEYWORD_ONLY
    }
    rows = ["| argument | default | meaning |", "|---|---|---|"]
    entries = re.split(r"\n(?=\w)", _sections(doc)["Parameters"].strip())
    for entry in entries:
        head, _, text = entry.partition("\n")
        name = head.split(" : ")[0]
        if name in defaults:
            meaning = " ".join(text.split())
            kind = head.split(" : ")[1].replace("|", "or")
            rows.append(f"| `{name}` | `{defaults[name]!r}` | {kind}. {_markdown(meaning)} |")
    return "\n".join(rows)


def _scores(task: str) -> str:
    """Return the scores of the leaderboard."""
    data = json.loads(DATA.read_text())
    rows = ["| agent | success at difficulty 0.5 |", "|---|---|"]
    for agent, label in LABELS.items():
        found = data["references"].get(task, {}).get(agent, {}).get("0.5")
        if found:
            low, high = interval(found["success"])
            rate = sum(found["success"]) / len(found["success"])
            rows.append(f"| {label} | {rate:.2f} [{low:.2f}, {high:.2f}] |")
    for representation, seeds in data["learned"].get(task, {}).items():
        last = last_five(seeds)
        seeds_text = f"{len(last)} seed{'s' * (len(last) > 1)}"
        rows.append(
            f"| PPO, {representation}, {seeds_text} | {sum(last) / len(last):.2f} "
            f"({min(last):.2f} to {max(last):.2f}) |"
        )
    return "\n".join(rows)


def page(env_id: str) -> str:
    """Return a task's page as Markdown."""
    keywords = ENVIRONMENTS[env_id]
    name = keywords["task"]
    owner, title = TASKS[name], parse_env_id(env_id)[1]
    doc = inspect.getdoc(owner) or ""
    env: Any = gym.make(env_id, n_tendons=7, representation="clarke")
    face = env.unwrapped
    lead, *rest = _markdown(_sections(doc)[""]).split("\n\n")
    physics = [keywords["physics"]] if "physics" in keywords else ["constant_curvature", "mujoco"]
    disturbing = [
        f"`{key}`"
        for key in DISTURBANCES.names()
        if DISTURBANCES[key].__module__.startswith("clarke_gym.")
        and set(DISTURBANCES[key].physics) & set(physics)
    ]
    raw: Any = gym.make(env_id, n_tendons=7)
    metrics = "\n".join(
        f"| `{metric.name}` | {metric.label} | {metric.unit or '–'} | "
        f"{'step' if metric.over == 'now' else 'episode so far: ' + metric.over} |"
        for metric in face.task.metrics
    )
    more = [f"`{k}={v}`" for k, v in keywords.items() if k not in ("task", "robot", "physics")]
    bent = f" with {', '.join(more)}" if more else ""
    goal = "yes" if face.task.goal is not None else "no"
    among = issubclass(owner, ObstructedTask)
    ends = "a body deeper inside the hull than its radius" if among else "none"
    if among:
        rest += _markdown(_sections(inspect.getdoc(ObstructedTask) or "")[""]).split("\n\n")[1:]
    parts = [
        f"# {title}",
        f"![{title}: classical control in one episode](../media/tasks/{name}.gif)",
        lead,
        "| | |\n|---|---|\n"
        f"| action space (Clarke / raw, n = 7) | `{env.action_space}` / `{raw.action_space}` |\n"
        f"| observation space (Clarke / raw, n = 7) | `Box{env.observation_space.shape}` / "
        f"`Box{raw.observation_space.shape}` |\n"
        f'| make | `gym.make("{env_id}")` |\n'
        f"| physics | {', '.join(f'`{one}`' for one in physics)} |\n"
        f"| robot | `{keywords.get('robot', 'default')}`{bent} unless another is asked for |\n"
        f"| goal-conditioned (`goal_env=True`) | {goal} |",
        *rest,
        "## Observations",
        "In Clarke coordinates, for any number of tendons; joint-space sensors have n numbers a "
        "segment in raw tendon space. An action of 1 moves a tendon at its speed limit "
        '(`control="increment"`) or asks for the largest displacement (`"absolute"`).',
        face.sensors.table(),
        "## Success, end, metrics",
        f"Episodes are truncated after {face.episode_steps} steps of {face.control_dt} s, never "
        f"terminated by success; failures that terminate: {ends}. `info` has the terms of the "
        "reward and these numbers:",
        f"| metric | what | unit | of the |\n|---|---|---|---|\n{metrics}",
        "## Arguments",
        _arguments(owner, doc),
        "And those of every environment, robot and physics: [Environments](../environments.md).",
        "## Disturbances",
        f"{', '.join(disturbing)}; presets `mild`, `hardware`, `harsh`. What each does: "
        "[sensors and disturbances](../sensors.md).",
        "## Scores",
        _scores(title),
        "## Versions",
        HISTORY,
    ]
    env.close()
    raw.close()
    return "\n\n".join(parts) + "\n"


def pages() -> dict[str, str]:
    """Return the pages by file name."""
    return {
        f"{keywords['task']}.md": page(env_id)
        for env_id, keywords in ENVIRONMENTS.items()
        if keywords
    }


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for name, text in pages().items():
        (FOLDER / name).write_text(text, encoding="utf-8")
        print(FOLDER / name)
