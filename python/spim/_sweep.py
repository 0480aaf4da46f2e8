"""Many runs, on any executor."""

from concurrent.futures import as_completed
from dataclasses import dataclass
from typing import Any

from spim._integrate import integrate
from spim._progress import reporter


@dataclass(frozen=True)
class FailedCase:
    """A case of a `sweep` of which there is no solution.

    Attributes
    ----------
    parameter : object
        What `build` was called with.
    error : Exception
        What was raised, by `build` or before the first step.
    """

    parameter: Any
    error: Exception

    @property
    def success(self):
        """False."""
        return False

    @property
    def message(self):
        """The error, as a sentence."""
        return f"{type(self.error).__name__}: {self.error}"


def sweep(build, parameters, *, executor=None, progress=None):
    """Integrate a case for each of some parameters.

    Parameters
    ----------
    build : callable
        ``build(parameter) -> (system, z0, t_span, step)``, or with a dict of keyword arguments of
        `integrate` as a fifth item. For executors of other processes it must be a function of a
        module.
    parameters : iterable
        Anything `build` takes.
    executor : concurrent.futures.Executor, optional
        Runs the cases: threads, processes, a Dask client's ``client.get_executor()``, an MPI pool.
        One after the other in this thread by default. It is not shut down.
    progress : bool or callable, optional
        As for `integrate`: called as ``progress(fraction, cases_done)``.

    Returns
    -------
    list
        In the order of the parameters: a `Solution` each, whose ``error`` is None where all went
        well and the exception where a run failed after it had begun, or a `FailedCase`.

    Raises
    ------
    KeyboardInterrupt
        At Ctrl-C; cases that have not begun are cancelled.
    """
    if not callable(build):
        raise TypeError(f"build: must be callable, got {type(build).__name__}")
    parameters = list(parameters)
    with reporter(progress) as report:
        found = _in_turn if executor is None else _submitted
        results = [None] * len(parameters)
        for done, (index, result) in enumerate(found(build, parameters, executor), 1):
            results[index] = result
            if report is not None:
                report(done / len(parameters), done)
    return results


def _in_turn(build, parameters, _):
    for index, parameter in enumerate(parameters):
        yield index, _case(build, parameter)


def _submitted(build, parameters, executor):
    futures = {executor.submit(_case, build, p): i for i, p in enumerate(parameters)}
    try:
        for future in as_completed(futures):
            index = futures[future]
            error = future.exception()
            if error is None:
                yield index, future.result()
            else:
                # The executor's own failure: a killed process, a case that cannot be pickled.
                yield index, FailedCase(parameters[index], error)
    finally:
        for future in futures:
            future.cancel()


def _case(build, parameter):
    try:
        case = build(parameter)
        if not isinstance(case, tuple | list) or len(case) not in (4, 5):
            raise TypeError(
                "build: must return (system, z0, t_span, step) or these and a dict of options, "
                f"got {case!r}"
            )
        options = {"throw": False, **dict(*case[4:])}
        return integrate(*case[:4], **options)
    except Exception as error:
        return FailedCase(parameter, error)
