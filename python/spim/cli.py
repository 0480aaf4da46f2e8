"""The command ``spim``."""

import argparse
import os
import sys
from pathlib import Path

import spim
from spim import _beam_command, studies


class _Parser(argparse.ArgumentParser):
    """Bad input is answered in one line, exit code 2."""

    def error(self, message):
        self.exit(2, f"{self.prog}: error: {message}\n")


def main(arguments=None):
    """Run the command line.

    Parameters
    ----------
    arguments : list of str, optional
        ``sys.argv[1:]`` if omitted.

    Raises
    ------
    SystemExit
        Code 2, after one line on the standard error, for bad input.
    """
    chosen = _parser().parse_args(arguments)
    if hasattr(sys.stdout, "reconfigure"):
        # A terminal without the letter gets a question mark, not a traceback.
        sys.stdout.reconfigure(errors="replace")
    try:
        chosen.run(chosen)
        sys.stdout.flush()
    except BrokenPipeError:
        # The reader, such as `head`, has what it wanted; nothing is left for Python to flush.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _parser():
    parser = _Parser(prog="spim", description="Structure-preserving time integration.")
    parser.add_argument("--version", action="version", version=f"spim {spim.__version__}")
    commands = parser.add_subparsers(title="commands", metavar="command", required=True)

    reproduce = commands.add_parser(
        "reproduce",
        help="run studies of the paper again: figures, data and a report",
        description="Run studies of the paper (Huang, Deng, Yao, J. Sound Vib. 299, 2007) again. "
        f"There are: {', '.join(studies.STUDIES)}.",
    )
    reproduce.add_argument(
        "study",
        nargs="?",
        default="all",
        choices=[*studies.STUDIES, "all"],
        help="default: all there are",
    )
    reproduce.add_argument(
        "--output", metavar="DIR", type=Path, default=Path("out"), help="default: %(default)s"
    )
    reproduce.add_argument(
        "--quick", action="store_true", help="shorten the runs that go beyond the paper"
    )
    reproduce.set_defaults(run=_reproduce, parser=reproduce)

    _beam_command.add(commands)

    methods = commands.add_parser("methods", help="list the integration methods")
    methods.set_defaults(run=_methods)
    return parser


def _reproduce(chosen):
    names = list(studies.STUDIES) if chosen.study == "all" else [chosen.study]
    for name in names:
        try:
            files, summary = studies.reproduce(name, chosen.output, chosen.quick)
        except studies.MissingPlotError as error:
            chosen.parser.error(str(error))
        except OSError as error:
            where = error.filename or chosen.output
            chosen.parser.error(f"cannot write to {where}: {error.strerror or error}")
        for file in files:
            print(file)
        print(f"\n{summary}")


def _methods(_):
    print(spim.methods())
