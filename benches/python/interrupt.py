"""Time from Ctrl-C to KeyboardInterrupt, over kinds of long work and moments within them.

Each run is a fresh interpreter that is sent SIGINT; it tells when its exception arrived::

    python benches/python/interrupt.py [--markdown]
"""

import argparse
import signal
import subprocess
import sys
import time

import numpy as np
from _table import show

# Name of the work: what it works on, the call.
WORK = {
    "expm, 4096 x 4096, sid": ("normal(4096, 4096)", "spim.expm(x, method='sid')"),
    "expm, 4096 x 4096, exact": ("normal(4096, 4096)", "spim.expm(x, method='exact')"),
    "expm, 3000 x 3000, pade": ("normal(3000, 3000)", "spim.expm(x, method='pade')"),
    "expm, 4 million 6 x 6": ("normal(4_000_000, 6, 6)", "spim.expm(x)"),
    "Propagator, 2000 states": ("chain(2000)", "spim.Propagator(x, 1.0, correction='polish')"),
    "Propagator, 1000 separable states, thrice": (
        "chain(1000)",
        "[spim.Propagator(x, 1.0) for _ in range(3)]",
    ),
    "phi, 1 million 6 x 6": ("normal(1_000_000, 6, 6)", "spim.phi(x, 4)"),
    "energy, 3000 states of 2000": (
        "(spim.LinearSystem(chain(2000)), normal(3000, 2000))",
        "x[0].energy(x[1])",
    ),
    "trajectory, batch of 100,000, exact": (
        "spim.Propagator(chain(6), 0.5, correction='exact')",
        "x.trajectory(np.ones((100_000, 6)), 10**6, every=10**5)",
    ),
    "trajectory, 6 states": (
        "spim.Propagator(chain(6), 0.5)",
        "x.trajectory(np.ones(6), 10**12, every=10**9)",
    ),
    "trajectory, 480 states, exact": (
        "spim.Propagator(chain(480), 0.5, correction='exact')",
        "x.trajectory(np.ones(480), 10**9, every=10**6)",
    ),
    "integrate, rk4, 4000 states": (
        "spim.LinearSystem(chain(4000))",
        "spim.integrate(x, np.ones(4000), (0, 1e9), 0.1, method='rk4', every=10**7)",
    ),
    "integrate, rk4": (
        "spim.LinearSystem(chain(6))",
        "spim.integrate(x, np.ones(6), (0, 1e9), 0.1, method='rk4', every=10**7)",
    ),
}
MOMENTS = (0.05, 0.3, 0.7, 1.1)

CODE = """
import signal, time
# What runs in the background of a shell ignores Ctrl-C.
signal.signal(signal.SIGINT, signal.default_int_handler)
import numpy as np, spim
def chain(m):
    n = m // 2
    k = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    return np.block([[np.zeros((n, n)), np.eye(n)], [-k, np.zeros((n, n))]])
def normal(*shape):
    return np.random.default_rng(0).normal(size=shape)
x = SETUP
print("go", flush=True)
try:
    WORK
except KeyboardInterrupt:
    print(time.monotonic(), flush=True)
else:
    print("finished", flush=True)
"""


def latency(setup, work, moment):
    """Seconds from the signal to the exception; None where the work was over before."""
    code = CODE.replace("SETUP", setup).replace("WORK", work)
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    process.stdout.readline()
    time.sleep(moment)
    sent = time.monotonic()
    process.send_signal(signal.SIGINT)
    arrived = process.communicate()[0].strip()
    return None if arrived == "finished" else float(arrived) - sent


def rows():
    """Cells of the table: milliseconds."""
    for name, (setup, work) in WORK.items():
        found = [latency(setup, work, moment) for moment in MOMENTS]
        found = [1e3 * x for x in found if x is not None]
        middle, most = (np.median(found), max(found)) if found else (np.nan, np.nan)
        yield [name, f"{middle:.0f}", f"{most:.0f}", f"{len(found)}/{len(MOMENTS)}"]


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--markdown", action="store_true")
    head = ["work", "median, ms", "largest, ms", "interrupted"]
    show(head, rows(), parser.parse_args().markdown)


if __name__ == "__main__":
    main()
