"""`integrate`: a system, a start, a span and a step; a `Solution` back."""

import warnings

import numpy as np

from spim._arrays import degrees, finite
from spim._checkpoint import Checkpoint
from spim._events import Watch
from spim._progress import reporter
from spim._solution import Solution
from spim._systems import System
from spim._walk import walk
from spim.tableau import RungeKutta


def integrate(
    system,
    z0,
    t_span,
    step=None,
    *,
    method="auto",
    t_eval=None,
    every=1,
    outputs=None,
    events=None,
    callback=None,
    progress=None,
    resume=None,
    throw=True,
    **options,
):
    """Integrate a system with a fixed step.

    Parameters
    ----------
    system : System
        What to integrate, ``z = [q; p]``: a `LinearSystem` or `StructuralSystem`; one of functions,
        a `SeparableSystem`, `SemilinearSystem`, `HamiltonianSystem` or `FlowSystem`; a model of
        ``spim.models``.
    z0 : array_like (m,)
        State at ``t_span[0]``; None with `resume`.
    t_span : (float, float)
        Start and end; backward if the end lies before the start.
    step : float
        Positive. A span that is no multiple of it is divided into ``ceil(span / step)`` equal
        steps, with a warning; a ratio within 1e-9 of an integer counts as that integer and keeps
        `step`. May be left out with `resume`.
    method : str or RungeKutta
        One of `methods`, or a tableau. "auto" takes the most exact one at this step, and says why
        in ``solution.method``: of nonlinear systems "lawson_gauss16" where a linear part is known
        that turns by less than 8 rad and decays by less than e^2 in a step, else "gauss16"; of
        rotating beams "srk2".
    t_eval : array_like (k,), optional
        Times to return the states at, within the span and in its direction: multiples of the step
        are taken from the run, others reached by a step of their own. The whole run is held in
        memory meanwhile.
    every : int
        Only each `every`-th state is stored, and the last one: the same bits as with 1.
    outputs : array_like (r, m), or sequence of int (r,), optional
        What to store in place of states: rows of a matrix, or numbers of components (degrees of
        freedom, for a structure's displacements), or a mask of them; ``solution.outputs`` has them.
    events : callable or list of callable, optional
        ``g(t, z) -> float``: an event is a change of its sign over a step, as SciPy's. Attributes
        of the function: ``direction`` > 0 counts rising signs alone, < 0 falling ones;
        ``terminal``, True or a count, ends the run there, with the last row at the event. Times are
        found to rounding, by steps of the method itself from the start of the step; two changes
        within one step are missed. ``solution.t_events`` and ``y_events`` have them.
    callback : callable, optional
        ``callback(t, z)``, called after every step, whatever is stored; False stops the run there.
    progress : bool or callable, optional
        True for a bar; a callable is called as ``progress(fraction, t)`` every 20 ms or so, and at
        the end of a run that gets there.
    resume : Checkpoint or Solution, optional
        Go on from the ``state`` of a run of the same system: ``integrate(system, None, (t1, t2),
        resume=solution.state)``. That functions are the same is not checked. Method, options and
        step are those of that run, and the grid is, which ``t2`` must lie on; others are a
        `ValueError`. The same bits as without interruption.
    throw : bool
        False: a run that has begun and fails with an `Exception` returns what it has, with
        ``success`` False, instead of raising. What fails before the first step is raised in any
        case, and so are KeyboardInterrupt, SystemExit and GeneratorExit.
    **options
        Options of the method; ``print(spim.methods())`` lists them and what they do.

    Returns
    -------
    Solution

    Raises
    ------
    ValueError
        Unusable arguments; the message names them.
    TypeError
        An option the method does not have; the nearest is named.
    UnsupportedError
        A method that cannot treat the system.
    ModelError
        The state is not finite any more, or outside what its model describes.
    ConvergenceError
        An implicit step was not solved; the step is too large.
    OverflowError, SingularMatrixError, MemoryError
        The exponential of a step exceeds 1.8e308, a ratio has a singular denominator, the result
        is larger than the memory to be had: before the first step.
    KeyboardInterrupt
        Within 0.1 s of Ctrl-C.

        A run that had begun leaves its states in ``error.partial``.

    Warns
    -----
    UserWarning
        A span that is no multiple of the step; a run that leaves a record of its load; a step that
        resonates with fast oscillations, or loses their phase.
    PrecisionWarning
        Linear methods, as `expm`.
    """
    if not isinstance(system, System):
        raise TypeError(
            f"system: must be a spim system such as spim.LinearSystem, got {type(system).__name__}"
        )
    if method == "runge_kutta" and options.keys() & {"a", "b"}:
        if not {"a", "b"} <= options.keys():
            raise TypeError("runge_kutta: needs both a= and b=, or none")
        options = dict(options)
        method = RungeKutta(options.pop("a"), options.pop("b"))
    if isinstance(method, RungeKutta):
        method, options = "runge_kutta", {**options, **method._options()}
    if not isinstance(method, str):
        raise TypeError(
            f"method: must be a string or a spim.RungeKutta, got {type(method).__name__}"
        )
    t0, t1 = _span(t_span)
    if resume is not None:
        resume, method, step, options = _resumed(resume, system, z0, t0, method, step, options)
    elif z0 is None:
        raise TypeError("z0: is needed, unless resume= is given")
    elif step is None:
        raise TypeError("step: is needed: a positive number")
    step = _number("step", step)
    choice = system._chosen(step) if resume is None and method == "auto" else None
    if choice is not None:
        method = choice.method
        if choice.warning is not None:
            warnings.warn(choice.warning, stacklevel=2)
    times = _times(t_eval, t0, t1, every)
    shown = None if outputs is None else _outputs(outputs, system.size)
    watch = _watch(events, callback, resume is not None)
    with reporter(progress) as report:
        system._warn_before(method, step)
        # Times between grid points are reached from states.
        kept = shown if times is None else None
        run = walk(system, z0, t0, t1, step, method, every, options, report, kept, resume, watch)
        if report is not None and run["error"] is None and run["stopped"] is None:
            report(1.0, t1)
    if choice is not None:
        run["choice"] = "; ".join(filter(None, (f"auto: {choice.reason}", run["choice"])))
    if run["uneven"]:
        warnings.warn(
            f"the span {t1 - t0:g} is no multiple of the step {step:g}: "
            f"equal steps of {abs(run['h']):.17g} are taken",
            stacklevel=2,
        )
    _warn_beyond(system, t0, t1)
    solution = system._solution(run, options, kept is not None)
    if events is not None:
        solution.t_events, solution.y_events = watch.times(), watch.states(system.size)
    if times is not None:
        solution._restrict(times)
        if shown is not None:
            solution._show(shown)
    error = run["error"]
    if error is not None and (throw or not isinstance(error, Exception)):
        error.partial = solution
        raise error
    return solution


