"""Pictures of README and gallery: one policy on three robots, a thumbnail and a film a task.

python -m benchmarks.media
python -m benchmarks.media --films gate wrap
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

import clarke_gym  # noqa: F401  (registers the environments)
from clarke_gym.control import load_policy, make_controller
from clarke_gym.registration import ENVIRONMENTS

ROOT = Path(__file__).resolve().parent.parent
MEDIA = ROOT / "docs" / "media"

TENDONS = (3, 11, 32)
SEEDS = (4, 11, 8)
"""Episodes of the animation."""

FRAMES = 36
"""Control steps shown of each."""

FILMED = 5
"""Episode of the films."""

EVERY = 2
"""Control steps from one of their frames to the next."""

Picture = NDArray[np.uint8]


def _font(size: int) -> Any:
    import matplotlib

    return ImageFont.truetype(f"{matplotlib.get_data_path()}/fonts/ttf/DejaVuSans-Bold.ttf", size)


def one_policy() -> None:
    """Write the animation of the policy of seven tendons on robots with other numbers."""
    policy = load_policy(ROOT / "policies" / "reach")
    envs = [
        gym.make(
            "clarke_gym/Reach-v0",
            n_tendons=n,
            representation="clarke",
            render_mode="rgb_array",
            render_width=480,
            render_height=480,
        )
        for n in TENDONS
    ]
    frames = []
    for seed in SEEDS:
        seen = [env.reset(seed=seed)[0] for env in envs]
        for _ in range(FRAMES):
            steps = [env.step(policy.act(s)) for env, s in zip(envs, seen, strict=True)]
            seen = [step[0] for step in steps]
            frames.append(_panel([env.render() for env in envs]))
        if not all(step[4]["is_success"] for step in steps):
            raise RuntimeError(f"the policy misses the goal of seed {seed}: the picture would lie")
        frames += [frames[-1]] * 12
    for env in envs:
        env.close()
    _save(frames, MEDIA / "one_policy.gif", colours=255, frame_ms=50)


def _save(frames: Sequence[Image.Image], path: Path, colours: int, frame_ms: int) -> None:
    """Write an animation with one palette for all frames, so that nothing flickers."""
    few = np.vstack([np.asarray(frame) for frame in frames[:: max(1, len(frames) // 12)]])
    palette = Image.fromarray(few).quantize(colours, Image.Quantize.MEDIANCUT, kmeans=4)
    shown = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    shown[0].save(
        path, save_all=True, append_images=shown[1:], duration=frame_ms, loop=0, optimize=True
    )
    print(f"{path}: {path.stat().st_size / 1e6:.2f} MB")


def _panel(pictures: list[Any]) -> Image.Image:
    row = Image.fromarray(np.hstack(pictures)).resize((640, 213))
    panel = Image.new("RGB", (row.width, row.height + 30), "white")
    panel.paste(row, (0, 30))
    draw = ImageDraw.Draw(panel)
    for k, n in enumerate(TENDONS):
        centre = (k + 0.5) * row.width / len(TENDONS)
        draw.text((centre, 15), f"n = {n}", "#0072B2", _font(16), anchor="mm")
    return panel


def thumbnail(env_id: str) -> Picture:
    """Return a picture of a task in the middle of an episode."""
    size: dict[str, Any] = {"render_width": 240, "render_height": 240, "render_mode": "rgb_array"}
    env: Any = gym.make(env_id, n_tendons=4, physics="mujoco", **size)
    observation, _ = env.reset(seed=5)
    goal = env.unwrapped.task.goal
    steered = goal is not None and goal.labels == ("x", "y", "z")
    controller: Any = make_controller("clarke_controller", env) if steered else None
    env.action_space.seed(2)
    for _ in range(12):
        action = env.action_space.sample() if controller is None else controller.act(observation)
        observation, *_ = env.step(action)
    picture: Picture = env.render()
    env.close()
    return picture


def film(env_id: str, path: Path) -> None:
    """Write an episode of classical control, the film of a task's page."""
    size: dict[str, Any] = {"render_width": 320, "render_height": 320, "render_mode": "rgb_array"}
    env: Any = gym.make(env_id, n_tendons=7, representation="clarke", **size)
    observation, _ = env.reset(seed=FILMED)
    controller: Any = make_controller("clarke_controller", env)
    frames, terminated, truncated = [Image.fromarray(env.render())], False, False
    while not (terminated or truncated):
        observation, _, terminated, truncated, info = env.step(controller.act(observation))
        if env.unwrapped.steps[0] % EVERY == 0:
            frames.append(Image.fromarray(env.render()))
    if not info["is_success"]:
        raise RuntimeError(f"classical control fails in {env_id}, seed {FILMED}")
    dt_ms = 1e3 * env.unwrapped.control_dt
    env.close()
    _save([*frames, *frames[-1:] * 8], path, colours=64, frame_ms=round(EVERY * dt_ms))


def main() -> None:
    """Write all pictures, or some films."""
    tasks = {k["task"]: env_id for env_id, k in ENVIRONMENTS.items() if "task" in k}
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--films", nargs="+", choices=tasks, help="films of these tasks alone")
    only = parser.parse_args().films
    (MEDIA / "tasks").mkdir(parents=True, exist_ok=True)
    for task in only or tasks:
        film(tasks[task], MEDIA / "tasks" / f"{task}.gif")
    if only:
        return
    for task, env_id in tasks.items():
        path = MEDIA / "tasks" / f"{task}.png"
        Image.fromarray(thumbnail(env_id)).quantize(128).save(path, optimize=True)
        print(path)
    one_policy()


if __name__ == "__main__":
    main()
