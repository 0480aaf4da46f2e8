"""Time of a step of the rotating beam, and a step and element.

The paper's beam, of two elements and more, 1e-4 s, every hundredth state stored; `srk2` in its
ways beside `rk4`, whose step is explicit. Medians of interleaved repeats::

    python benches/python/beam_speed.py [--markdown]
"""

import argparse
import time

import numpy as np
from _table import show

import spim
from spim.studies.beam import beam as cantilever

STEP = 1e-4
REPEATS = 5
# Elements, steps, method, options.
CASES = (
    (2, 500_000, "srk2", {}),
    (2, 500_000, "srk2", {"newton": "full"}),
    (2, 500_000, "rk4", {}),
    (8, 20_000, "srk2", {"tolerance": 1e-12}),
    (64, 5_000, "srk2", {"tolerance": 1e-12}),
    (512, 1_000, "srk2", {"tolerance": 1e-12}),
    (4096, 200, "srk2", {"tolerance": 1e-12}),
    (8, 20_000, "srk2", {}),
    (64, 5_000, "srk2", {}),
    (512, 1_000, "srk2", {}),
    (4096, 200, "srk2", {}),
    (512, 200, "srk2", {"newton": "full"}),
    (512, 200, "srk2", {"coupling": "third"}),
)


def model(elements, coupling="foac"):
    """The beam, and its initial state: the paper's, or one of that shape."""
    beam = cantilever(elements=elements, coupling=coupling)
    if elements == 2:
        return beam, beam.state(u=[0.1, 0.2], v=[0.5, 1.0])
    # Axial displacement of a third-order beam is what bending takes away.
    u = (lambda x: 0.2 * x / 8.0) if coupling == "foac" else (lambda x: -2.0 * x**3 / 3.0 / 8.0**4)
    return beam, beam.state(u=u, v=lambda x: (x / 8.0) ** 2, theta=lambda x: x / 32.0)


def rows():
    """Cells of the table."""
    times = {case: [] for case in range(len(CASES))}
    found = {}
    for _ in range(REPEATS):
        for case, (elements, steps, method, options) in enumerate(CASES):
            options = dict(options)
            beam, z0 = model(elements, options.pop("coupling", "foac"))
            span = (0.0, steps * STEP)
            start = time.perf_counter()
            run = spim.integrate(beam, z0, span, STEP, method=method, every=100, **options)
            times[case].append(time.perf_counter() - start)
            energy = run.energy
            found[case] = run.stats["evaluations"] / steps, np.abs(energy / energy[0] - 1.0).max()
    for case, (elements, steps, method, options) in enumerate(CASES):
        taken = float(np.median(times[case])) / steps * 1e9
        evaluations, error = found[case]
        words = ", ".join(f"{name} {value}" for name, value in options.items())
        yield [
            str(elements),
            method,
            words or "-",
            f"{taken:.0f}",
            f"{taken / elements:.0f}",
            f"{evaluations:.1f}",
            f"{error:.1e}",
        ]


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--markdown", action="store_true")
    head = ["elements", "method", "options", "ns a step", "and element", "sweeps", "energy error"]
    show(head, rows(), parser.parse_args().markdown)


if __name__ == "__main__":
    main()
