#!/usr/bin/env python3
"""Which part of a response does the work: a summary that no section of a report has yet.

  bench/ablation.py reports/ablation_contacts/results.csv.gz

Shares of the variance of log(worst residual penetration + 0.02 edge) that each factor explains, as an analysis of
variance with the scene as block, and the ratio of geometric means of the two laws at their best stiffness with a 90 %
interval, bootstrapped over scenes. The edge is 5 mm, that of the scenes. Then what the relaxation time, the force limit
and the stepper change as single steps from the best cell, which are confounded with the law.
"""
import csv
import gzip
import math
import random
import statistics
import sys
from collections import defaultdict

OFFSET_MM = 0.02 * 5.0


def read(path):
    """Closed loops with `law`, NAME:key=value as on a command line, from the columns response and response.KEY."""
    opened = gzip.open if path.endswith(".gz") else open
    with opened(path, "rt", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["mode"] == "closed_loop"]
    for row in rows:
        given = [f"{key.removeprefix('response.')}={value}" for key, value in sorted(row.items())
                 if key.startswith("response.") and value]
        row["law"] = row["response"] + (":" + ",".join(given) if given else "")
    return rows


def number(row, name):
    text = row.get(name, "")
    return float(text) if text not in ("", "nan", "NaN", "NA", "n/a") else math.nan


def log_depth(row):
    return math.log(1e3 * number(row, "residual_penetration_max_m") + OFFSET_MM)


def parameters(method):
    name, _, rest = method.partition(":")
    return name, dict(item.split("=", 1) for item in rest.split(",") if "=" in item)


def factors_of(row):
    name, given = parameters(row["law"])
    return {"side information": row["contacts"], "look-ahead": given.get("look_ahead", "0.1"),
            "stiffness": given.get("k", "auto"), "law": name}


def step_of(row):
    """What a run changes beside the factors; empty: nothing."""
    _, given = parameters(row["law"])
    usual = "0.02" if given.get("k") == "100" else "0.003"
    changes = []
    if given.get("relaxation_time") != usual:
        changes.append("relaxation time " + given["relaxation_time"])
    if given.get("pressure") == "none":
        changes.append("no force limit")
    if row["stepper"]:
        changes.append("stepper " + row["stepper"])
    return ", ".join(changes)


def ablation(rows):
    cells, failed = [], 0
    steps = defaultdict(dict)
    for row in rows:
        if row["contacts"] not in ("proximity", "tracked_proximity"):
            continue
        step = step_of(row)
        if step:
            if row["contacts"] == "tracked_proximity":
                steps[(factors_of(row)["law"], step)][row["scene"]] = row
            continue
        if row["outcome"] != "ok" or math.isnan(number(row, "residual_penetration_max_m")):
            failed += 1
        cells.append((factors_of(row), row["scene"], row))
    # A failed run counts as the deepest of its scene: infinite has no logarithm.
    deepest = {scene: max(log_depth(r) for _, s, r in cells if s == scene and r["outcome"] == "ok")
               for scene in {s for _, s, _ in cells}}
    value = [(f, s, log_depth(r) if r["outcome"] == "ok" else deepest[s]) for f, s, r in cells]
    names = list(cells[0][0])

    def shares(data):
        scene_mean = {s: statistics.fmean(v for _, t, v in data if t == s) for s in {s for _, s, _ in data}}
        centred = [(f, v - scene_mean[s]) for f, s, v in data]
        total = sum(v * v for _, v in centred)
        result = {}
        for name in names:
            groups = defaultdict(list)
            for f, v in centred:
                groups[f[name]].append(v)
            result[name] = sum(len(g) * statistics.fmean(g) ** 2 for g in groups.values()) / total
        result["interactions and rest"] = 1.0 - sum(result.values())
        return result

    scenes = sorted({s for _, s, _ in value})
    by_scene = {s: [one for one in value if one[1] == s] for s in scenes}
    generator = random.Random(1)

    def drawn(index):
        return [(f, (index, i), v) for i, s in enumerate(generator.choices(scenes, k=len(scenes)))
                for f, _, v in by_scene[s]]

    draws = [shares(drawn(i)) for i in range(500)]
    print(f"{len(value)} runs on {len(scenes)} scenes, {failed} failed (counted as the deepest of their scene).\n")
    print("| factor | share of variance | 90 % interval over scenes |")
    print("|---|---:|---:|")
    for name, share in shares(value).items():
        sample = sorted(one[name] for one in draws)
        print(f"| {name} | {100 * share:.0f} % | {100 * sample[25]:.0f} to {100 * sample[474]:.0f} % |")
    print("\n| cell | geometric mean (mm) |\n|---|---:|")
    groups = defaultdict(list)
    for f, _, v in value:
        groups[tuple(f.values())].append(v)
    for cell, logs in sorted(groups.items(), key=lambda item: statistics.fmean(item[1])):
        print(f"| {', '.join(cell)} | {math.exp(statistics.fmean(logs)) - OFFSET_MM:.3g} |")
    stiffest = max({f["stiffness"] for f, _, _ in value}, key=float)
    top = {(f["law"], s): v for f, s, v in value
           if f["side information"] == "tracked_proximity" and f["look-ahead"] != "scripts" and f["stiffness"] == stiffest}
    laws = sorted({law for law, _ in top}, reverse=True)
    if len(laws) == 2:
        differences = [top[(laws[1], s)] - top[(laws[0], s)] for s in scenes]
        boot = sorted(math.exp(statistics.fmean(generator.choices(differences, k=len(differences))))
                      for _ in range(2000))
        ratio = math.exp(statistics.fmean(differences))
        verdict = "equivalent" if boot[100] >= 0.8 and boot[1899] <= 1.25 else "not shown to be equivalent"
        print(f"\n{laws[1]} / {laws[0]} with tracked_proximity contacts, look-ahead and k = {stiffest}: {ratio:.2f}, 90 % interval "
              f"{boot[100]:.2f} to {boot[1899]:.2f}: {verdict} (0.8 to 1.25).")
    print("\n| single step from the best cell | law | geometric mean (mm) | failed | ratio of depths, 90 % interval |")
    print("|---|---|---:|---:|---:|")
    for (law, step), runs in sorted(steps.items()):
        sound = {s: log_depth(row) for s, row in runs.items() if row["outcome"] == "ok"}
        differences = [value - top[(law, s)] for s, value in sorted(sound.items())]
        boot = sorted(math.exp(statistics.fmean(generator.choices(differences, k=len(differences))))
                      for _ in range(2000))
        print(f"| {step} | {law} | {math.exp(statistics.fmean(sound.values())) - OFFSET_MM:.3g} | {len(runs) - len(sound)} "
              f"| {math.exp(statistics.fmean(differences)):.2f} ({boot[100]:.2f} to {boot[1899]:.2f}) |")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    ablation(read(sys.argv[1]))
