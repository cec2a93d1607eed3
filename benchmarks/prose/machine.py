"""What pages say of speed, of attacks, of other libraries and of the explorer's frames."""

from __future__ import annotations

import csv
import re

from agents.learning.algorithms import ALGORITHMS
from agents.reporting.wording import number
from benchmarks.committed_scores import DOCS
from benchmarks.measured import measured
from benchmarks.prose.physics import SPEED
from benchmarks.prose.sources import rows, span

SETTINGS = {"reach_her": "SAC, hindsight", "pose_her": "SAC, hindsight, sparse reward"}
"""What shipped runs are that are not PPO's."""


def _slash(values: list[float], digits: int = 2) -> str:
    return " / ".join(number(value, digits) for value in values)


def speed() -> list[str]:
    """Return the sentences of docs/speed.md."""
    ours, engine, clone = (measured(name) for name in ("env_speed", "engine_cost", "fresh_clone"))
    second, again = measured("worker_gain"), measured("physics_speed_again")
    ratios, scalar = ours["ratios"], ours["scalar_step_us"]
    one = [ratios[f"scalar {who} over Reacher-v5"] for who in ("raw n = 3", "raw n = 7", "Clarke")]
    overhead = [r for r in rows(SPEED) if r.get("profile") in ("fast", "accurate")]
    batches = [float(r["ratio"]) for r in overhead if r["batch"] == "64"]
    single = [
        ", ".join(
            f"«{r['ratio']}»" for r in overhead if (r["profile"], r["batch"]) == (profile, "1")
        )
        for profile in ("accurate", "fast")
    ]
    runs = [engine[name] for name in ("reach_clarke", "quick, raw", "quick, clarke")]
    within = _slash([run["within"] for run in runs])
    beside = [ratio for run in runs for ratio in run["beside"]]
    vector = ours["vector_step_us"]["clarke n=7"] / ours["batch"]
    steps = [value for name, value in scalar.items() if name != "reacher"]
    plain = sum(ours["shares"]["scalar, Clarke n = 7"][stage] for stage in ("task", "sensors"))
    later = {
        profile: "«{:.2f}», «{:.2f}» and «{:.2f}»".format(*again[f"scalar_{profile}"])
        for profile in ("fast", "accurate")
    }
    return [
        f"when it was «{number(again['slower'], 1)}» times as slow",
        f"`fast` profiles were at {later['fast']}, `accurate` at {later['accurate']}.",
        f"raw n = 3 / raw n = 7 / Clarke n = 7 | «{_slash(one)}» |",
        f"vector entry point | «{number(ratios['vector Clarke over CartPole-v1'])}» |",
        f"n = 3, Clarke, batch 4096 | «{number(ratios['cost Clarke n = 32 over 3'])}» |",
        f"batch 32 | «{number(ratios['cost raw n = 32 over 3, batch 32'])}» |",
        f"ten times as wide | «{number(ratios['cost raw n = 32 over 3'], 1)}» |",
        f"batch 64, all profiles and segments | «{span(batches)}» |",
        f"with 1, 2, 3 segments | {single[0]} / {single[1]} |",
        f"`reach_clarke.yaml` / quick.yaml, raw / Clarke | «{within}» |",
        f"beside runs of `learn` alone, in turn, single pairs | «{span(beside)}» |",
        f"one worker over two | «{span(second['workers'])}» |",
        f"what the machine itself gains | «{span(second['processes'])}» |",
        *(
            f"| {step} | {' | '.join(f'«{100 * share:.0f}»' for share in parts.values())} |"
            for step, parts in ours["shares"].items()
        ),
        f"A scalar step costs «{min(steps):.0f} to {max(steps):.0f}» microseconds",
        f"and take «{100 * plain:.0f}» % of a Clarke step",
        f"it would be «{number(one[-1] / (1.0 - plain))}» times as fast as Reacher's",
        f"which needs «{number(vector)}» microseconds a step and environment",
        f"| `make install` | «{clone['make install']}» |",
        f"checks, the wheel and «{clone['tests']:,}» tests | «{clone['bash .ci/run']}» |",
        f"| `make compare`, the environment being there | «{clone['make compare']}» |",
        f"builds and tests the site | «{clone['make docs']}» |",
    ]


def study() -> list[str]:
    """Return the sentences of docs/study.md."""
    share = 100.0 * measured("engine_cost")["reach_clarke"]["shares"]["diagnostics"]
    return [f"They take «{number(share, 1)}» % of a PPO run's CPU time"]


def _found(pattern: str) -> list[tuple[str, ...]]:
    """Return what the figures of the attacks say where they are of this form."""
    figures = measured("attacks")["figures"]
    found = [match.groups() for figure in figures if (match := re.fullmatch(pattern, figure))]
    if not found:
        raise ValueError(f"no figure of an attack is {pattern}")
    return found


def _total(found: list[tuple[str, ...]], k: int) -> int:
    return sum(int(groups[k]) for groups in found)


def _curves() -> list[str]:
    """Return the rows of the table of shipped runs."""
    said = []
    for path in sorted((DOCS / "curves").glob("*.csv")):
        name, shipped = path.stem, path.stem not in ALGORITHMS
        row = list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()))
        there = [int(r["env_steps"]) for r in row if float(r["success_rate"]) >= 0.9]
        last = row[-1]
        cells = [
            f"`{name}` ({SETTINGS.get(name, 'PPO')})" if shipped else f"`algo: {name}`",
            f"«{int(last['env_steps']):,}»",
            f"«{float(last['success_rate']):.2f}»",
            f"«{there[0]:,}»" if there else "not reached",
            f"«{float(last['wall_s']):,.0f}» s",
            f"«{float(last['cpu_s']):,.0f}» s",
        ]
        said.append(f"| {' | '.join(cells)} |")
    return said


