"""Train, evaluate and compare policies of continuum robots: python train.py COMMAND --help."""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

RUNS = Path("runs")


@dataclass
class Train:
    """Train one policy and write its run folder; a second call resumes or keeps what is done."""

    config: Path = Path("configs/train/reach_clarke.yaml")
    """YAML file of the run (see configs/train)."""
    seed: int | None = None
    """Seed of the run, instead of the file's."""
    out: Path | None = None
    """Run folder; by default runs/train/<name>/seed_NN."""
    set: dict[str, str] = field(default_factory=dict)
    """Other settings, e.g. --set env.kwargs.n_tendons 7 total_steps 20480."""


@dataclass
class Evaluate:
    """Evaluate a trained run, or another agent on its environment, on the held-out goals."""

    run: Path
    """Run folder of a finished training."""
    agent: str = "policy"
    """policy (the trained one), random (uniform actions, the floor), or a classical controller:
    clarke_controller, clarke_pid, clarke_model_only, resolved_rate."""
    goals: int = 100
    """Number of held-out goals."""


@dataclass
class Play:
    """Write an animated picture of held-out episodes of a trained run."""

    run: Path
    """Run folder of a finished training."""
    out: Path = Path("play.gif")
    """The GIF to write; an existing file is kept."""
    agent: str = "policy"
    """As in evaluate."""
    episodes: int = 3
    """Held-out episodes to show."""


@dataclass
class Study:
    """Run every representation x task x seed of a study in parallel; stop and resume at will."""

    config: Path = Path("configs/studies/quick.yaml")
    """YAML file of the study (see configs/studies)."""
    workers: int | None = None
    """Processes; by default one a core."""
    out: Path | None = None
    """Study folder; by default runs/<name>."""
    set: dict[str, str] = field(default_factory=dict)
    """Other settings, e.g. --set base.total_steps 20480."""


@dataclass
class Report:
    """Turn a study into one HTML page, figures and tables."""

    study: Path = RUNS / "quick"
    """Study folder."""
    out: Path | None = None
    """Where to write; by default <study>/report."""


Command = (
    Annotated[Train, tyro.conf.subcommand("train")]
    | Annotated[Evaluate, tyro.conf.subcommand("evaluate")]
    | Annotated[Play, tyro.conf.subcommand("play")]
    | Annotated[Study, tyro.conf.subcommand("study")]
    | Annotated[Report, tyro.conf.subcommand("report")]
)


def _train(command: Train) -> int:
    from agents.files import run_folder
    from agents.learning.config import TrainConfig, load_config
    from agents.learning.training import train
    from agents.studies.study import progress_bar

    overrides = dict(command.set)
    if command.seed is not None:
        overrides["seed"] = str(command.seed)
    config = load_config(TrainConfig, command.config, overrides)
    folder = command.out or run_folder(RUNS / "train", config.name, config.seed)
    with progress_bar(config.total_steps) as bar:
        fresh = train(config, folder, bar.update)
    print(f"{folder}: {'finished' if fresh else 'was finished before; nothing was changed'}")
    return 0


def _evaluate(command: Evaluate) -> int:
    from agents.learning.evaluation import evaluate_run

    print(evaluate_run(command.run, command.agent, command.goals))
    return 0


def _play(command: Play) -> int:
    from agents.learning.play import play

    frames = play(command.run, command.agent, command.out, command.episodes)
    print(f"{command.out}: {frames} frames")
    return 0


def _study(command: Study) -> int:
    from agents.learning.config import load_config
    from agents.studies.config import StudyConfig
    from agents.studies.study import run_study

    config = load_config(StudyConfig, command.config, dict(command.set))
    folder = command.out or RUNS / config.name
    failures = run_study(config, folder, command.workers)
    print(f"study {folder}: {failures} runs failed" if failures else f"study {folder}: complete")
    return 1 if failures else 0


def _report(command: Report) -> int:
    from agents.reporting.report import write_report

    print(f"report: {write_report(command.study, command.out)}")
    return 0


def main() -> int:
    """Run the command line; expected errors are one line, not a traceback."""
    command: Train | Evaluate | Play | Study | Report = tyro.cli(Command, description=__doc__)
    from agents.files import ConfigError

    try:
        match command:
            case Train():
                return _train(command)
            case Evaluate():
                return _evaluate(command)
            case Play():
                return _play(command)
            case Study():
                return _study(command)
            case Report():
                return _report(command)
    except (ConfigError, RuntimeError, ValueError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
