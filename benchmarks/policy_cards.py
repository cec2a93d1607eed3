"""Scores and cards of the released policies, measured with NumPy alone.

python -m benchmarks.policy_cards
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

import clarke_gym  # noqa: F401  (registers the environments)
from clarke_gym.control import load_policy

POLICIES = Path(__file__).resolve().parent.parent / "policies"

GOALS = 100
SEED = 20_000
"""Seed of the first of `GOALS` held-out goals; training uses others."""

TENDONS = (3, 7, 11, 32)


def scores(folder: Path) -> list[dict[str, Any]]:
    """Return success and tip error at the end of held-out episodes, by physics and tendons."""
    policy = load_policy(folder)
    found = []
    for physics in ("constant_curvature", "mujoco"):
        for n in TENDONS:
            settings = policy.about["env"]["kwargs"] | {"n_tendons": n, "physics": physics}
            envs = gym.make_vec(policy.about["env"]["id"], num_envs=GOALS, **settings)
            observations, _ = envs.reset(seed=SEED)
            ended = False
            while not ended:
                observations, _, terminated, truncated, infos = envs.step(policy.act(observations))
                ended = bool((terminated | truncated).all())
            envs.close()
            found.append(
                {
                    "physics": physics,
                    "n_tendons": n,
                    "success_rate": float(infos["is_success"].mean()),
                    "tip_error_mm_median": round(1e3 * float(np.median(infos["tip_error_m"])), 2),
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
        f"| {row['tip_error_mm_median']:.2f} |"
        for row in measured
    )
    hidden = "-".join(map(str, settings["net_arch"]))
    shape = f"{about['observation_space']['shape'][0]}-{hidden}-{about['action_space']['shape'][0]}"
    return f"""# Policy `{folder.name}`

`gym.make("{about["env"]["id"]}", {made})`, trained by {about["algorithm"].upper()} for
{about["env_steps"]:,} steps (seed {about["seed"]}, constant curvature; all settings in
`policy.json`): a tanh network {shape}.

```python
from clarke_gym.control import load_policy

policy = load_policy("policies/{folder.name}")  # NumPy alone
action = policy.act(observation)
```

Scores at the end of {GOALS} held-out episodes (`python -m benchmarks.policy_cards`), also with
other numbers of tendons and on MuJoCo, where it was not trained:

| physics | tendons a segment | success rate | tip error, median [mm] |
|---|---|---|---|
{rows}

Limits: it knows the robot's length, bending limit and drives as they were in training, sees the tip
without noise, and was trained with one seed. Licence: MIT, as the code.
"""


def main() -> None:
    """Measure and write all cards."""
    for path in sorted(POLICIES.glob("*/policy.json")):
        measured = scores(path.parent)
        text = json.dumps(measured, indent=1) + "\n"
        (path.parent / "scores.json").write_text(text, encoding="utf-8")
        (path.parent / "README.md").write_text(card(path.parent, measured), encoding="utf-8")
        print(path.parent)


if __name__ == "__main__":
    main()
