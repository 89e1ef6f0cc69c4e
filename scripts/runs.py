"""What commands wrote, to the figures that README and documents quote: one entry of :data:`RUNS` for each command.

Only names that a page quotes are kept, with the command, the day and the machine; see :mod:`measured`. To bind a
further figure, name it in a page and let one of these functions find it.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from measured import RESULTS, figures_of

MACHINE = "two cores of a shared cloud machine"
METRICS = {"nupe": "nUPE", "ncpe": "nCPE"}

Figures = dict[str, Any]
Data = Mapping[str, Any]


class Run(NamedTuple):
    """A command, the files of it, and what they say."""

    command: str
    files: str
    figures: Callable[[list[Any]], Figures]


def _by(rows: Iterable[Data], *keys: str) -> dict[Any, Data]:
    return {tuple(one[key] for key in keys): one for one in rows}


def table1(found: list[Data]) -> Figures:
    """Each method and constraint, the paper's values, and ratios of means."""
    rows = _by(found[0]["rows"], "constraint", "method")
    figures = {}
    for (constraint, method), row in rows.items():
        for metric, label in METRICS.items():
            name = f"{constraint}, {method}: {label}"
            figures[name], figures[f"{name}, median"] = row[f"{metric}_mean"], row[f"{metric}_median"]
            if f"paper_{metric}_mean" in row:
                figures[f"{name}, paper"] = row[f"paper_{metric}_mean"]
                figures[f"{name}, paper ±"] = [row[f"paper_{metric}_mean"], row[f"paper_{metric}_sd"]]
            if constraint == "none" and method == "inconsistency":
                figures[f"{name}, plain"] = row[f"{metric}_mean"]
            for other in ("direct", "inconsistency"):
                ratio = row[f"{metric}_mean"] / rows[constraint, other][f"{metric}_mean"]
                figures[f"{name} / {other}'s"] = ratio
    return figures


def table1_seeds(found: list[Data]) -> Figures:
    """Each figure of Table I over the seeds: all of them, and from least to largest."""
    each = [table1([one]) for one in sorted(found, key=lambda one: one["settings"]["seed"])]
    every = {name: [one[name] for one in each] for name in each[0] if "paper" not in name}
    return every | {f"{name}, range": [min(values), max(values)] for name, values in every.items()}


def figure5(found: list[Data]) -> Figures:
    """The hybrid against the better of the other two; errors at the widest angle and the least, in hundredths."""
    figures: Figures = {"data sets": found[0]["settings"]["trials"]}
    for drawn, table in (("each step", "rows"), ("each trajectory", "per_trajectory")):
        rows = _by(found[0][table], "method", "theta_max")
        widest = sorted({angle for _, angle in rows})
        for metric, label in METRICS.items():
            mean = {key: row[f"{metric}_mean"] for key, row in rows.items()}
            worst = max(mean["hybrid", w] / min(mean["direct", w], mean["inconsistency", w]) for w in widest)
            figures[f"{drawn}: {label}, worst ratio"] = worst
            for method in ("direct", "inconsistency", "hybrid"):
                figures[f"{drawn}, {method}: 100 {label}, widest"] = 100 * mean[method, widest[-1]]
                figures[f"{drawn}, {method}: 100 {label}, least"] = 100 * min(mean[method, w] for w in widest)
    return figures


