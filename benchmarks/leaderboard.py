"""Scores of every task without learning and with it: docs/leaderboard.json and docs/leaderboard.md.

python train.py study --config configs/studies/leaderboard.yaml
python -m benchmarks.leaderboard --study runs/leaderboard

Random actions, classical control (`clarke_controller`) and MPPI play the held-out episodes of three
difficulties; PPO's scores are read from the study's runs. Without --study those stay as they are.
"""

from __future__ import annotations

import argparse
import csv
import json
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.envs.registration import parse_env_id

import clarke_gym  # noqa: F401  (registers the environments)
from agents.learning.evaluation import HELD_OUT_SEED
from agents.yaml_files import read_yaml
from clarke_gym.control import make_controller
from clarke_gym.registration import ENVIRONMENTS

DOCS = Path(__file__).resolve().parent.parent / "docs"
DATA, PAGE = DOCS / "leaderboard.json", DOCS / "leaderboard.md"

IDS = [name for name, keywords in ENVIRONMENTS.items() if keywords]
DIFFICULTIES = (0.0, 0.5, 1.0)
EPISODES = {"random": 50, "clarke_controller": 50, "mppi": 10}
PLANNED = ("Hold", "Wrap")
"""Tasks that constant curvature cannot have, so that MPPI cannot plan them."""

LABELS = {
    "random": "random",
    "clarke_controller": "classical",
    "mppi": "MPPI, Clarke",
    "mppi_raw": "MPPI, raw",
}


def play(env_id: str, agent: str, episodes: int, **keywords: Any) -> dict[str, list[float]]:
    """Return success, the leading metric and the mean reward of each episode."""
    envs: Any = gym.make_vec(
        env_id, num_envs=episodes, autoreset_mode="disabled", n_tendons=7, **keywords
    )
    observation, info = envs.reset(seed=HELD_OUT_SEED)
    envs.action_space.seed(0)
    controller = None if agent == "random" else make_controller(agent, envs)
    failed, total = np.zeros(episodes, bool), np.zeros(episodes)
    steps = envs.unwrapped.episode_steps
    for _ in range(steps):
        action = envs.action_space.sample() if controller is None else controller.act(observation)
        observation, reward, terminated, truncated, info = envs.step(action)
        failed |= terminated
        total += np.where(failed, 0.0, reward)
        if terminated.any() and not (terminated | truncated).all():
            observation, _ = envs.reset(options={"reset_mask": terminated})
    lead = envs.unwrapped.task.metrics[0]
    told = {
        "success": info["is_success"] & ~failed,
        lead.name: np.where(failed, lead.worst, info[lead.name]),
        "reward": total / steps,
    }
    envs.close()
    return {name: [float(value) for value in values] for name, values in told.items()}


def references(only: list[str]) -> dict[str, Any]:
    """Return the scores of all agents that do not learn, by task, agent and difficulty."""
    scores: dict[str, Any] = {}
    for env_id in IDS:
        task = parse_env_id(env_id)[1]
        if only and task not in only:
            continue
        agents = [
            ("random", "random", "clarke"),
            ("clarke_controller", "clarke_controller", "clarke"),
        ]
        if task not in PLANNED:
            agents += [("mppi", "mppi", "clarke"), ("mppi_raw", "mppi", "raw")]
        for label, agent, representation in agents:
            for difficulty in DIFFICULTIES:
                if label == "mppi_raw" and difficulty != 0.5:
                    continue
                found = play(
                    env_id,
                    agent,
                    EPISODES[agent],
                    representation=representation,
                    difficulty=difficulty,
                )
                scores.setdefault(task, {}).setdefault(label, {})[str(difficulty)] = found
                print(task, label, difficulty, np.mean(found["success"]), flush=True)
    return scores


def learned(study: Path) -> dict[str, Any]:
    """Return evaluations of the study's finished runs, by task, representation and seed."""
    scores: dict[str, Any] = {}
    for arm in read_yaml(study / "study.yaml")["arms"]:
        for seed in arm["seeds"]:
            folder = study / arm["name"] / f"seed_{seed:02d}"
            if not (folder / "DONE").exists():
                continue
            with np.load(folder / "evals.npz") as evals:
                found = {
                    "success": evals["is_success"].mean(1).tolist(),
                    "env_steps": evals["env_steps"].tolist(),
                }
            arms = scores.setdefault(arm["task"], {})
            arms.setdefault(arm["representation"], {})[str(seed)] = found
    return scores


def last_five(seeds: dict[str, Any]) -> list[float]:
    """Return the mean success of the last five evaluations of each seed."""
    return [float(np.mean(run["success"][-5:])) for run in seeds.values()]


