"""What a module of users registers works in training, by the name of the module."""

import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

MODULE = '''
import numpy as np
import clarke_gym

@clarke_gym.register_task("stand_up")
class StandUp(clarke_gym.Task):
    """No goal at all: raise the tip."""

    numbers = 2
    sensors = ("command", "tip_position")

    def __init__(self, robot):
        super().__init__(robot)
        self.metrics = (clarke_gym.Metric("height_m", "height", "m", 0.0),)

    def begin(self, numbers):
        start = np.zeros((len(numbers), self.robot.n_segments, 2))
        start[:, 0] = numbers
        return start, numbers[:, :0]

    def evaluate(self, state, goal):
        height = state.tip_position[:, 2]
        return clarke_gym.Outcome(height, height > 0.19, {"height_m": height})

clarke_gym.register_representation("halved", lambda s: (0.5 * s.matrices[1], 2.0 * s.matrices[0]))
clarke_gym.register_robot("ours", {"segments": [{"n_tendons": 5}]})
'''

CONFIG = """
name: stand
plugins: [our_parts]
env:
  id: clarke_gym/Task-v0
  num_envs: 4
  kwargs: {task: stand_up, representation: halved, robot: ours}
algo: {name: ppo, n_steps: 32, batch_size: 32, n_epochs: 1}
total_steps: 256
evaluation: {every_steps: 128, n_goals: 50}
checkpoint_every_steps: 128
"""


def test_parts_of_a_plugin_train_and_their_metrics_arrive(tmp_path):
    (tmp_path / "our_parts.py").write_text(MODULE)
    (tmp_path / "stand.yaml").write_text(CONFIG)
    done = subprocess.run(
        [
            sys.executable,
            str(ROOT / "train.py"),
            "train",
            "--config",
            "stand.yaml",
            "--out",
            "run",
            "--plugins",
            "our_parts",
        ],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "run" / "DONE").exists()
    assert "our_parts" in json.dumps(json.loads((tmp_path / "run" / "manifest.json").read_text()))
    assert "height_m" in (tmp_path / "run" / "progress.csv").read_text()