def table2(found: list[Data]) -> Figures:
    """Errors with 1 to 6 coordinates held, in hundredths; how many printed values are met; what the Jacobian brings."""
    from unconstrain.paper.experiments.table2 import JACOBIAN, METHODS, READINGS, agreement

    rows, figures = found[0]["rows"], {}
    for reading in READINGS:
        of_reading = [one for one in rows if one["method"] in [method + reading for method in METHODS]]
        near, count = agreement(of_reading)
        figures |= {f"near{reading}": near, f"near{reading}, of all": [near, count], "printed": count}
    for method in dict.fromkeys(one["method"] for one in rows):
        mine = [one for one in rows if one["method"] == method]
        for metric, label in METRICS.items():
            for kind in ("mean", "median"):
                values = [100 * one[f"{metric}_{kind}"] for one in mine]
                figures[f"{method}: 100 {label}{', median' * (kind == 'median')}"] = values
            figures[f"{method}: 100 {label}, paper"] = [100 * one[f"paper_{metric}_mean"] for one in mine]
    fresh = [one for one in rows if one["method"] in [f"{method}, fresh" for method in METHODS]]
    more = [one["ncpe_mean"] / one["paper_ncpe_mean"] for one in fresh]
    known = _by(found[0]["jacobian_known"], "method", "constraint")
    shown = ("1", "1-2-3", "1-...-4", "1-...-5")
    figures["Jacobian known: 100 nUPE"] = [100 * known[JACOBIAN, held]["nupe_mean"] for held in shown]
    figures["hybrid beside it: 100 nUPE, paper"] = [100 * known["hybrid, fresh", h]["paper_nupe_mean"] for h in shown]
    return figures | {"fresh: nCPE / paper's, range": [min(more), max(more)]}


def washing(found: list[Data]) -> Figures:
    """Mean errors on unseen surfaces, and of what the arm wiped there the worst run."""
    unseen, figures = [row for row in found[0]["rows"] if not row["seen"]], {}
    for normals in dict.fromkeys(row.get("normal") for row in unseen):
        of = f", {normals} normals" * (normals is not None)
        for metric, label in METRICS.items():
            rows = [row for row in unseen if row.get("normal") == normals and row[metric] is not None]
            mean = {
                method: float(np.mean([row[metric] for row in rows if row["method"] == method]))
                for method in dict.fromkeys(row["method"] for row in rows)
            }
            for method, value in mean.items():
                figures[f"{method}: {label}{of}"] = value
                figures[f"{method}: {label} / direct's{of}"] = value / mean["direct"]
    wiped = [row for row in found[0]["reproduction"] if not row["seen"] and not row["failed"]]
    if wiped:
        figures["arm: contact, %"] = 100 * min(row["contact_share"] for row in wiped)
        figures["arm: force s.d. / mean"] = max(row["force_sd"] / row["force_mean"] for row in wiped)
        figures["arm: drift, mm"] = 1e3 * max(row["drift_m"] for row in wiped)
    return figures


def arrival(found: list[Data]) -> Figures:
    """Areas and distances after time warping in the mean over the shapes, and what guiding costs for each of them."""
    figures: Figures = {}
    for way in ("guided", "contracting", "stable"):
        mine = [one for one in found[0]["ways"] if one["way"] == way]
        figures |= {f"{way}: {what}": float(np.mean([one[what] for one in mine])) for what in ("area", "dtw")}
    for one in found[0]["prices"]:
        figures |= {f"{one['shape']}: price, {step}": one[step] for step in one if step != "shape"}
    areas = {
        way: np.array([one["area"] for one in found[0]["ways"] if one["way"] == way]) for way in ("guided", "stable")
    }
    ratios, prices = areas["guided"] / areas["stable"], [one["nupe_ratio"] for one in found[0]["rows"]]
    alone = [one["area_ratio"] for one in found[0]["rows"] if one["area_ratio"] is not None]
    return figures | {
        "guided / stable: area, median": float(np.median(ratios)),
        "guided / stable: area, above 1.2": int((ratios > 1.2).sum()),
        "guided / unguided: area, median": float(np.median(alone)),
        "guided / unguided: area, worst": max(alone),
        "price: worst": max(prices),
        "price: mean": float(np.mean(prices)),
    }


def arrival_cycles(found: list[Data]) -> Figures:
    """Corrections at the states of recorded bouts, each alone, and what is off after a hundred turns."""
    bouts = [one for one in found[0]["cycles"] if re.fullmatch(r"[A-D]\d", one["cycle"])]
    shares = [100 * one["correction"] for one in bouts]
    return {
        "bouts: correction, %": [min(shares), max(shares)],
        "bouts: pace off, %": 100 * max(abs(one["pace_off"]) for one in bouts),
    }