def interval(values: list[float]) -> tuple[float, float]:
    """Return Wilson's 95 % interval of a rate."""
    n, p, z = len(values), float(np.mean(values)), 1.959964
    centre = (p + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * np.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    return centre - half, centre + half


def page(data: dict[str, Any]) -> str:
    """Return the page as Markdown."""
    rows = []
    for task, agents in data["references"].items():
        row = [f"[{task}](tasks/{task.lower()}.md)"]
        for agent in LABELS:
            found = agents.get(agent, {}).get("0.5")
            row.append("–" if found is None else _rate(found["success"]))
        for representation in ("raw", "clarke"):
            seeds = data["learned"].get(task, {}).get(representation, {})
            last = last_five(seeds)
            curve = DOCS / "curves" / f"{task.lower()}_{representation}.csv"
            if not last and curve.exists():
                row.append(_single(curve))
                continue
            row.append(
                f"{np.mean(last):.2f} ({min(last):.2f} to {max(last):.2f}; {len(last)})"
                if last
                else "–"
            )
        rows.append("| " + " | ".join(row) + " |")
    tried = [
        f"| {one['task']} | {one['change']} | {one['env_steps']:,} | {_tried(one)} |"
        for one in data["tried"]
    ]
    harder = []
    for task, agents in data["references"].items():
        for agent, scores in agents.items():
            if len(scores) == len(DIFFICULTIES):
                cells = [_mean(scores[str(d)]["reward"]) for d in DIFFICULTIES]
                rates = [f"{np.mean(scores[str(d)]['success']):.2f}" for d in DIFFICULTIES]
                harder.append(f"| {task} | {LABELS[agent]} | " + " | ".join(cells + rates) + " |")
    return _TEXT.format(
        rows="\n".join(rows),
        harder="\n".join(harder),
        tried="\n".join(tried),
        agents=" | ".join(LABELS.values()),
        episodes=EPISODES["random"],
        held=_held(),
        classical=float(np.mean(data["references"]["Hold"]["clarke_controller"]["0.5"]["held"])),
        planned=EPISODES["mppi"],
        nest=_last("nest_clarke", "tip_error_percent"),
    )


def _tried(one: dict[str, Any]) -> str:
    """Return the mean success of what was tried, and its range where it is one of seeds."""
    mean, found = f"{np.mean(one['success']):.2f}", one["success"]
    return f"{mean} ({min(found):.2f} to {max(found):.2f})" if "(seeds " in one["change"] else mean


def _last(name: str, column: str) -> float:
    """Return what a shipped run ends with."""
    with (DOCS / "curves" / f"{name}.csv").open() as file:
        return float(list(csv.DictReader(file))[-1][column])


def _held() -> float:
    """Return the share of time that the shipped run of Hold ends with."""
    with (DOCS / "curves" / "hold_clarke.csv").open() as file:
        return float(np.mean([float(row["held"]) for row in list(csv.DictReader(file))[-5:]]))


def _single(curve: Path) -> str:
    """Return the last five evaluations of a shipped run whose task is not in the study."""
    with curve.open() as file:
        rows = [row for row in csv.DictReader(file) if int(row["env_steps"])]  # it has trained
    success = np.mean([float(row["success_rate"]) for row in rows[-5:]])
    return f"{success:.2f} (1; {int(rows[-1]['env_steps']):,} steps)"


def _rate(values: list[float]) -> str:
    low, high = interval(values)
    return f"{np.mean(values):.2f} [{low:.2f}, {high:.2f}]"


def _mean(values: list[float]) -> str:
    half = 1.96 * np.std(values, ddof=1) / np.sqrt(len(values))
    return f"{np.mean(values):.3f} ± {half:.3f}"


_TEXT = """# Leaderboard

Success at the end of an episode, seven tendons, difficulty 0.5, nothing disturbed; Hold and
Wrap on MuJoCo, all else with constant curvature. `python -m benchmarks.leaderboard` writes this
page from `leaderboard.json`.

- Random, classical control (`clarke_controller`; on Gate and Nest by clear ways, on Wrap by the
  bends that lay the robot round the cylinder) and MPPI (256 samples, horizon 15, planning on
  constant curvature) know nothing that is hidden, but what a task tells: goal, path and bodies.
  Rates with Wilson's 95 % interval over {episodes} held-out episodes, MPPI over {planned}.
- PPO: 409,600 steps with the settings of `configs/algos/ppo.yaml` (gamma 0.98 for Gate and
  Nest), the mean of the last five evaluations of 100 held-out episodes; then the range over
  seeds and their number. Hold and Wrap: the run of `configs/train`, one seed, gamma 0.98, 50
  held-out episodes. A reference, not a claim about representations: that is [the
  comparison](comparison.md).

| task | {agents} | PPO, raw | PPO, Clarke |
|---|---|---|---|---|---|---|
{rows}

Hold is where learning pays, as far as one seed tells: `configs/train/hold_clarke.yaml` holds the
tip within 2 % of the length for {held:.2f} of the time, classical control for
{classical:.2f}, which does not know the load.

## What was tried for the harder ones

PPO in Clarke coordinates, one seed each where nothing else is said; the mean of the last three
evaluations, or of those means over seeds, with their range. Larger batches, a larger network and a
learning rate that falls solve Pose and Shape within minutes: `configs/train` has them. On Gate they
were not enough: starts beside a neighbouring opening often end in a bar at once, and robots that
wait at their goals fill the batch. Short episodes of many robots help; seeds still differ. Nest is
left with precision: at the end of the shipped run the median error is {nest:.1f} % of the length,
where success asks for 2 %.

| task | change | steps | success |
|---|---|---|---|
{tried}

## Difficulty

Mean reward a step (95 % interval of the mean over episodes), then success, at difficulty 0, 0.5
and 1.

| task | agent | reward, 0 | 0.5 | 1 | success, 0 | 0.5 | 1 |
|---|---|---|---|---|---|---|---|
{harder}
"""


def main() -> None:
    """Write both files."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--study", type=Path, help="folder of the leaderboard study")
    parser.add_argument("--tasks", nargs="*", default=[], help="to play again; all by default")
    parser.add_argument("--page-only", action="store_true", help="write the page from the data")
    arguments = parser.parse_args()
    data = json.loads(DATA.read_text()) if DATA.exists() else {"learned": {}}
    if not arguments.page_only:
        data["references"] = data.get("references", {}) | references(arguments.tasks)
    if arguments.study is not None:
        data["learned"] = learned(arguments.study)
    DATA.write_text(json.dumps(data, separators=(",", ":")) + "\n")
    PAGE.write_text(page(data), encoding="utf-8")


if __name__ == "__main__":
    main()
