"""Show a trained policy: an animated picture of held-out episodes."""

from __future__ import annotations

import importlib.util
import io
import tempfile
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from PIL import Image

from agents.files import CONFIG, ConfigError, write_bytes
from agents.learning.acting import load_agent
from agents.learning.config import TrainConfig, load_config
from agents.learning.evaluation import HELD_OUT_SEED


def play(folder: Path, agent: str, out: Path, episodes: int = 3, size: int = 320) -> int:
    """Write an animation of held-out episodes in real time.

    Parameters
    ----------
    folder : Path
        Run folder.
    agent : str
        As in `agents.learning.acting.evaluate_run`.
    out : Path
        A .gif, or a .mp4 where imageio is installed; an existing file is kept.
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
        If `out` exists or cannot be written, or the folder holds no finished run.
    ValueError
        If `episodes` is not in 1 ... 1,000.
    """
    if not 1 <= episodes <= 1_000:  # every frame is held in memory
        raise ValueError(f"--episodes must be in 1 ... 1000, got {episodes}")
    if out.suffix not in WRITERS:
        raise ConfigError(f"--out must end in {' or '.join(WRITERS)}, got {out.name!r}")
    if out.suffix == ".mp4" and importlib.util.find_spec("imageio_ffmpeg") is None:
        raise ConfigError(f"{out.name} needs imageio: pip install imageio imageio-ffmpeg; or .gif")
    if out.exists():
        raise ConfigError(f"{out} exists and is kept; choose another --out")
    config = load_config(TrainConfig, folder / CONFIG)
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
            frames.append(picture[0])
    fps = env.metadata["render_fps"]
    env.close()
    out.parent.mkdir(parents=True, exist_ok=True)
    write_bytes(out, WRITERS[out.suffix](frames, fps))
    return len(frames)


def _gif(frames: list[Any], fps: float) -> bytes:
    images = [Image.fromarray(frame) for frame in frames]
    buffer = io.BytesIO()
    period = round(1000 / fps)
    images[0].save(buffer, "GIF", save_all=True, append_images=images[1:], duration=period, loop=0)
    return buffer.getvalue()


def _mp4(frames: list[Any], fps: float) -> bytes:
    import imageio.v3 as iio

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "play.mp4"
        iio.imwrite(path, np.stack(frames), plugin="FFMPEG", fps=fps, macro_block_size=2)
        return path.read_bytes()


WRITERS = {".gif": _gif, ".mp4": _mp4}
"""Suffix -> what makes the bytes of pictures (height, width, 3) and frames a second."""
