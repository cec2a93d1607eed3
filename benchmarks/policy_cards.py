"""Scores and cards of the released policies, measured with NumPy alone.

python -m benchmarks.policy_cards
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from safetensors.numpy import load_file, save

import clarke_gym  # noqa: F401  (registers the environments)
from agents.files import write_bytes
from clarke_gym.control import load_policy
from clarke_gym.registration import ENVIRONMENTS

POLICIES = Path(__file__).resolve().parent.parent / "policies"

GOALS = 100
SEED = 20_000
"""Seed of the first of `GOALS` held-out goals; training uses others."""

TENDONS = {"constant_curvature": (3, 7, 11, 32), "mujoco": (7, 32)}
"""Tendons a segment, by physics."""

NAMES = {"constant_curvature": "constant curvature", "mujoco": "MuJoCo"}


ACTOR = ("mlp_extractor.policy_net.", "action_net.")
"""Tensors that act; a critic and the noise of training are not released."""


def keep_actor(folder: Path) -> None:
    """Leave in a policy's file what acts alone."""
    path = folder / "policy.safetensors"
    tensors = load_file(path)
    acting = {name: tensor for name, tensor in tensors.items() if name.startswith(ACTOR)}
    if len(acting) < len(tensors):
        write_bytes(path, save(acting))


def trained_on(about: dict[str, Any]) -> str:
    """Return the physics in which a policy was trained, from its ``policy.json``."""
    env = about["env"]
    fixed = ENVIRONMENTS[env["id"]].get("physics", "constant_curvature")
    return str(env["kwargs"].get("physics", fixed))


def scores(folder: Path) -> list[dict[str, Any]]:
    """Return success and the task's metric at the end of held-out episodes."""
    policy = load_policy(folder)
    found = []
    trained = trained_on(policy.about)
    for physics, tendons in TENDONS.items():
        if trained == "mujoco" and physics != trained:
            continue  # what a task of MuJoCo is about, constant curvature does not know
        for n in tendons:
            settings = policy.about["env"]["kwargs"] | {"n_tendons": n, "physics": physics}
            envs: Any = gym.make_vec(policy.about["env"]["id"], num_envs=GOALS, **settings)
            if physics != trained and envs.unwrapped.task.scene.bodies:
                envs.close()  # contact and slack of a hundred robots take too long for a card
                continue
            metric = envs.unwrapped.task.metrics[0]
            observations, _ = envs.reset(seed=SEED)
            ended, success, numbers = (np.zeros(GOALS, kind) for kind in (bool, bool, float))
            while not ended.all():
                observations, _, terminated, truncated, infos = envs.step(policy.act(observations))
                first = (terminated | truncated) & ~ended  # some episodes fail before the others
                success[first] = infos["is_success"][first]
                numbers[first] = infos[metric.name][first]
                ended |= first
            envs.close()
            found.append(
                {
                    "physics": physics,
                    "n_tendons": n,
                    "success_rate": float(success.mean()),
                    "metric": f"{metric.label}, median [{metric.unit or '1'}]",
                    "median": round(float(np.median(numbers)), 5),
                }
            )
    return found


def card(folder: Path, measured: list[dict[str, Any]]) -> str:
    """Return the card of a policy as Markdown."""
    about = json.loads((folder / "policy.json").read_text(encoding="utf-8"))
    settings, kwargs = about["settings"], about["env"]["kwargs"]
    made = ", ".join(f"{key}={value!r}" for key, value in kwargs.items())
    rows = "\n".join(
        f"| {row['physics']} | {row['n_tendons']} | {row['success_rate']:.2f} "
        f"| {row['median']:.4g} |"
        for row in measured
    )
    trained = trained_on(about)
    elsewhere = ", and on MuJoCo, where it was not trained, if nothing stands around it"
    others = "other numbers of tendons" + ("" if trained == "mujoco" else elsewhere)
    hidden = "-".join(map(str, settings["net_arch"]))
    shape = f"{about['observation_space']['shape'][0]}-{hidden}-{about['action_space']['shape'][0]}"
    return f"""# Policy `{folder.name}`

`gym.make("{about["env"]["id"]}", {made})`, trained by {about["algorithm"].upper()} for
{about["env_steps"]:,} steps (seed {about["seed"]}, {NAMES[trained]}; all settings in
`policy.json`): a tanh network {shape}.

```python
from clarke_gym.control import load_policy

policy = load_policy("policies/{folder.name}")  # NumPy alone
action = policy.act(observation)
```

Scores at the end of {GOALS} held-out episodes (`python -m benchmarks.policy_cards`), also with
{others}:

| physics | tendons a segment | success rate | {measured[0]["metric"]} |
|---|---|---|---|
{rows}

Limits: it knows the robot's length, bending limit and drives as they were in training, sees the tip
without noise, and was trained with one seed. Licence: MIT, as the code.
"""


def index() -> str:
    """Return the page of all cards as Markdown."""
    rows = []
    for path in sorted(POLICIES.glob("*/scores.json")):
        about = json.loads((path.parent / "policy.json").read_text(encoding="utf-8"))
        trained = about["env"]["kwargs"]["n_tendons"]
        found = json.loads(path.read_text(encoding="utf-8"))
        rates = {r["physics"]: r["success_rate"] for r in found if r["n_tendons"] == trained}
        cells = [f"{rates[p]:.2f}" if p in rates else "not tried" for p in TENDONS]
        rows.append(f"| [{path.parent.name}]({path.parent.name}/README.md) | {' | '.join(cells)} |")
    return f"""# Trained policies

Share of {GOALS} held-out episodes that end in success, with the number of tendons of the training.
All were trained with constant curvature, where the second column says what gravity and inertia
cost, but for those that were tried on MuJoCo alone: their tasks are of MuJoCo. These are other
episodes than the leaderboard's, and a rate of 0.5 over {GOALS} is known to 0.1 either way; that of
`wrap` moves more: its median episode ends just where success begins.

| policy | constant curvature | MuJoCo |
|---|---|---|
{chr(10).join(rows)}

`clarke_gym.control.load_policy("policies/NAME")` runs them on NumPy alone.
`python -m benchmarks.policy_cards` writes these pages.
"""


def main() -> None:
    """Measure and write all cards, or those that are named."""
    for path in sorted(POLICIES.glob("*/policy.json")):
        if sys.argv[1:] and path.parent.name not in sys.argv[1:]:
            continue
        keep_actor(path.parent)
        measured = scores(path.parent)
        text = json.dumps(measured, indent=1) + "\n"
        (path.parent / "scores.json").write_text(text, encoding="utf-8")
        (path.parent / "README.md").write_text(card(path.parent, measured), encoding="utf-8")
        print(path.parent)
    (POLICIES / "README.md").write_text(index(), encoding="utf-8")


if __name__ == "__main__":
    main()