def reliability() -> list[str]:
    """Return the sentences of docs/reliability.md."""
    told = measured("attacks")
    between = _found(r"(.+): stopped between rollouts 3 times, byte-equal")
    events = _found(r"(.+): killed at (\d+) of \d+ events, all byte-equal, nothing left")
    instants = _found(r"(.+): (\d+) kills at random instants in \d+ runs, byte-equal")
    flips = _found(r".+: (\d+) flipped bits, (\d+) seen")
    pickles = _found(r"hostile pickles in (\d+) files: (\d+) executed")
    stops = _found(r"SIG\w+ in \w+: stopped after ([\d.]+) s")
    workers = _found(r"workers killed at (\d+) events of the file system, byte-equal")
    (kills,) = _found(r"a study of both physics: (\d+) kills at random instants, byte-equal")
    closed = _found(r".+(?<!forgotten), (\d+) times: ([+-][\d.]+) MB")
    drawn = _found(r".+ drawn and forgotten, (\d+) times: ([+-][\d.]+) MB")
    share = 100.0 * measured("engine_cost")["reach_clarke"]["shares"]["checkpoints"]
    return [
        f"A whole run: «{told['passed']}» tests passed in «{told['seconds'] / 60:.0f}» minutes",
        f"| «{len(between)}» configurations, byte-equal |",
        f"| «{_total(events, 1)}» kills in «{len(events)}» configurations, each byte-equal, "
        "nothing left over |",
        f"| «{_total(instants, 1)}» kills in «{len(instants)}» configurations, each byte-equal |",
        f"of all | «{kills[0]}» kills, byte-equal |",
        f"(PPO, constant curvature) | «{_total(workers, 0)}» events, byte-equal |",
        f"| «{_total(flips, 1)}» of «{_total(flips, 0)}» seen |",
        f"in the place of «{pickles[0][0]}» files of a run folder | «{pickles[0][1]}» executed |",
        f"stopped within «{max(float(s[0]) for s in stops):.1f}» s",
        f"«{closed[0][0]}» times made and closed: scalar and batch, both physics | grown by "
        f"«{span([float(c[1]) for c in closed], 1)}» MB",
        f"«{drawn[0][0]}» times drawn and forgotten: scalar, batch | grown by "
        f"«{span([float(d[1]) for d in drawn], 1)}» MB",
        f"the spacing of `configs/train/reach_clarke.yaml` take «{number(share, 1)}» % of its",
        *_curves(),
    ]


def use_with() -> list[str]:
    """Return the sentences of docs/use_with.md."""
    told = measured("use_with")

    def reached(name: str) -> list[str]:
        return [number(share) for share in told[name]["reached"]]

    def steps(name: str) -> str:
        (found,) = re.findall(r"(\d+) steps", told[name]["says"][-1])
        return f"{int(found):,}"

    raw, clarke = reached("with_minari")
    views = [re.findall(r"\[(.+), (.+)\]", line)[0] for line in told["with_minari"]["says"][-2:]]
    defaults = told["defaults of SB3"]
    versions = told["versions"]
    torch = ".".join(versions["torch"].split(".")[:2])
    return [
        f"| Stable-Baselines3 | «{versions['stable_baselines3']}» | `with_sb3_sac_her.py`",
        f"| Stable-Baselines3 | «{versions['stable_baselines3']}» | [Get started]",
        f"| torch «{torch}» | `with_cleanrl_ppo.py`",
        f"| TorchRL | «{versions['torchrl']}» |",
        f"| skrl | «{versions['skrl']}» |",
        f"| Minari | «{versions['minari']}» |",
        f"| ONNX | «{versions['onnx']}» |",
        f"`DummyVecEnv`, sparse reward, «{steps('with_sb3_sac_her')}» steps | "
        f"«{reached('with_sb3_sac_her')[0]}» |",
        f"`gym.make_vec`, «{steps('with_cleanrl_ppo')}» steps | "
        f"«{reached('with_cleanrl_ppo')[0]}» |",
        f"`ClipPPOLoss` and `GAE`, «{steps('with_torchrl')}» steps | "
        f"«{reached('with_torchrl')[0]}» |",
        f"`SequentialTrainer`, «{steps('with_skrl')}» steps | «{reached('with_skrl')[0]}» |",
        f"cloned raw and Clarke | «{raw}» and «{clarke}» |",
        "networks each, "
        + " and ".join(f"[«{number(float(a))}», «{number(float(b))}»]" for a, b in views)
        + ": no difference shown",
        f"PPO defaults reached «{number(min(defaults))}» and «{number(max(defaults))}» of the",
    ]


def explorer() -> list[str]:
    """Return the sentences of docs/explorer.md."""
    told, said = measured("explorer_frames"), []
    for shown, case in (
        ("desk, one segment of 7 tendons", "desk_one_segment_7_tendons"),
        ("desk, three segments of 32", "desk_three_segments_32_tendons"),
        ("phone, one segment of 7", "phone_one_segment_7_tendons"),
    ):
        frames = [told[f"{case}_{kind}_frames_per_s"] for kind in ("canvas", "webgl")]
        first = told[f"{case}_canvas_first_picture_ms"] / 1e3
        said.append(f"| {shown} | «{frames[0]:.0f}» | «{frames[1]:.0f}» | «{first:.1f}» s |")
    return said