def regimes(found: list[Data]) -> Figures:
    """Each learner against the paper's hybrid and the oracle; coverage; the limit cycle, half free, and the arm."""
    figures = {} if found[0]["settings"]["only"] else _over_regimes(found[0])
    trials = found[0]["settings"]["trials"]
    for one in found[0]["rows"]:
        name = f"{one['method']}, {one['system']}, {one['constraint']}, {one['noise']:.0%}"
        figures[f"{name}: nUPE, geometric mean"], figures[f"{name}: nUPE"] = one["nupe_geometric"], one["nupe_mean"]
        figures[f"{name}: nUPE, standard error"] = one["nupe_sd"] / trials**0.5
        figures[f"{name}: coverage, %"] = 100 * (one["coverage_mean"] or 0.0)
    known = found[0]["jacobian_known"]
    for noise in found[0]["settings"]["noise"]:
        means = [100 * one["nupe_mean"] for one in known if one["noise"] == noise]
        figures[f"Jacobian known, {noise:.0%}: 100 nUPE"] = means
    return figures


def regimes_in_the_plane(found: list[Data]) -> Figures:
    """The default learner against the paper's hybrid, between what was learnt from and at fresh demonstrations."""
    mine = [one for one in found[0]["summary"] if one["method"] == "robust"]
    return {
        f"robust, {one['noise']:.0%}: / paper's{at}": one[key]
        for one in mine
        for at, key in (("", "to_paper"), (", fresh", "to_paper_fresh"))
    }


def _over_regimes(found: Data) -> Figures:
    """What is said of all regimes, and so not of some."""
    figures: Figures = {}
    for one in found["summary"]:
        name = f"{one['method']}, {one['noise']:.0%}"
        figures |= {f"{name}: / paper's": one["to_paper"], f"{name}: worst / oracle": one["worst_to_oracle"]}
    mine = [one for one in found["rows"] if one["method"] == "robust"]
    for noise in sorted({one["noise"] for one in mine}):
        covered = [100 * one["coverage_mean"] for one in mine if one["noise"] == noise and one["coverage_mean"]]
        figures[f"coverage, {noise:.0%}: mean, %"] = float(np.mean(covered))
        figures[f"coverage, {noise:.0%}: range, %"] = [min(covered), max(covered)]
    told = [one["auc_mean"] for one in mine if one["auc_mean"] is not None]
    return figures | {"free told apart: least area": min(told)}


def recorded(found: list[Data]) -> Figures:
    """The default learner against the safe ones, over kinds of constraints; and with wrong actions against none."""
    safe = {(one["kind"], one["policy"]): one["to_safe"] for one in found[0]["rows"]}
    mixed = [value for (kind, _), value in safe.items() if kind == "recorded, rows shuffled"]
    drawn = [v for (kind, _), v in safe.items() if kind.startswith("recorded, ") and "shuffled" not in kind]
    inside = [value for (kind, _), value in safe.items() if kind == "recorded, shuffled inside"]
    every = [*drawn, *inside]
    cost = {one["kind"]: one["cost"] for one in found[0]["kinds"] if one.get("cost") is not None}
    return {
        "data sets": found[0]["settings"]["trials"],
        "robust / safe, range": [min(every), max(every)],
        "robust / safe, rows shuffled": sorted(mixed),
        "wrong actions: error / without": [
            cost[kind] for kind in ("one bad sample", "1 % bad samples") if kind in cost
        ],
    }


def constraints(found: list[Data]) -> Figures:
    """Errors of learnt constraints by generator, features and noise; ranks; the fingertip, the rim, mechanisms."""
    figures: Figures = {}
    rows = found[0]["rows"]
    for task, features in dict.fromkeys((one["task"], one["features"]) for one in rows):
        mine = [one for one in rows if (one["task"], one["features"]) == (task, features)]
        for one in mine:
            figures[f"{task}, {features}, {one['noise']:.0%}: nPPE"] = one["nppe"]
    figures["rank right, %"] = 100 * min(one["rank_right"] for one in rows)
    off = [abs(one["noise_found"] - 1.0) for one in rows if one["noise_found"] is not None]
    figures["noise found, off by at most, %"] = 100 * max(off)
    figures["data sets"] = found[0]["settings"]["trials"]
    if tip := found[0].get("recorded"):
        figures["fingertip: seconds held out"] = [one["s_each"] for one in tip]
        figures["fingertip: nPOE"] = [one["npoe"] for one in tip]
    figures |= {f"component, {one['way']}: error": one["error"] for one in found[0]["component"]}
    return figures | _mechanisms(found[0]["mechanisms"][-1]) | _rim(found[0].get("normals", []))


