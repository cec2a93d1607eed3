"""What pages say of the physics: its validation, and what it costs."""

from __future__ import annotations

from agents.reporting.wording import number
from benchmarks.prose.sources import rows, span, validated
from clarke_gym.robots import make_robot
from clarke_gym.robots.stiffness import bending_stiffness

SPEED, CLASSICAL, SOAK = (
    f"validation/{name}.md" for name in ("physics_speed", "classical_control", "physics_soak")
)
BOTH = ("fast", "accurate")


def _one(part: str, case: str, conditions: str = "", unit: str = "") -> float:
    return validated(part, case, conditions, unit)[0]


def _motion(profile: str, commands: str) -> str:
    """Return what the time step does to paths of one, two and three segments [% of length]."""
    found = validated("motion", "tip path RMS to 0.1 ms", f"{profile}, {commands}")
    return " / ".join(number(value, 3) for value in found)


def _recorded(part: str, conditions: str, digits: int = 2) -> tuple[str, str, str]:
    """Return a mean tip error of the recorded robot and the ends of its interval [mm]."""
    mean = _one(part, "mean tip error", conditions, "mm")
    low, high = (
        _one(part, f"the same, 95 % interval, {end}", conditions) for end in ("low", "high")
    )
    return number(mean, digits), number(low, 1), number(high, 1)


def _in_mm(part: str, conditions: str, digits: int = 2) -> str:
    """Return the same as a piece of a sentence."""
    return "«{}» mm [«{}», «{}»]".format(*_recorded(part, conditions, digits))


def _table() -> list[str]:
    """Return the rows of the table of what was reached."""
    rod, chord = (
        {
            profile: [
                _one("cosserat", f"{which} tip error to {theory}", f"{profile}, {routing}, 33")
                for which in ("median", "worst")
            ]
            for profile in BOTH
        }
        for theory, routing in (("CR", "ideal routing"), ("SSCR", "chord routing"))
    )
    ends = [span(list(values), 2) for values in zip(*chord.values(), strict=True)]
    statics = [
        [_one("statics", "mean tip error", f"{what}, {joints} joints") for joints in (24, 48)]
        for what in ("spring steel", "TPU")
    ]
    beam = [_one("beam", case, "steel rod, 24 joints") for case in ("F L^3", "first bending")]
    bend = [max(validated("bend", "n = ", profile)) for profile in BOTH]
    slow, plain = (
        "identified, 12 physical parameters, val.csv",
        "constant curvature, frame fitted, val.csv",
    )
    quiet = "no gravity, identified numbers, val.csv"
    percent = [_one("hardware_mujoco", "mean tip error", f"{p}, {quiet}", "% L") for p in BOTH]
    hanging, standing = (
        "«{} [{}, {}]»".format(*_recorded("hardware_mujoco", f"fast, {way}, identified"))
        for way in ("hanging", "standing")
    )
    said = [
        f"worst «{number(bend[0])}» % (`fast`), «{number(bend[1])}» % (`accurate`)",
        f"median «{number(rod['fast'][0], 3)}» %, worst «{number(rod['fast'][1])}» % of length "
        f"(`fast`), «{number(rod['accurate'][0], 3)}» %, «{number(rod['accurate'][1])}» %",
        f"median «{ends[0]}» %, worst «{ends[1]}» % of length (both profiles)",
        f"mean «{number(statics[0][0], 3)} / {number(statics[1][0], 3)}» % of length at 24 joints, "
        f"«{span([statics[0][1], statics[1][1]], 3)}» % at 48",
        f"worst path RMS «{number(max(validated('release', 'worst tip path RMS')))}» % of length, "
        f"first frequency within «{number(max(validated('release', 'worst error of')))}» %",
        f"Euler-Bernoulli | «{number(beam[0], 3)}» %, «{number(beam[1], 3)}» %",
        f"{_in_mm('hardware', slow)} = "
        f"«{number(_one('hardware', 'mean tip error', slow, '% L'))}» % of length (root mean "
        f"square «{number(_one('hardware', 'root mean square', slow))}» mm); plain constant "
        f"curvature {_in_mm('hardware', plain, 1)}",
        f"{_in_mm('hardware_mujoco', f'fast, {quiet}')} = «{span(percent)}» % (`fast` and "
        f"`accurate`, no gravity); hanging {hanging}, standing {standing}",
    ]
    for commands, what in (
        ("Clarke, full speed", "RMS «{}» % of length (`fast`), «{}» (`accurate`)"),
        (
            "raw, random",
            "raw random commands | same model at 0.1 ms | «{}» (`fast`), «{}» (`accurate`)",
        ),
        ("raw, alternating", "limit to limit | same model at 0.1 ms | «{}» (`fast`), «{}»"),
    ):
        said.append(what.format(*(_motion(profile, commands) for profile in BOTH)))
    return said


