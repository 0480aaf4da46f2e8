"""Error over time of three models, beside heyoka, diffrax and SciPy.

The chain of Fermi, Pasta, Ulam & Tsingou with three stiff springs of 50 rad/s over 50 s, Henon &
Heiles' system over 100, and ten turns of a Kepler ellipse of eccentricity 0.6: native models of
spim, the state at the end alone. heyoka's equations are compiled without compact mode, diffrax's
Dopri8 is jitted in doubles; compilation is told apart. SciPy gets functions of Python floats. Steps
and tolerances are scanned; tables hold times at equal errors, interpolated between points that
nothing of their kind beats. Errors are the largest of all components at the end, against heyoka in
the longest floats of the machine or, without it, spim's gauss32 in small steps. Medians over
interleaved repeats. Four minutes; peers need ``pip install heyoka diffrax scipy``, the plot
Matplotlib::

    python benches/python/work_precision.py [--markdown] [--quick] [--plot docs/work_precision.svg]
"""

import argparse
import time

import numpy as np
from _peers import forget_compiled, heyoka_run, longest, medians, missing, unbeaten
from _table import show

import spim

BOUNDS = (1e-6, 1e-9, 1e-12)
TOLERANCES = tuple(10.0**-k for k in range(5, 15))
# Larger errors are no points.
WORST = 1e-2


class Chain:
    """Stiff springs of 50 rad/s joined by soft quartic ones."""

    name, span, fine = "FPUT, w = 50", 50.0, 4000
    stiff, frequency = 3, 50.0
    steps = {
        "verlet": (20_000, 80_000, 320_000),
        "yoshida8": (8000, 12_000, 16_000, 24_000, 32_000),
        "kahan_li8": (2000, 3000, 5000, 8000, 12_000, 16_000),
        "sofroniou_spaletta10": (1000, 1500, 2500, 4000, 7000),
        "mclachlan84": (1000, 2000, 5000, 10_000, 20_000, 40_000),
        "gauss16": (500, 700, 1000, 1400, 2000),
        "gauss32": (100, 140, 180, 250, 350, 500, 700),
        "lawson_gauss8": (500, 1000, 2000, 4000, 8000),
        "lawson_gauss12": (300, 500, 800, 1200, 2000),
        "lawson_gauss16": (200, 300, 500, 800, 1200),
    }

    def __init__(self):
        self.model = spim.models.FermiPastaUlamTsingou(self.stiff, self.frequency)
        self.start = self.model.state()

    def taylor(self, hy, number):
        """Equations for heyoka."""
        m, square = self.stiff, number(self.frequency) * number(self.frequency)
        names = [f"{name}{i}" for name in ("x", "y", "px", "py") for i in range(m)]
        z = hy.make_vars(*names)
        on_x, on_y = self._forces(z[:m], z[m : 2 * m])
        on_y = [force - square * y for force, y in zip(on_y, z[m : 2 * m], strict=True)]
        return list(zip(z, [*z[2 * m :], *on_x, *on_y], strict=True))

    def _forces(self, x, y):
        """Of the soft springs, for any kind of number."""
        m = len(x)
        stretched = [x[0] - y[0]]
        stretched += [x[i + 1] - y[i + 1] - x[i] - y[i] for i in range(m - 1)]
        stretched.append(-x[m - 1] - y[m - 1])
        cubes = [d * d * d for d in stretched]
        pairs = [(cubes[i], cubes[i + 1]) for i in range(m)]
        return [b - a for a, b in pairs], [a + b for a, b in pairs]

    def rate(self, t, z):
        """Rates, of Python floats."""
        m, z = self.stiff, z.tolist()
        on_x, on_y = self._forces(z[:m], z[m : 2 * m])
        square = self.frequency * self.frequency
        return [*z[2 * m :], *on_x, *(f - square * y for f, y in zip(on_y, z[m:], strict=False))]

    def traced(self, jnp):
        """Rates for JAX."""
        m, square = self.stiff, self.frequency * self.frequency

        def rate(t, z, _):
            x, y = z[:m], z[m : 2 * m]
            stretched = jnp.append(x - y, 0.0) - jnp.append(jnp.zeros(1), x + y)
            cubes = stretched**3
            on_x, on_y = cubes[1:] - cubes[:-1], cubes[1:] + cubes[:-1]
            return jnp.concatenate([z[2 * m :], on_x, on_y - square * y])

        return rate


