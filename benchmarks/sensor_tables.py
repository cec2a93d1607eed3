"""The tables of docs/sensors.md, from the environments themselves.

python -m benchmarks.sensor_tables
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium as gym

import clarke_gym  # noqa: F401  (registers the environments)
from clarke_gym.disturbances import DISTURBANCES, PRESETS
from clarke_gym.sensors import LADDER, SENSORS

PAGE = Path(__file__).resolve().parent.parent / "docs" / "sensors.md"

_HEAD = """# What policies see

An observation is the concatenation of what sensors read, joint-space blocks first and written in
the representation, scaled and bounded by the robot's limits. `sensors="command+tendons+tip"`
chooses them; the goal is always seen. `env.unwrapped.sensors["tip_position"]` has place, labels,
unit, scale and bounds of a block, and `env.unwrapped.sensors.table()` gives tables like those
below. Noise, bias, steps and delay of sensors act on what is measured: not on commands, which a
robot knows, nor on what a task tells. `python -m benchmarks.sensor_tables` writes this page."""


def _first_line(thing: Any) -> str:
    return str(thing.__doc__).strip().splitlines()[0]


def page() -> str:
    """Return the page as Markdown."""
    parts = [_HEAD, "| sensor | space | what it reads | measured | needs |\n|---|---|---|---|---|"]
    for name in SENSORS.names():
        sensor = SENSORS[name]
        if not sensor.__module__.startswith("clarke_gym."):
            continue
        space = "joint" if "joint" in sensor.__module__ else "task"
        needs = ", ".join(sensor.needs) or "–"
        cells = [f"`{name}`", space, _first_line(sensor), "yes" if sensor.measured else "no", needs]
        parts[-1] += "\n| " + " | ".join(cells) + " |"
    bundles = [
        f"`{name}` stands for {' and '.join(f'`{n}`' for n in names)}"
        for name, names in LADDER.items()
    ]
    parts.append(
        "; ".join(bundles)
        + ", as far as the physics has it; `oracle` for all that there is. Constant "
        "curvature has no `tension` and no `contact_force`."
    )
    choices: tuple[tuple[str, dict[str, Any]], ...] = (
        ("Reach in Clarke coordinates, any number of tendons", {"representation": "clarke"}),
        ("Reach in raw tendon space, three tendons", {}),
    )
    for text, keywords in choices:
        env: Any = gym.make("clarke_gym/Reach-v0", **keywords)
        parts += [f"## {text}", env.unwrapped.sensors.table()]
        env.close()
    parts.append("# What disturbs\n\n| disturbance | what it does | physics |\n|---|---|---|")
    for name in DISTURBANCES.names():
        entry = DISTURBANCES[name]
        if entry.__module__.startswith("clarke_gym."):
            parts[-1] += f"\n| `{name}` | {_first_line(entry)} | {', '.join(entry.physics)} |"
    parts.append(
        'A strength follows a name where it is not 1: `disturbances="payload=0.5+push"`. What is '
        "named first acts first: noise, then steps. Presets have these strengths, and leave out "
        "what has no meaning in the physics:"
    )
    parts.append("| preset | disturbances |\n|---|---|")
    for name, strengths in PRESETS.items():
        told = ", ".join(f"`{key}` {strength:g}" for key, strength in strengths.items())
        parts[-1] += f"\n| `{name}` | {told or 'none'} |"
    return "\n\n".join(parts) + "\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    print(PAGE)