def validation() -> list[str]:
    """Return the sentences of docs/validation/README.md."""
    quiet = "fast, no gravity, identified numbers, val.csv"
    gap = {
        which: _one("hardware_mujoco", f"{which} gap to the quasi", quiet)
        for which in ("mean", "largest")
    }
    stiffness = validated("hardware", "stiffness ratio", "identified")
    preset = [
        2.0
        * bending_stiffness(segment)
        / (segment.n_tendons * segment.tendon_stiffness_n_m)
        / (segment.pitch_radius_m**2 * segment.length_m)
        for segment in make_robot("hardware").segments
    ]
    aligned = _one(
        "hardware",
        "mean tip error, mean offset removed",
        "identified, 12 physical parameters, val.csv",
    )
    slack = {
        ms: validated("motion", f"fast, repeated control steps in time steps of {ms} ms")
        for ms in ("5", "1", "0.5", "0.25", "0.2")
    }
    paths = {ms: values[::2] for ms, values in slack.items()}
    worst = [
        max(validated("motion", "largest tip gap to 0.1 ms", f"{profile}, raw")) for profile in BOTH
    ]
    soak = next(r for r in rows(SOAK) if r["policy"] == "all")
    overhead = [r for r in rows(SPEED) if r.get("profile") in BOTH]
    hard = next(
        r for r in overhead if (r["profile"], r["segments"], r["batch"]) == ("fast", "1", "1")
    )
    others = [float(r["ratio"]) for r in overhead if r["batch"] == "1" and r is not hard]
    batches = [float(r["ratio"]) for r in overhead if r["batch"] == "64"]
    return [
        *_table(),
        f"on average «{number(gap['mean'])}» mm from that model, «{number(gap['largest'], 1)}» mm "
        "at most",
        f"are far stiffer («{span(preset, 3)}» a segment)",
        f"identified ones (stiffness ratios «{span(stiffness)}»)",
        f"is removed, «{number(aligned)}» mm here",
        f"«{number(_one('gap', 'largest tip gap', 'default, accurate, no gravity'))}» % of length "
        f"without gravity, up to "
        f"«{number(_one('gap', 'largest tip gap', 'default, accurate, horizontal, 10 g'), 1)}» %",
        f"up to «{max(validated('gap', 'largest tip gap', 'soft_arm')):.0f}» % for the soft arm",
        f"of 5 ms slack paths were «{span(paths['5'], 1)}» % RMS away; 1 ms leaves up to "
        f"«{number(max(paths['1']))}» %, 0.5 ms «{number(max(paths['0.5']), 1)}» %",
        f"path was «{number(worst[0])}» % (`fast`) and «{number(worst[1])}» % (`accurate`)",
        f"Soak: «{soak['control steps']}» environment steps",
        f"hardest case (ratio «{hard['ratio']}»), «{hard['over the bare loop'].split()[0]}» "
        "microseconds over its physics",
        f"slack in part of their steps, take «{span(slack['0.25'][1::2], 1)}» times as long",
        f"segments are at «{span(others)}», batches of 64 at «{span(batches)}»",
    ]


def robots() -> list[str]:
    """Return the sentences of docs/robots_and_physics.md."""
    speed = [r for r in rows(SPEED) if "fast, taut" in r]
    of = {(r["segments"], r["tendons a segment"]): r for r in speed}
    over = [float(r["over n = 3"]) for r in speed if r["tendons a segment"] == "32"]
    slack = [
        float(r["fast, taut"].replace(",", "")) / float(r["fast, slack"].replace(",", ""))
        for r in speed
    ]
    kept = [
        value
        for commands in ("raw, random", "raw, alternating")
        for value in validated("motion", "tip path RMS to 0.1 ms", f"fast, {commands}")
    ]
    worst = {
        physics: max(
            float(r[column])
            for r in rows(CLASSICAL)
            if r["physics"] == physics
            for column in ("worst", "worst of the others")
        )
        for physics in ("constant_curvature", "mujoco")
    }
    quiet = "fast, no gravity, identified numbers, val.csv"
    percent = _one("hardware_mujoco", "mean tip error", quiet, "% L")
    simple, long = of["1", "3"], of["3", "8"]
    return [
        f"cost what 3 cost (measured: «{span(over)}» times)",
        f"within «{number(max(kept))}» % of the length (RMS)",
        f"costs «{min(slack):.0f} to {max(slack):.0f}» times a taut step",
        f"On one core: «{simple['fast, taut']}» control steps a second of 20 ms for one segment "
        f"with 3 tendons, «{long['fast, taut']}» for three segments with 8 tendons each, batch 64; "
        f"«{simple['fast, slack']}» and «{long['fast, slack']}» where tendons are slack",
        f"within «{number(worst['constant_curvature'])}» % of the length with constant curvature "
        f"and «{number(worst['mujoco'])}» % on MuJoCo",
        f"another to {_in_mm('hardware_mujoco', quiet, 1)} on average, "
        f"«{number(percent, 1)}» % of the length",
    ]
