"""Plots the front of time against error: plot_gravity_front.py front.csv front.png

front.csv is what bench_gravity_front --benchmark_format=csv prints, or its columns name, cpu_time [ms] and rms.
Needs matplotlib.
"""

import csv
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402


def rows(path):
    with open(path, newline="") as file:
        lines = [line for line in file if line.startswith(("name,", '"fastMultipole'))]
    for row in csv.DictReader(lines):
        bodies = int(row["name"].split("/")[1])
        yield bodies, float(row["rms"]), float(row["cpu_time"]) * 1e-3


def main():
    fronts = {}
    for bodies, rms, seconds in rows(sys.argv[1]):
        fronts.setdefault(bodies, []).append((rms, seconds))
    figure, axes = plt.subplots(figsize=(6, 4.5))
    for bodies, points in sorted(fronts.items()):
        points.sort()
        axes.loglog(*zip(*points), marker="o", label=f"{bodies} bodies")
    axes.set_xlabel("rms of the relative error of the force")
    axes.set_ylabel("processor time of one evaluation [s]")
    axes.grid(alpha=0.3)
    axes.legend()
    figure.tight_layout()
    figure.savefig(sys.argv[2], dpi=120)


main()
