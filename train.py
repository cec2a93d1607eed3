"""Train, evaluate and compare policies of continuum robots: python train.py COMMAND --help."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

RUNS = Path("runs")


@dataclass
class Train:
    """Train one policy and write its run folder; a second call resumes or keeps what is done.

    A finished run goes on with a larger total_steps; its result is kept beside.
    """

    config: Path = Path("configs/train/reach_clarke.yaml")
    """YAML file of the run (see configs/train)."""
    seed: int | None = None
    """Seed of the run, instead of the file's."""
    out: Path | None = None
    """Run folder; by default runs/train/<name>/seed_NN."""
    set: dict[str, str] = field(default_factory=dict)
    """Other settings, e.g. --set env.kwargs.n_tendons 7 total_steps 20480."""
    plugins: list[str] = field(default_factory=list)
    """Modules that the configuration may import; it cannot run code that is not named here."""


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
    plugins: list[str] = field(default_factory=list)
    """Modules that the configuration may import; it cannot run code that is not named here."""


@dataclass
class Play:
    """Write an animation of held-out episodes of a trained run."""

    run: Path
    """Run folder of a finished training."""
    out: Path = Path("play.gif")
    """The .gif or .mp4 to write; an existing file is kept."""
    agent: str = "policy"
    """As in evaluate."""
    episodes: int = 3
    """Held-out episodes to show."""
    plugins: list[str] = field(default_factory=list)
    """Modules that the configuration may import; it cannot run code that is not named here."""


@dataclass
class Study:
    """Run every representation x task x seed of a study in parallel; stop and resume at will."""

    config: Path = Path("configs/studies/quick.yaml")
    """YAML file of the study (see configs/studies)."""
    workers: int | None = None
    """Processes; by default one a core."""
    ray: str | None = None
    """Address of a Ray cluster to run on instead: host:port of its head, or auto."""
    out: Path | None = None
    """Study folder; by default runs/<name>."""
    dry_run: bool = False
    """Say what would be done, and the CPU hours that earlier runs suggest; write nothing."""
    set: dict[str, str] = field(default_factory=dict)
    """Other settings, e.g. --set base.total_steps 20480."""
    plugins: list[str] = field(default_factory=list)
    """Modules that the configuration may import; it cannot run code that is not named here."""


@dataclass
class Tune:
    """Try the same quasi-random settings on every arm of a study that has a search."""

    config: Path = Path("configs/studies/tuning.yaml")
    """YAML file of the study."""
    workers: int = 1
    """Processes."""
    out: Path | None = None
    """Folder of the trials; by default runs/<name>_tuning."""
    set: dict[str, str] = field(default_factory=dict)
    """Other settings, e.g. --set search.configurations 8."""
    plugins: list[str] = field(default_factory=list)
    """Modules that the configuration may import; it cannot run code that is not named here."""


@dataclass
class Report:
    """Turn a study into one HTML page, figures and tables."""

    study: Path = RUNS / "quick"
    """Study folder."""
    out: Path | None = None
    """Where to write; by default <study>/report."""


@dataclass
class Explore:
    """Serve the explorer in the browser: the transform, a robot and a policy to touch."""

    port: int = 8000
    """Port on this machine; 0 takes a free one."""
    open: bool = True
    """Whether to open it in a browser, where there is one."""


Command = (
    Annotated[Train, tyro.conf.subcommand("train")]
    | Annotated[Evaluate, tyro.conf.subcommand("evaluate")]
    | Annotated[Play, tyro.conf.subcommand("play")]
    | Annotated[Study, tyro.conf.subcommand("study")]
    | Annotated[Tune, tyro.conf.subcommand("tune")]
    | Annotated[Report, tyro.conf.subcommand("report")]
    | Annotated[Explore, tyro.conf.subcommand("explore")]
)


_RESUMABLE = ("train", "study", "tune")
"""Commands whose files are whole at every moment, and that go on where they were stopped."""


class Terminated(BaseException):
    """SIGTERM has come."""


def _found(config: Path) -> Path:
    """Return a configuration's path; the shipped ones are found from any folder."""
    from agents.files import ROOT

    shipped = ROOT / config
    return shipped if not config.exists() and shipped.exists() else config


def _train(command: Train) -> int:
    from agents.files import ConfigError, run_folder
    from agents.learning.config import TrainConfig, load_config
    from agents.studies.study import progress_bar

    overrides = dict(command.set)
    if command.seed is not None:
        if "seed" in overrides:
            raise ConfigError("the seed is given twice: by --seed and by --set seed")
        overrides["seed"] = str(command.seed)
    config = load_config(TrainConfig, _found(command.config), overrides)
    folder = command.out or run_folder(RUNS / "train", config.name, config.seed)
    from agents.learning.training import train  # loads torch: mistakes have been said before

    with progress_bar(config.total_steps) as bar:
        fresh = train(config, folder, bar.update)
    print(f"{folder}: {'finished' if fresh else 'was finished before; nothing was changed'}")
    return 0


