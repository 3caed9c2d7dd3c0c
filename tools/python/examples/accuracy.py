"""What does accuracy cost on my scene?

A notebook as a script: Jupyter and VS Code run its cells (`# %%`) one by one.

    python accuracy.py [SCENE] [--seconds 10]
"""

# %% The scene: a file, or the demonstration.
from __future__ import annotations

import argparse

import pointillist

parser = argparse.ArgumentParser(description="What accuracy costs on a scene.")
parser.add_argument("scene", nargs="?", help="a scene of Mitsuba or a model [default: the demonstration]")
parser.add_argument("--seconds", type=float, default=10, help="time for each method")
arguments, _ = parser.parse_known_args()

scene = pointillist.load(arguments.scene or pointillist.cornell_box())
size = (128, 128)
print(scene)

# %% The error against time of each method, as it states it itself on the way.
curves: dict[str, list[tuple[float, float]]] = {}
pictures: dict[str, pointillist.Picture] = {}
for method in ("path", "bidirectional"):
    picture = scene.render(method=method, time=arguments.seconds, size=size)
    pictures[method] = picture
    error = picture.error
    if error is None:
        print(f"{method}: too few samples to know the error; give more seconds")
        continue
    curves[method] = [(seconds, value) for seconds, _, value in picture.report["error"]["curve"]]
    print(f"{method}: after {arguments.seconds:g} s 95 % of the picture are within {error.p95:.1%}")

# %% What 1 % would take: errors of independent samples fall as the root of time, and the measured slope says how nearly.
for method, picture in pictures.items():
    report = picture.report.get("error")
    if report is None:
        continue
    slope = (report.get("slope") or {}).get("value")
    # The slope is that of the error over the samples; few checkpoints do not tell it.
    exponent = -slope if slope is not None and -0.7 < slope < -0.2 else 0.5
    seconds = picture.report["seconds"]["render"] * (report["p95"]["value"] / 0.01) ** (1 / exponent)
    print(f"{method}: 1 % would take about {seconds:.0f} s")

# %% Does the stated error hold? A longer render tells: its error is small beside that of the first.
reference = scene.render(method="path", time=4 * arguments.seconds, size=size, seed=1)
for method, picture in pictures.items():
    metrics = pointillist.compare(picture, reference, ["relmse", "flip"])
    error = picture.error
    stated = "unknown" if error is None else f"{error.rel_mse:.2g}"
    print(f"{method}: relMSE {float(metrics['relmse']):.2g} against the long render, stated {stated}; FLIP {float(metrics['flip']):.3f}")

# %% The picture. In a notebook its name is enough.
reference.save("accuracy.png")