def _mechanisms(every: Data) -> Figures:
    return {
        "mechanisms": every["mechanisms"],
        "mechanisms: named rightly": round(every["right"] * every["mechanisms"]),
        "mechanisms: inside their intervals, %": 100 * every["inside"],
        "mechanisms: parameters": every["parameters"],
        "mechanisms: confident": every["confident"],
        "mechanisms: confident and wrong": every["confident_and_wrong"],
    }


def _rim(bouts: list[Data]) -> Figures:
    figures = {}
    for name, mine in (
        ("flat", [one for one in bouts if one["bout"].startswith("A")]),
        ("tilted", [one for one in bouts if not one["bout"].startswith("A")]),
    ):
        for column, unit, factor in (
            ("angle", "°", 1.0),
            ("off_plane", "mm", 1e3),
            ("angle_curved", "°", 1.0),
            ("off_curved", "mm", 1e3),
        ):
            values = [factor * one[column] for one in mine]
            if values:
                figures[f"rim, {name}: {column}, {unit}"] = [min(values), max(values)]
    return figures


def bench(found: list[Data]) -> Figures:
    """Rows of benchmarks by what they say."""
    tables = [one["rows"] if isinstance(one, Mapping) else one for one in found]
    return {row["what"]: row["value"] for rows in tables for row in rows}


def recordings(found: list[Data]) -> Figures:
    """Benchmarks of recordings: rows, and the worst of some."""
    rows = bench(found)
    alarms = {what.split(", ")[-1]: value for what, value in rows.items() if what.startswith("false alarms")}
    hands = alarms.pop("libras_hand", None)
    return rows | {
        "false alarms on strokes, contours and wiping, %": max(alarms.values(), default=None),
        "false alarms on hands, %": hands,
        "turns: largest error of speed, %": max(value for what, value in rows.items() if "largest error of" in what),
    }


def faults(found: list[str]) -> Figures:
    """Faults put in: how many were found, of all and of the worst kind, and sets of which something false is said."""
    lines = re.findall(r"^(\w+) +(\d+) found +(\d+) rows +(\d+) false", found[0], re.MULTILINE)
    sets = 200
    seen = {name: 100 * int(number) / sets for name, number, *_ in lines if not name.startswith("nothing")}
    worst = min(seen, key=lambda name: seen[name])
    return {
        "found, %": float(np.mean(list(seen.values()))),
        "found of the worst kind, %": seen[worst],
        "sets of which something false is said, %": 100 * sum(int(wrong) for *_, wrong in lines) / (sets * len(lines)),
    }


def fuzz(found: list[str]) -> Figures:
    """Attacks: how often each was tried, for how long in all, and faults, hangs and crashes."""
    row = re.compile(r"^(\w[\w ]*?) {2,}(\d+) +\d+ +(\d+) +\d+ +\d+ +(\d+) s$", re.MULTILINE)
    tried: Figures = {"faults": 0, "minutes": 0.0}
    for name, *numbers in row.findall(found[0]):
        number, wrong, seconds = map(int, numbers)
        attack = f"{'file' if name.startswith('file ') else name}: tried"
        tried[attack] = tried.get(attack, 0) + number
        tried["faults"] += wrong  # hangs and crashes among them
        tried["minutes"] += seconds / 60
    return tried


