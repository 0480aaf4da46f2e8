"""Progress of a run."""

import contextlib
import sys

NOBODY = contextlib.nullcontext()


def reporter(progress):
    """A context: the function to call as ``report(fraction, t)``, or None.

    Parameters
    ----------
    progress : None, bool or callable
        True: a bar by tqdm if it is installed, else a plain line on the standard error.
    """
    if progress is None or progress is False:
        return NOBODY
    if callable(progress):
        return contextlib.nullcontext(progress)
    if progress is True:
        return _bar()
    raise TypeError(f"progress: must be a bool or callable, got {type(progress).__name__}")


@contextlib.contextmanager
def _bar():
    try:
        from tqdm.auto import tqdm
    except ImportError:
        yield lambda fraction, t: print(f"\r{fraction:6.1%}  t = {t:g}", end="", file=sys.stderr)
        print(file=sys.stderr)
        return
    with tqdm(total=100, unit="%", bar_format="{l_bar}{bar}| {elapsed} < {remaining}") as bar:

        def report(fraction, t):
            bar.set_postfix_str(f"t = {t:g}", refresh=False)
            bar.update(100 * fraction - bar.n)

        yield report
