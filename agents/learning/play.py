"""Show a trained policy: an animated picture of held-out episodes."""

from __future__ import annotations

import importlib.util
import io
import math
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
    drawn = {"render_mode": "rgb_array", "render_width": size, "render_height": size}
    env = gym.make_vec(
        config.env.id,
        num_envs=1,
        autoreset_mode="disabled",
        **config.env.kwargs | drawn,  # type: ignore[arg-type]
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
    period_s = env.unwrapped.control_dt  # type: ignore[attr-defined]
    env.close()
    out.parent.mkdir(parents=True, exist_ok=True)
    write_bytes(out, WRITERS[out.suffix](frames, period_s))
    return len(frames)


def gif_times(count: int, period_s: float) -> dict[int, int]:
    """Return which frames a GIF shows, and for how many milliseconds each.

    A GIF counts in hundredths of a second, and viewers slow down what is shorter than two. The
    hundredths are spread so that the sum is right, and frames that come too soon are left out.

    Parameters
    ----------
    count : int
        Frames.
    period_s : float
        Time that each of them lasts [s].

    Returns
    -------
    dict of int to int
        Place of a frame -> milliseconds.

    Examples
    --------
    >>> gif_times(4, 0.025), gif_times(4, 0.01)
    ({0: 20, 1: 30, 2: 20, 3: 30}, {0: 20, 2: 20})
    """
    begins = {place: math.floor(100.0 * period_s * place + 1e-9) for place in range(count + 1)}
    shown = [0]
    for place in range(1, count):
        if begins[place] - begins[shown[-1]] >= 2:
            shown.append(place)
    ends = [*(begins[place] for place in shown[1:]), max(begins[count], begins[shown[-1]] + 2)]
    return {place: 10 * (end - begins[place]) for place, end in zip(shown, ends, strict=True)}


def _gif(frames: list[Any], period_s: float) -> bytes:
    times = gif_times(len(frames), period_s)
    images = [Image.fromarray(frames[place]) for place in times]
    buffer = io.BytesIO()
    lengths = list(times.values())
    images[0].save(buffer, "GIF", save_all=True, append_images=images[1:], duration=lengths, loop=0)
    return buffer.getvalue()


def _mp4(frames: list[Any], period_s: float) -> bytes:
    import imageio.v3 as iio

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "play.mp4"
        iio.imwrite(path, np.stack(frames), plugin="FFMPEG", fps=1.0 / period_s, macro_block_size=2)
        return path.read_bytes()


WRITERS = {".gif": _gif, ".mp4": _mp4}
"""Suffix -> what makes the bytes of pictures (height, width, 3) and of the time of each [s]."""
