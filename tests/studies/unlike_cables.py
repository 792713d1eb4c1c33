"""Frames whose cables differ in what `geometry` takes to be one for all: how often σ holds.

    python tests/studies/unlike_cables.py --count 24

A grid of whole lengths of a flat frame of four belts, its anchors known to metres, with offsets,
readings a metre or distances from the plane of each belt's own that nobody writes down.
"""

from __future__ import annotations

import argparse

import numpy as np

import cdprcal

CORNERS = np.array([[0.0, 0.0, 0.0], [3.041, 0.0, 0.0], [3.021, 0.0, 2.137], [-0.023, 0.0, 2.094]])
ABOUT = np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [3.0, 0.0, 2.0], [0.0, 0.0, 2.0]])
NOISE_M = 0.5e-3
COMMON_OFFSET_M = 0.05
#: What differs → by how much one belt does (m, 1, m²).
UNLIKE = (
    ("nothing", 0.0),
    ("offset", 0.005),
    ("offset", 0.01),
    ("offset", 0.02),
    ("scale", 0.001),
    ("scale", 0.003),
    ("distance", 0.005),
)


def frame() -> cdprcal.Robot:
    """What its owner knows: about 3 m wide."""
    pulleys = "".join(
        f"  - pulley: {{radius_m: 0, position_m: {list(map(float, p))}, position_sigma_m: 2}}\n"
        for p in ABOUT
    )
    return cdprcal.parse_robot(
        "name: belts\nplatform: {mass_kg: 8, motion: 2T, motion_plane_normal: [0, 1, 0]}\n"
        f"cables:\n{pulleys}tension_limits_N: [0, 400]\n",
        "belts",
    )


def readings(what: str, spread: float, seed: int, poses: int) -> cdprcal.Log:
    """The lengths at a grid of poses; what belts differ by is none on average."""
    rng = np.random.default_rng(seed)
    across = np.linspace(0.6, 2.4, round(poses**0.5))
    grid = np.array([(x, 0.0, z) for z in np.linspace(0.4, 1.7, len(across)) for x in across])
    lengths = np.linalg.norm(grid[:, None] - CORNERS, axis=2)
    own = rng.normal(0.0, spread, 4)
    own -= own.mean()
    if what == "offset":
        lengths = lengths + own
    elif what == "scale":
        lengths = lengths * (1.0 + own)
    elif what == "distance":
        lengths = np.sqrt(lengths**2 + 0.01 + own)
    lengths = lengths + COMMON_OFFSET_M + rng.normal(0.0, NOISE_M, lengths.shape)
    return cdprcal.Log(time_s=10.0 * np.arange(len(grid)), direct_length_m=lengths)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=24, help="Frames of each kind.")
    parser.add_argument("--poses", type=int, default=49)
    options = parser.parse_args()
    robot = frame()
    print("| belts differ in | by | found | beyond 2 σ | 4 σ | at most | σ, median | asked |")
    print("|---|---:|---:|---:|---:|---:|---:|---:|")
    for what, spread in UNLIKE:
        worst, sigma, asked = [], [], 0
        for seed in range(options.count):
            found = cdprcal.geometry(robot, readings(what, spread, seed, options.poses))
            if found.status != cdprcal.FrameStatus.converged:
                continue
            known = found.anchors_sigma_m > 2e-6  # the others are the gauge
            error = np.abs(found.anchors_m - CORNERS)[known]
            worst.append(float((error / found.anchors_sigma_m[known]).max()))
            sigma.append(float(found.anchors_sigma_m.max()))
            asked += any(" own " in text for text in found.next)
        z = np.array(worst)
        middle_mm = 1e3 * float(np.median(sigma))
        print(
            f"| {what} | {spread:g} | {len(z)} | {(z > 2).sum()} | {(z > 4).sum()} "
            f"| {z.max():.1f} σ | {middle_mm:.1f} mm | {asked} |"
        )


if __name__ == "__main__":
    main()