class HenonHeiles:
    """A star in a galaxy, on a regular orbit."""

    name, span, fine = "Henon-Heiles", 100.0, 800
    model, start = spim.models.HenonHeiles(), np.array([0.0, 0.1, 0.35, 0.1])
    steps = {
        "verlet": (20_000, 80_000, 320_000),
        "yoshida8": (500, 700, 1000, 1400, 2000, 3000),
        "kahan_li8": (200, 300, 400, 600, 800, 1200, 2000),
        "sofroniou_spaletta10": (100, 150, 200, 300, 450, 700),
        "gauss16": (35, 45, 55, 65, 80, 100, 130, 160, 200),
        "gauss32": (15, 20, 25, 30, 40, 50, 60, 80),
        "lawson_gauss8": (150, 250, 400, 700, 1200, 2000),
        "lawson_gauss12": (100, 130, 170, 220, 300, 400),
        "lawson_gauss16": (50, 70, 90, 120, 160, 220),
    }

    def taylor(self, hy, number):
        """Equations for heyoka."""
        x, y, px, py = hy.make_vars("x", "y", "px", "py")
        return [(x, px), (y, py), (px, -x - 2.0 * x * y), (py, y * y - x * x - y)]

    def rate(self, t, z):
        """Rates, of Python floats."""
        x, y, px, py = z.tolist()
        return px, py, -x - 2.0 * x * y, y * y - x * x - y

    def traced(self, jnp):
        """Rates for JAX."""

        def rate(t, z, _):
            x, y, px, py = z
            return jnp.stack([px, py, -x - 2.0 * x * y, y * y - x * x - y])

        return rate


class Kepler:
    """Ten turns."""

    model = spim.models.Kepler()
    name, span, fine = "Kepler, e = 0.6", 10.0 * model.period, 2000
    start = model.state(0.6)
    steps = {
        "verlet": (20_000, 80_000, 320_000),
        "yoshida8": (1500, 2000, 3000, 4000, 6000, 8000),
        "kahan_li8": (600, 1000, 1500, 2500, 4000, 6000),
        "sofroniou_spaletta10": (300, 500, 800, 1200, 2000, 3000),
        "gauss16": (120, 160, 220, 300, 400, 500),
        "gauss32": (50, 60, 80, 100, 130, 160, 200),
    }

    def taylor(self, hy, number):
        """Equations for heyoka."""
        x, y, px, py = hy.make_vars("x", "y", "px", "py")
        pull = (x * x + y * y) ** number(-1.5)
        return [(x, px), (y, py), (px, -x * pull), (py, -y * pull)]

    def rate(self, t, z):
        """Rates, of Python floats."""
        x, y, px, py = z.tolist()
        pull = (x * x + y * y) ** -1.5
        return px, py, -x * pull, -y * pull

    def traced(self, jnp):
        """Rates for JAX."""

        def rate(t, z, _):
            x, y, px, py = z
            square = x * x + y * y
            pull = 1.0 / (square * jnp.sqrt(square))
            return jnp.stack([px, py, -x * pull, -y * pull])

        return rate


def ours(problem, method, steps, **options):
    """A run with spim."""

    def run():
        solution = spim.integrate(
            problem.model,
            problem.start,
            (0.0, problem.span),
            problem.span / steps,
            method=method,
            every=steps,
            **options,
        )
        return solution.z[-1]

    return run


def heyokas(problem, tolerance, real=float, **options):
    """A run with heyoka, and the seconds to compile."""
    import heyoka as hy

    system = problem.taylor(hy, lambda value: hy.expression(real(value)))
    return heyoka_run(system, problem.start, problem.span, tolerance, None, real, **options)


def diffraxes(problem):
    """Function of a tolerance that makes runs with diffrax, and the seconds to compile."""
    import diffrax
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    term = diffrax.ODETerm(problem.traced(jnp))

    @jax.jit
    def solve(z, tolerance):
        found = diffrax.diffeqsolve(
            term,
            diffrax.Dopri8(),
            0.0,
            problem.span,
            None,
            z,
            saveat=diffrax.SaveAt(t1=True),
            stepsize_controller=diffrax.PIDController(rtol=tolerance, atol=tolerance),
            max_steps=1_000_000,
            throw=False,
        )
        return found.ys[-1]

    start = jnp.asarray(problem.start)
    begin = time.perf_counter()
    solve(start, 1e-3).block_until_ready()
    compiling = time.perf_counter() - begin

    def made(tolerance):
        return lambda: np.asarray(solve(start, tolerance))

    return made, compiling


def scipys(problem, method, tolerance):
    """A run with SciPy."""
    from scipy.integrate import solve_ivp

    def run():
        found = solve_ivp(
            problem.rate,
            (0.0, problem.span),
            problem.start,
            method=method,
            t_eval=[problem.span],
            rtol=max(tolerance, 3e-14),
            atol=tolerance,
        )
        return found.y[:, -1]

    return run


def cases(problem, quick):
    """(method, setting, run, seconds to compile) of everything there is."""
    for record in spim.methods():
        endings = ("minimal", "tolerance") if "roundoff" in record.options else (None,)
        for ending in endings:
            for steps in problem.steps.get(record.name, ()):
                options = {} if ending is None else {"roundoff": ending}
                label = record.name if ending is None else f"{record.name}, {ending}"
                run = ours(problem, record.name, steps, **options)
                yield f"spim {label}", f"{steps} steps", run, 0.0
    tolerances = TOLERANCES[::3] if quick else TOLERANCES
    if not missing("heyoka"):
        for tolerance in (*tolerances, 2.0**-52):
            run, compiling = heyokas(problem, tolerance)
            yield "heyoka", f"tol {tolerance:.0e}", run, compiling
    if not missing("diffrax"):
        made, compiling = diffraxes(problem)
        for tolerance in tolerances:
            yield "diffrax Dopri8", f"tol {tolerance:.0e}", made(tolerance), compiling
    if not missing("scipy"):
        for method in ("DOP853", "LSODA"):
            for tolerance in tolerances:
                run = scipys(problem, method, tolerance)
                yield f"SciPy {method}", f"tol {tolerance:.0e}", run, 0.0