RUNS = {
    "table1": Run("unconstrain reproduce table1 --out results", "table1.json", table1),
    "table1_seeds": Run(
        "for seed in 0 1 2 3 4; unconstrain reproduce table1 --seed $seed --out results/seed$seed",
        "seed*/table1.json",
        table1_seeds,
    ),
    "figure5": Run("unconstrain reproduce figure5 --out results", "figure5.json", figure5),
    "figure5_five": Run("unconstrain reproduce figure5 --trials 5 --out results/five", "five/figure5.json", figure5),
    "table2": Run("unconstrain reproduce table2 --out results", "table2.json", table2),
    "demo": Run("unconstrain demo --out results/demo", "demo/washing.json", washing),
    "demo_real": Run("unconstrain demo --real --out results/real", "real/washing.json", washing),
    "arrival": Run("unconstrain reproduce arrival --out results", "arrival.json", arrival),
    "arrival_cycles": Run(
        "unconstrain reproduce arrival --only cycles --out results/cycles", "cycles/arrival.json", arrival_cycles
    ),
    "regimes": Run("unconstrain reproduce regimes --trials 4 --out results", "regimes.json", regimes),
    "recorded": Run("unconstrain reproduce recorded --out results", "recorded.json", recorded),
    "constraints": Run("unconstrain reproduce constraints --out results", "constraints.json", constraints),
    "bench": Run("make bench BENCH='--out results/bench.json'", "bench.json", bench),
    "bench_full": Run(
        "make bench BENCH='--full --only streaming --out results/full/bench.json'", "full/bench.json", bench
    ),
    "default_fit": Run("python benchmarks/default_fit.py --rows results/default_fit.json", "default_fit.json", bench),
    "widths": Run("python benchmarks/widths.py --rows results/widths.json", "widths.json", bench),
    "limit_cycle": Run(
        "unconstrain reproduce regimes --only 'limit cycle, half' --trials 100 --out results/cycle",
        "cycle/regimes.json",
        regimes,
    ),
    "regimes_plane": Run(
        "unconstrain reproduce regimes --only 'limit cycle' --only pendulum --trials 4 --out results/plane",
        "plane/regimes.json",
        regimes_in_the_plane,
    ),
    "regimes_known": Run(
        "unconstrain reproduce regimes --only 'arm, 1' --only 'arm, 1-2-3' --only 'arm, 1-...-4' --only 'arm, 1-...-5' "
        "--trials 3 --out results/known",
        "known/regimes.json",
        regimes,
    ),
    "recordings": Run("python benchmarks/recordings.py --rows results/recordings.json", "recordings.json", recordings),
    "recordings_large": Run(
        "python benchmarks/recordings.py --megabytes 1000 --rows results/large/recordings.json",
        "large/recordings.json",
        recordings,
    ),
    "faults": Run("python tests/faults.py 200 > results/faults.txt", "faults.txt", faults),
    "fuzz": Run("make fuzz FUZZ='--long --seconds 0' > results/fuzz.txt", "fuzz.txt", fuzz),
}
"""By the name of the file in ``docs/results``; files are looked for in the folder that is taken in."""


def take(folder: Path, quoted: Mapping[str, set[str]]) -> Iterator[str]:
    """Keep what is quoted of the runs in a folder; a line for each."""
    for name, run in RUNS.items():
        paths = sorted(folder.glob(run.files))
        if not paths:
            continue
        every = run.figures([_read(path) for path in paths])
        kept = RESULTS / f"{name}.json"
        before = figures_of(kept) if kept.is_file() else {}
        names = quoted.get(name, set())
        figures = {one: every.get(one, before.get(one)) for one in sorted(names) if one in every or one in before}
        keep(kept, run.command, datetime.fromtimestamp(max(path.stat().st_mtime for path in paths), UTC), figures)
        yield f"{name}: {len(set(figures) & set(every))} of {len(names)} figures that are quoted"


def _read(path: Path) -> Any:
    text = path.read_text("utf-8")
    return json.loads(text) if path.suffix == ".json" else text


def keep(path: Path, command: str, day: datetime, figures: Figures) -> None:
    """Write figures beside the command, the day and the machine."""
    said = {"command": command, "date": f"{day:%Y-%m-%d}", "version": version("unconstrain"), "machine": MACHINE}
    rounded = {name: _rounded(value) for name, value in figures.items()}
    path.write_text(json.dumps(said | {"figures": rounded}, indent=1, ensure_ascii=False) + "\n", "utf-8")


def _rounded(value: Any) -> Any:
    """Six digits: more than anybody quotes."""
    return [_rounded(one) for one in value] if isinstance(value, list) else float(f"{value:.6g}")