def _resumed(resume, system, z0, t, method, step, options):
    """The checkpoint, and what it says of method, step and options."""
    if isinstance(resume, Solution):
        resume = resume.state
    if not isinstance(resume, Checkpoint):
        raise TypeError(f"resume: must be a solution or its state, got {type(resume).__name__}")
    if z0 is not None:
        raise ValueError("z0: must be None with resume=, which has the state")
    step = None if step is None else _number("step", step)
    return resume, *resume._agree(system, t, method, step, options)


def _watch(events, callback, resumed):
    """What looks on, or None."""
    if events is None and callback is None:
        return None
    if events is None:
        events = ()
    elif callable(events):
        events = (events,)
    elif not isinstance(events, list | tuple):
        raise TypeError(
            f"events: must be a function g(t, z) or a list of them, got {type(events).__name__}"
        )
    return Watch(events, callback, resumed)


def _outputs(given, size):
    """The outputs as a matrix (r, m)."""
    if hasattr(given, "toarray"):
        given = given.toarray()
    array = finite("outputs", given)
    if np.asarray(given).dtype == bool:
        if array.shape != (size,) or not array.any():
            raise ValueError(
                f"outputs: a mask must have shape ({size},) and take something, got {array.shape}"
            )
        array = np.flatnonzero(array).astype(float)
    if array.ndim == 1 and array.size:
        return np.eye(size)[degrees("outputs", array, size)]
    if array.ndim != 2 or array.shape[1] != size or not len(array):
        raise ValueError(
            f"outputs: must be numbers of components or a matrix (r, {size}), got shape "
            f"{array.shape}"
        )
    return array


def _times(t_eval, t0, t1, every):
    """Checked times, or None."""
    if t_eval is None:
        return None
    times = finite("t_eval", t_eval)
    if every != 1:
        raise ValueError("every: leave it out where t_eval is given")
    if times.ndim != 1 or not times.size:
        raise ValueError(f"t_eval: must have shape (k,), k > 0, got {times.shape}")
    if (times < min(t0, t1)).any() or (times > max(t0, t1)).any():
        raise ValueError(f"t_eval: must lie within the span, {t0:g} .. {t1:g}")
    if (np.diff(times) * (1.0 if t1 >= t0 else -1.0) <= 0.0).any():
        raise ValueError("t_eval: must run from the start of the span to its end")
    return times


def _warn_beyond(system, t0, t1):
    """Says so where a run leaves a record."""
    for begin, end in system.load.spans() if system.load is not None else ():
        slack = 1e-9 * (end - begin)
        if min(t0, t1) < begin - slack or max(t0, t1) > end + slack:
            warnings.warn(
                f"the run, {min(t0, t1):g} .. {max(t0, t1):g}, leaves the record, {begin:g} .. "
                f"{end:g}: the load is zero there",
                stacklevel=3,
            )
            return


def _span(t_span):
    try:
        t0, t1 = t_span
    except (TypeError, ValueError):
        raise ValueError(f"t_span: must be a pair (start, end), got {t_span!r}") from None
    return _number("t_span", t0), _number("t_span", t1)


def _number(name, value):
    """A float from anything that is a real number, but not from text."""
    if not isinstance(value, str | bytes):
        try:
            return float(value)
        except TypeError:
            pass
        except ValueError as error:
            raise ValueError(f"{name}: {error}") from None
    raise TypeError(f"{name}: must be a number, got {type(value).__name__}")
