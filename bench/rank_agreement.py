#!/usr/bin/env python3
"""Whether two draws of the judged scenes order the responses alike.

  bench/rank_agreement.py reports/verdict my/verdict

For every response, contact generator and stepper of both tables: the largest residual penetration over the scenes and its
median, a failed run counting as infinitely deep. Then Kendall's tau-b between the two orders, without the control `none`.
"""
import csv
import math
import os
import statistics
import sys
from collections import defaultdict
from itertools import combinations


def depths(path):
    """Depths in mm by response with its parameters, generator and stepper, of rows that are no reading."""
    rows = defaultdict(list)
    try:
        file = open(os.path.join(path, "results.csv"), newline="")
    except OSError as error:
        sys.exit(f"rank_agreement.py: {path}: expected the folder of a report, with results.csv: {error.strerror}")
    with file:
        for row in csv.DictReader(file):
            if row["mode"] != "closed_loop" or row["setting"] == "reading" or row["response"] == "none":
                continue
            given = [f"{key.removeprefix('response.')}={value}" for key, value in sorted(row.items())
                     if key.startswith(("response.", "stepper.")) and value]
            depth = row["residual_penetration_max_m"] if row["outcome"] == "ok" else ""
            rows[(row["response"], *given, row["contacts"], row["stepper"])].append(
                1e3 * float(depth) if depth else math.inf)
    return rows


def tau_b(a, b):
    """Kendall 1945: concordant less discordant pairs, over the geometric mean of the pairs that each does not tie."""
    sign = lambda x, y: (x > y) - (x < y)
    signs = [(sign(a[i], a[j]), sign(b[i], b[j])) for i, j in combinations(range(len(a)), 2)]
    untied = math.sqrt(sum(s != 0 for s, _ in signs) * sum(t != 0 for _, t in signs))
    return sum(s * t for s, t in signs) / untied if untied else math.nan


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    first, second = depths(sys.argv[1]), depths(sys.argv[2])
    names = [name for name in first if name in second]
    if len(names) < 2:
        sys.exit("rank_agreement.py: the tables have fewer than two rows in common")
    print(f"{len(names)} rows of both")
    for what, figure in (("largest", max), ("median", statistics.median)):
        a, b = ([figure(table[name]) for name in names] for table in (first, second))
        print(f"{what} residual penetration: tau-b {tau_b(a, b):.2f}")
    print("\n| row | largest (mm) | | median (mm) | |\n|---|---:|---:|---:|---:|")
    for name in sorted(names, key=lambda one: max(first[one])):
        figures = [f(t[name]) for f in (max, statistics.median) for t in (first, second)]
        print(f"| `{' '.join(part for part in name if part)}` | " + " | ".join(f"{x:.3g}" for x in figures) + " |")


if __name__ == "__main__":
    main()