def reference(problem):
    """The state at the end, and how it was found."""
    own = ours(problem, "gauss32", problem.fine)()
    if missing("heyoka"):
        return own, f"spim's gauss32 in {problem.fine} steps"
    real = longest()
    eps = np.finfo(real).eps
    right = heyokas(problem, eps, real, compact_mode=True, high_accuracy=True)[0]()
    apart = float(np.abs(own - right).max())
    return right, f"heyoka with eps = {eps:.0e}, {apart:.0e} from gauss32 in {problem.fine} steps"


def measure(problem, quick):
    """Unbeaten points (error, seconds) by method, and seconds to compile."""
    right, how = reference(problem)
    print(f"{problem.name}, 0..{problem.span:g}; reference: {how}\n", flush=True)
    good = []
    for case in cases(problem, quick):
        try:
            error = float(np.abs(case[2]() - right).max())
        except (spim.SpimError, RuntimeError, IndexError):
            # SciPy and others that gave up before the end.
            continue
        if error <= WORST:
            good.append((case, error))
    seconds = medians([case[2] for case, _ in good], 3 if quick else 9, 2.0)
    found = {}
    for method in dict.fromkeys(case[0] for case, _ in good):
        mine = [i for i, (case, _) in enumerate(good) if case[0] == method]
        points = [(max(good[i][1], 1e-17), seconds[i]) for i in mine]
        compiling = max(good[i][0][3] for i in mine)
        found[method] = [points[i] for i in unbeaten(points)], compiling
    return found


def at_error(points, error):
    """Seconds at an error, by interpolation of logarithms, or None."""
    if error < points[0][0]:
        return None
    errors, seconds = np.log(points).T
    return float(np.exp(np.interp(np.log(error), errors, seconds)))


def table(found, markdown):
    """Times at equal errors."""
    rows = []
    for method, (points, compiling) in found.items():
        times = [at_error(points, bound) for bound in BOUNDS]
        cells = ["-" if t is None else f"{t * 1e3:.3f}" for t in times]
        smallest = f"{points[0][0]:.0e}, {points[0][1] * 1e3:.3f}"
        rows.append([method, *cells, smallest, f"{compiling:.1f}" if compiling else "-"])
    head = ["method", *(f"{bound:.0e}: ms" for bound in BOUNDS), "smallest: ms", "compiling, s"]
    show(head, rows, markdown, width=22)
    print(flush=True)


def plot(path, measured):
    """Error over time, a panel a problem."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, panels = plt.subplots(1, len(measured), figsize=(12.0, 5.0), layout="constrained")

    def shown(found):
        """Of two endings the faster alone, or there would be too many lines."""
        return [m for m in found if m.replace("minimal", "tolerance") not in found.keys() - {m}]

    methods = list(dict.fromkeys(m for found in measured.values() for m in shown(found)))
    own = [method for method in methods if method.startswith("spim")]
    peers = [method for method in methods if method not in own]
    for ax, (name, found) in zip(np.atleast_1d(panels), measured.items(), strict=True):
        for method in shown(found):
            errors, seconds = np.transpose(found[method][0])
            style, group = ("o-", own) if method in own else ("s--", peers)
            color = f"C{group.index(method) % 10}"
            ax.loglog(seconds * 1e3, errors, style, color=color, label=method, markersize=3)
        ax.set(title=name, xlabel="time, ms (median)", ylabel="largest error at the end")
        ax.grid(alpha=0.3)
    handles = {}
    for ax in np.atleast_1d(panels):
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    figure.legend(handles.values(), handles, loc="outside lower center", ncols=5, fontsize=8)
    metadata = {"Date": None} if str(path).endswith("svg") else None
    figure.savefig(path, metadata=metadata)
    plt.close(figure)


def main():
    """Print tables and draw."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--markdown", action="store_true")
    parser.add_argument("--quick", action="store_true", help="fewer tolerances and repeats")
    parser.add_argument("--plot", metavar="FILE")
    given = parser.parse_args()
    for peer in ("heyoka", "diffrax", "scipy"):
        if missing(peer):
            print(f"{missing(peer)}\n")
    if not missing("heyoka"):
        forget_compiled()
    measured = {}
    for problem in (Chain(), HenonHeiles(), Kepler()):
        measured[problem.name] = measure(problem, given.quick)
        table(measured[problem.name], given.markdown)
    if given.plot:
        plot(given.plot, measured)


if __name__ == "__main__":
    main()
