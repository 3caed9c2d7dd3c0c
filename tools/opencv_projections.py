"""Writes tests/tracer/opencv.csv: where OpenCV's `projectPoints` shows points through distorted lenses.

Usage: pip install opencv-python-headless && python tools/opencv_projections.py > tests/tracer/opencv.csv

A line with `lens` or `fisheye` gives the focal length and the principal point in pixels and the coefficients in OpenCV's order
(k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4, or k1 k2 k3 k4); each line with `point` below it gives x, y, z (x right, y down, z ahead) and the place in
pixels, where the centre of the first pixel is 0, 0.
"""

import random

import cv2
import numpy

SIZE = (640, 400)
LENSES = [
    [0.0] * 12,
    [-0.28, 0.07, 0.0, 0.0, -0.008] + [0.0] * 7,
    [0.12, -0.03, 0.0, 0.0] + [0.0] * 8,
    [-0.2, 0.05, 1.2e-3, -2.5e-3, 0.01] + [0.0] * 7,
    [0.8, -0.1, 5e-4, 8e-4, 0.02, 1.1, 0.05, 0.01, 0.0, 0.0, 0.0, 0.0],
    [-0.1, 0.02, -1e-3, 2e-3, 0.0, 0.03, -0.01, 0.002, 2e-3, -1e-3, -3e-3, 5e-4],
]
FISHEYES = [[0.0] * 4, [-0.02, 0.005, -0.003, 0.0005], [0.08, -0.02, 0.004, -0.0003]]


def point(radius):
    """A point in front whose distance from the axis is at most `radius` times its depth."""
    depth = random.uniform(0.5, 20.0)
    while True:
        x, y = random.uniform(-radius, radius), random.uniform(-radius, radius)
        if x * x + y * y <= radius * radius:
            return [x * depth, y * depth, depth]


def show(kind, project, coefficients, radius):
    focal, center = random.uniform(250.0, 500.0), [random.uniform(280.0, 360.0), random.uniform(170.0, 230.0)]
    matrix = numpy.array([[focal, 0.0, center[0]], [0.0, focal, center[1]], [0.0, 0.0, 1.0]])
    print(kind, focal, *center, *coefficients, sep=",")
    points = [point(radius) for _ in range(20)]
    zero = numpy.zeros(3)
    places, _ = project(numpy.array(points).reshape(-1, 1, 3), zero, zero, matrix, numpy.array(coefficients))
    for place, (u, v) in zip(points, places.reshape(-1, 2)):
        print("point", *place, u, v, sep=",")


def main():
    random.seed(1)
    print(f"# OpenCV {cv2.__version__}, {SIZE[0]} × {SIZE[1]} pixels; written by tools/opencv_projections.py")
    for coefficients in LENSES:
        show("lens", cv2.projectPoints, coefficients, 0.9)

    def fisheye(points, rotation, translation, matrix, coefficients):
        return cv2.fisheye.projectPoints(points, rotation, translation, matrix, coefficients)

    for coefficients in FISHEYES:
        show("fisheye", fisheye, coefficients, 4.0)


main()
