"""Show a trained policy: an animated picture of held-out episodes."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import gymnasium as gym
from PIL import Image

from agents.files import ConfigError, write_bytes
from agents.learning.config import TrainConfig, load_config
from agents.learning.evaluation import HELD_OUT_SEED, load_agent


def play(folder: Path, agent: str, out: Path, episodes: int = 3, size: int = 320) -> int:
    """Write an animated GIF of held-out episodes in real time.

    Parameters
    ----------
    folder : Path
        Run folder.
    agent : str
        As in `agents.learning.evaluation.evaluate_run`.
    out : Path
        The GIF; an existing file is kept.
    episodes : int
        Held-out episodes, the first ones of the evaluation.
    size : int
        Width and height in pixels.

    Returns
    -------
    int
        Number of frames.

    Raises
    ------
    ConfigError
        If `out` exists, or the folder holds no finished run.
    """
    if out.exists():
        raise ConfigError(f"{out} exists and is kept; choose another --out")
    config = load_config(TrainConfig, folder / "config.yaml")
    env = gym.make_vec(
        config.env.id,
        num_envs=1,
        autoreset_mode="disabled",
        render_mode="rgb_array",
        render_width=size,
        render_height=size,
        **config.env.kwargs,  # type: ignore[arg-type]
    )
    actor = load_agent(folder, config, agent, env)
    frames = []
    for episode in range(episodes):
        observation, _ = env.reset(seed=HELD_OUT_SEED + episode)
        ended = False
        while not ended:
            observation, _, terminated, truncated, _ = env.step(actor.act(observation))
            ended = bool(terminated[0] or truncated[0])
            picture: Any = env.render()
            frames.append(Image.fromarray(picture[0]))
    period = round(1000 / env.metadata["render_fps"])
    env.close()
    buffer = io.BytesIO()
    frames[0].save(buffer, "GIF", save_all=True, append_images=frames[1:], duration=period, loop=0)
    write_bytes(out, buffer.getvalue())
    return len(frames)
