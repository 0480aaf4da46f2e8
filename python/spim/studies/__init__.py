"""The paper's numerical studies, one a file, run through the public API: ``spim reproduce``.

A study is a function ``reproduce(folder, quick)`` that writes its figures, data and report into a
`Folder` and returns a summary of a few lines. A new one is a file and a line in `STUDIES`.
"""

from spim.studies import beam, oscillators, pendulum
from spim.studies._drawing import MissingPlotError, require_matplotlib
from spim.studies._output import Folder

__all__ = ["STUDIES", "MissingPlotError", "reproduce"]

STUDIES = {
    "beam": beam.reproduce,
    "oscillators": oscillators.reproduce,
    "pendulum": pendulum.reproduce,
}


def reproduce(name, output="out", quick=False):
    """Run a study of the paper again.

    Parameters
    ----------
    name : str
        A key of `STUDIES`.
    output : str or Path
        Its figures, data and report go into the folder ``output / name``.
    quick : bool
        Shorten the long runs that go beyond the paper; its own figures are always complete.

    Returns
    -------
    files : list of Path
        Everything written.
    summary : str
        The main results beside the paper's, a few lines.

    Raises
    ------
    ValueError
        No such study.
    MissingPlotError
        Matplotlib is not installed.
    OSError
        The folder cannot be written to.
    """
    if name not in STUDIES:
        raise ValueError(f"no study {name!r}; there are: {', '.join(STUDIES)}")
    require_matplotlib()
    folder = Folder(output, name)
    summary = STUDIES[name](folder, quick)
    return folder.files, summary
