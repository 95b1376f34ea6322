"""Draws run time against error from the output of the benchmark `integrators`.

    OMP_NUM_THREADS=1 bench_integrators > integrators.csv
    python3 integrators.py integrators.csv ../docs/images/integrators.png
"""

import csv
import sys
from collections import defaultdict

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

TITLES = {
    "kepler": "Kepler, e = 0.9, 32 orbits",
    "outer solar system": "outer solar system, 100 orbits of Jupiter",
    "plummer": "Plummer sphere, 1000 bodies, 2 time units",
    "binary": "a binary of 41 periods in a cluster of 300, 0.1 time units",
    "bounce": "bounce under mutual gravity",
    "ring patch": "patch of a ring, 32 bodies and their images, an orbit",
}
COLOURS = {
    "VelocityVerlet": "black", "Yoshida4": "tab:blue", "Yoshida6": "tab:orange", "Yoshida8": "tab:olive",
    "BlanesMoan4": "tab:green", "BlanesMoan6": "tab:red", "KahanLi6": "tab:pink", "KahanLi8": "tab:purple",
    "ForceGradient4": "tab:brown", "WisdomHolman": "tab:cyan", "GaussRadau15": "magenta",
    "Hermite4": "tab:gray", "SymplecticEpicycle": "navy",
}


def main(source, target):
    curves = defaultdict(list)
    with open(source, newline="") as file:
        for row in csv.DictReader(file):
            if row["problem"] != "problem":
                error = float(row["position_error"])
                if row["integrator"] == "GaussRadau15" and error == 0.0:
                    error = float(row["energy_error"])  # the reference itself
                curves[row["problem"], row["integrator"]].append((float(row["seconds"]), error))
    figure, axes = plt.subplots(3, 2, figsize=(11, 13))
    for axis, (problem, title) in zip(axes.flat, TITLES.items()):
        for (name, integrator), points in curves.items():
            if name != problem:
                continue
            method = integrator.split()[0]
            adaptive = integrator.endswith("adaptive")
            points = [(t, e) for t, e in sorted(points) if 0.0 < e < 3.0]
            if points:
                axis.loglog(*zip(*points), marker="*" if method == "GaussRadau15" else ".",
                            markersize=14 if method == "GaussRadau15" else 5,
                            linestyle="--" if adaptive else "-", color=COLOURS[method],
                            linewidth=1, label=integrator)
        axis.set_title(title, fontsize=10)
        axis.set_xlabel("processor time [s]")
        axis.set_ylabel("relative position error")
        axis.grid(alpha=0.3)
        axis.legend(fontsize=6, framealpha=0.4)
    for axis in axes.flat[len(TITLES):]:
        axis.axis("off")
    figure.tight_layout()
    figure.savefig(target, dpi=90)


if __name__ == "__main__":
    main(*sys.argv[1:])
