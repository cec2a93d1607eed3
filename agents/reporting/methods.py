"""The paragraph of a paper's methods section that a study can write itself."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from typing import Any

from agents.reporting.summary import Summary
from agents.reporting.wording import added_seeds, percent, reporting_block


def _series(words: Iterable[str]) -> str:
    """Join words as prose does.

    Examples
    --------
    >>> _series(["raw", "clarke", "modal"])
    'raw, clarke and modal'
    """
    *first, last = words
    return f"{', '.join(first)} and {last}" if first else last


def _settings(values: Mapping[str, Any], without: Iterable[str] = ()) -> str:
    shown = {name: value for name, value in values.items() if name not in set(without)}
    return ", ".join(f"{name} {value}" for name, value in shown.items())


OF_STABLE_BASELINES3 = ("a2c", "ddpg", "dqn", "ppo", "sac", "td3")
"""Algorithms of that library; others that studies name are of SB3-Contrib."""


def methods(summary: Summary) -> str:
    """Return the paragraph: what was trained, measured and computed, from the study alone.

    Parameters
    ----------
    summary : Summary

    Returns
    -------
    str
        Plain text; what the study does not know is left out.
    """
    study, block = summary.study, reporting_block(summary)
    base = study.base
    algo, env, evaluation = (dict(base.get(key) or {}) for key in ("algo", "env", "evaluation"))
    text = [f"{study.title}."]
    if algo and env:
        inside, name = _settings(env.get("kwargs") or {}), str(algo.get("name", ""))
        library = "Stable-Baselines3" if name in OF_STABLE_BASELINES3 else "SB3-Contrib"
        text.append(
            f"Policies were trained with {name.upper()} "
            f"({_settings(algo, ['name'])}) of {library} on {env.get('num_envs')} "
            f"environments {env.get('id')}{f' ({inside})' if inside else ''} for "
            f"{study.total_steps:,} environment steps, changed only in what names an arm."
        )
    names = _series(f"\u201c{name}\u201d" for name in study.representations)
    text.append(
        f"The arms {names} were compared on {_series(study.tasks)}, with "
        f"{block['Seeds per arm']} seeds an arm ({block['Runs']} runs)."
    )
    goals = evaluation.get("n_goals")
    text.append(
        f"Policies were evaluated without exploration noise on {goals} held-out goals, the same "
        f"for all, at {len(study.env_steps)} points of training."
        if goals
        else f"Evaluation: {block['Evaluation']}."
    )
    text.append(
        "The primary metric is the area under the curve of the success rate over environment "
        f"steps, normalised to 1; steps to {percent(study.threshold)} success are secondary. "
        "Averages are interquartile means over seeds, except of steps, which are restricted means. "
        f"Intervals: {block['Intervals']}. Differences of the primary metric were tested with "
        "Welch\u2019s t test, Holm-adjusted over the comparisons."
    )
    text.append(f"Hyper-parameters: {study.tuning}.")
    if study.registered and study.registration_holds:
        more = added_seeds(summary)
        text.append(
            "Question, arms, primary metric and rules were registered before the runs (SHA-256 "
            f"{study.registered[:12]}{f'; {more}' if more else ''})."
        )
    packages = _packages(summary)
    text.append(
        f"Code {block['Code']}{f', {packages}' if packages else ''}; CPU hours: "
        f"{block['CPU hours']}."
    )
    return " ".join(text)


def _packages(summary: Summary) -> str:
    """Return versions of the libraries, where every run had the same."""
    found = {
        json.dumps(run.manifest["packages"], sort_keys=True)
        for run in summary.study.runs
        if isinstance(run.manifest.get("packages"), dict)
    }
    return _settings(json.loads(found.pop())) if len(found) == 1 else ""
