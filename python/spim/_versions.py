"""Versions of everything a result depends on."""

import platform
import sys

import numpy as np

from spim import _core

__version__ = _core.build_info()[0]


def versions():
    """Versions and the kernel level in use, as a dict of strings."""
    version, profile, target = _core.build_info()
    level = _core.kernel_level()
    note = ""
    if level == "portable" and platform.machine().lower() in ("x86_64", "amd64"):
        note = " (fused multiply-add in software: slow, the same bits)"
    return {
        "spim": version,
        "build": f"{profile}, {target}",
        "kernels": level + note,
        "python": sys.version.split()[0],
        "numpy": np.__version__,
        "platform": platform.platform(),
    }


def show_versions():
    """Print versions, build and the kernel level in use; add it to reports of problems."""
    for name, value in versions().items():
        print(f"{name:9} {value}")