def _evaluate(command: Evaluate) -> int:
    from agents.learning.acting import evaluate_run

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
    from agents.studies.study import plan, run_study

    config = load_config(StudyConfig, _found(command.config), dict(command.set))
    folder = command.out or RUNS / config.name
    if command.workers is not None and command.workers < 1:
        raise ValueError(f"--workers must be at least 1, got {command.workers}")
    if command.dry_run:
        print(plan(config, folder))
        return 0
    ends = run_study(config, folder, command.workers, command.ray)
    lost = [f"{ends[kind]} runs {kind}" for kind in ("failed", "unfinished") if ends[kind]]
    if ends["unfinished"]:
        lost.append("the same command continues them")
    print(f"study {folder}: {'; '.join(lost) or 'complete'}")
    return 1 if lost else 0


def _tune(command: Tune) -> int:
    from agents.learning.config import load_config
    from agents.reporting.tuning import write_tuning
    from agents.studies.config import StudyConfig
    from agents.studies.tuning import WINNERS, tune

    config = load_config(StudyConfig, _found(command.config), dict(command.set))
    if command.workers < 1:
        raise ValueError(f"--workers must be at least 1, got {command.workers}")
    folder = command.out or RUNS / f"{config.name}_tuning"
    ends = tune(config, folder, command.workers)
    if ends["unfinished"]:
        print(f"{ends['unfinished']} runs unfinished; the same command continues them")
        return 1
    arms = {name: (task.label, shown.label) for name, shown, task in config.arms()}
    write_tuning(folder, arms)
    print(f"every trial: {folder}; the winners: {folder / WINNERS}")
    return 0


def _report(command: Report) -> int:
    from agents.reporting.report import write_report

    print(f"report: {write_report(command.study, command.out)}")
    return 0


def _explore(command: Explore) -> int:
    import webbrowser

    from agents.explorer import make_server

    with make_server(command.port) as server:
        address = f"http://127.0.0.1:{server.server_port}/"
        print(f"{address} (Ctrl-C ends it)", flush=True)
        if command.open:
            webbrowser.open(address)
        server.serve_forever()
    return 0


def _merged(arguments: Sequence[str]) -> list[str]:
    """Return the arguments with every --set and --plugins in one: the parser keeps the last alone.

    Raises
    ------
    ValueError
        If a setting is given twice.

    Examples
    --------
    >>> _merged(["train", "--set", "seed", "3", "--out", "x", "--set=name", "a"])
    ['train', '--out', 'x', '--set', 'seed', '3', 'name', 'a']
    """
    rest: list[str] = []
    lists: dict[str, list[str]] = {"--set": [], "--plugins": []}
    target = rest
    for argument in arguments:
        option, given, value = argument.partition("=")
        if option in lists:
            target = lists[option]
            target += [value] if given else []
            continue
        if argument.startswith("--"):
            target = rest
        target.append(argument)
    keys = lists["--set"][::2]
    if twice := sorted({key for key in keys if keys.count(key) > 1}):
        raise ValueError(f"--set gives {', '.join(twice)} twice")
    for option, values in lists.items():
        rest += [option, *values] if values else []
    return rest


def _run(arguments: Sequence[str]) -> int:
    command: Train | Evaluate | Play | Study | Tune | Report | Explore = tyro.cli(
        Command, args=_merged(arguments), description=__doc__
    )
    if not isinstance(command, Report | Explore):
        from agents.plugins import allow_plugins

        allow_plugins(command.plugins)
    match command:
        case Train():
            return _train(command)
        case Evaluate():
            return _evaluate(command)
        case Play():
            return _play(command)
        case Study():
            return _study(command)
        case Tune():
            return _tune(command)
        case Report():
            return _report(command)
        case Explore():
            return _explore(command)


def _end_at_once(number: int, frame: object) -> None:
    """End the process and the ones it has started, from within the signal's handler.

    An exception would unwind through libraries, and one that it meets holding a lock or a queue
    never comes to the end of its own closing.
    """
    del frame
    children = multiprocessing.active_children()
    for process in children:
        process.kill()
    for process in children:
        process.join(1.0)
    line = "\n" * sys.stderr.isatty()  # a progress bar may stand on this one
    line += "stopped; the same command continues from the last checkpoint\n"
    with contextlib.suppress(OSError):
        os.write(2, line.encode())
    os._exit(128 + number)


def _raise_terminated(number: int, frame: object) -> None:
    del number, frame
    signal.signal(signal.SIGTERM, signal.SIG_IGN)  # once is enough
    raise Terminated


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; expected errors are one line, not a traceback."""
    arguments = sys.argv[1:] if arguments is None else arguments
    if arguments and arguments[0] in _RESUMABLE:
        handlers = {signal.SIGINT: _end_at_once, signal.SIGTERM: _end_at_once}
    else:
        handlers = {signal.SIGTERM: _raise_terminated}
    before = {number: signal.signal(number, handler) for number, handler in handlers.items()}
    try:
        return _run(arguments)
    except (KeyboardInterrupt, Terminated) as stop:
        print("stopped", file=sys.stderr)
        return 130 if isinstance(stop, KeyboardInterrupt) else 143
    except (RuntimeError, ValueError, OSError, MemoryError, ImportError) as error:
        text = " ".join(str(error).split()) or type(error).__name__
        print(f"error: {text}", file=sys.stderr)
        return 2
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


if __name__ == "__main__":
    sys.exit(main())
