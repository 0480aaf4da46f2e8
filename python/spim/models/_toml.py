"""A rotating beam as TOML, and back: the same numbers, units in comments.

What a table holds is data: its keys, what each value must be, and the comment that states the unit.
"""

import difflib
import os
import reprlib
import sys
import textwrap
from dataclasses import dataclass
from pathlib import Path

from spim._arrays import finite
from spim.models.rotation import RotationTable, SpinUp, Trapezoid
from spim.models.sections import DistributedSection, TaperedSection

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

TABLES = ("beam", "section", "rotation", "run", "output")
LARGEST = sys.float_info.max


def _is_number(value):
    if isinstance(value, float):
        return True
    # Integers of TOML have any length.
    return isinstance(value, int) and not isinstance(value, bool) and abs(value) <= LARGEST


def _are_numbers(value):
    return isinstance(value, list) and all(map(_is_number, value))


def _is_pair(value):
    return _are_numbers(value) and len(value) == 2


# What a value must be, in words, and whether it is.
NUMBER, PAIR, NUMBERS = "a number", "a pair of numbers", "a list of numbers"
NUMBER_OR_NUMBERS = "a number or a list of numbers"
PAIR_OR_PAIRS = "a pair of numbers or a list of pairs"
WHOLE, TEXT, TEXTS, FLAG = "a whole number", "text", "a list of texts", "true or false"
IS = {
    NUMBER: _is_number,
    PAIR: _is_pair,
    NUMBERS: _are_numbers,
    NUMBER_OR_NUMBERS: lambda x: _is_number(x) or _are_numbers(x),
    PAIR_OR_PAIRS: lambda x: _is_pair(x) or (isinstance(x, list) and all(map(_is_pair, x))),
    WHOLE: lambda x: _is_number(x) and isinstance(x, int),
    TEXT: lambda x: isinstance(x, str),
    TEXTS: lambda x: isinstance(x, list) and all(isinstance(text, str) for text in x),
    FLAG: lambda x: isinstance(x, bool),
}


@dataclass(frozen=True)
class Key:
    """What a key holds: in words of `IS`, and its unit or what else there is to say."""

    holds: str
    comment: str = ""
    needed: bool = False


BEAM = {
    "length": Key(NUMBER, "m", True),
    "elements": Key(WHOLE, "of equal length", True),
    "coupling": Key(TEXT, "foac, zoac or third"),
    "hub_inertia": Key(NUMBER, "kg m^2"),
    "hub_radius": Key(NUMBER, "m"),
    "ground_spring": Key(NUMBER, "N m/rad"),
    "joint_spring": Key(NUMBER, "N m/rad; inf locks the joint"),
    "tip_mass": Key(NUMBER, "kg"),
    "tip_inertia": Key(NUMBER, "kg m^2"),
    "gravity": Key(PAIR, "m/s^2"),
    "damping": Key(PAIR, "alpha [1/s], beta [s]"),
    "hub_torque": Key(NUMBER, "N m"),
    "joint_torque": Key(NUMBER, "N m"),
    "tip_force": Key(PAIR, "N"),
    "distributed_force": Key(PAIR_OR_PAIRS, "N/m, on the beam or on each element"),
    "follower": Key(FLAG, "forces turn with the section"),
}
LOADS = ("hub_torque", "joint_torque", "tip_force", "distributed_force")
SIDES = "m: width in the plane of rotation, thickness"
SECTIONS = {
    "tapered": (
        TaperedSection,
        {
            "root": Key(PAIR, SIDES, True),
            "tip": Key(PAIR, SIDES, True),
            "density": Key(NUMBER, "kg/m^3", True),
            "youngs_modulus": Key(NUMBER, "N/m^2", True),
        },
    ),
    "distributed": (
        DistributedSection,
        {
            "mass_per_length": Key(NUMBER, "kg/m", True),
            "axial_stiffness": Key(NUMBER, "EA, N", True),
            "bending_stiffness": Key(NUMBER, "EI in the plane of rotation, N m^2", True),
            "flap_stiffness": Key(NUMBER, "EI across it, N m^2"),
        },
    ),
}
ROTATIONS = {
    "spin-up": (
        SpinUp,
        {"speed": Key(NUMBER, "rad/s", True), "duration": Key(NUMBER, "s", True)},
    ),
    "table": (
        RotationTable,
        {"t": Key(NUMBERS, "s", True), "omega": Key(NUMBERS, "rad/s", True)},
    ),
    "trapezoid": (
        Trapezoid,
        {
            "speed": Key(NUMBER, "rad/s", True),
            "rise": Key(NUMBER, "s", True),
            "hold": Key(NUMBER, "s"),
            "fall": Key(NUMBER, "s; without it the speed is kept"),
            "start": Key(NUMBER, "s"),
        },
    ),
}

# Attributes that are not named as their key: omega(t) is a function of a table.
NAMES = {"omega": "_omega"}


# Reading


def read(source):
    """Tables of TOML: text, if it has a line break, or else the path of a file.

    Raises
    ------
    ValueError
        No TOML, a table that is not known, what should be a table and is not.
    OSError
        The file cannot be read.
    """
    if isinstance(source, os.PathLike) or "\n" not in source:
        try:
            # Some editors begin with a mark of the encoding.
            source = Path(source).read_text(encoding="utf-8-sig")
        except UnicodeDecodeError as error:
            raise ValueError(f"no TOML: not UTF-8 at byte {error.start}") from None
    try:
        tables = tomllib.loads(source)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"no TOML: {error}") from None
    for name, table in tables.items():
        if name not in TABLES:
            what = f"[{name}]: no such table" if isinstance(table, dict) else f"{name}: in no table"
            raise ValueError(f"{what}; {_nearest(name, TABLES)}")
        if not isinstance(table, dict):
            raise ValueError(f"[{name}]: must be one table, got {reprlib.repr(table)}")
    return tables


def arguments(tables):
    """Arguments of `RotatingBeam`."""
    given = checked(tables, "beam", BEAM)
    given["section"] = _made(tables, "section", SECTIONS)
    if "rotation" in tables:
        given["rotation"] = _made(tables, "rotation", ROTATIONS)
    return given


def checked(tables, name, keys):
    """Values of a table, all known and of their kind, numbers as floats.

    Raises
    ------
    ValueError
        Names table and key.
    """
    table = tables.get(name, {})
    for key, value in table.items():
        if key not in keys:
            raise ValueError(f"[{name}] {key}: no such key; {_nearest(key, keys)}")
        if not IS[keys[key].holds](value):
            shown = reprlib.repr(value)
            raise ValueError(f"[{name}] {key}: must be {keys[key].holds}, got {shown}")
    for key, what in keys.items():
        if what.needed and key not in table:
            raise ValueError(f"[{name}] {key}: is missing; give {what.holds} ({what.comment})")
    return {
        key: value if keys[key].holds == WHOLE else _floats(value) for key, value in table.items()
    }


def one_of(where, value, known):
    """The value, if it is one of those known."""
    if value not in known:
        raise ValueError(f"{where}: no such choice as {value!r}; {_nearest(str(value), known)}")
    return value


def _made(tables, name, kinds):
    """Section or rotation, of the kind its table says."""
    table = dict(tables.get(name, {}))
    if "kind" not in table:
        raise ValueError(f"[{name}] kind: is missing; {_there_are(kinds)}")
    kind = table.pop("kind")
    if not isinstance(kind, str):
        raise ValueError(f"[{name}] kind: must be text, got {kind!r}")
    make, keys = kinds[one_of(f"[{name}] kind", kind, kinds)]
    return make(**checked({name: table}, name, keys))


def _floats(value):
    if isinstance(value, list):
        return [_floats(x) for x in value]
    return float(value) if isinstance(value, int) and not isinstance(value, bool) else value


def _nearest(name, known):
    near = difflib.get_close_matches(name, known, 1)
    return f'did you mean "{near[0]}"?' if near else _there_are(known)


def _there_are(known):
    return f"there are {', '.join(known)}"


# Writing


def written(beam):
    """A beam as TOML text; see `RotatingBeam.to_toml`."""
    given = {name: beam._given[name] if name in LOADS else getattr(beam, name) for name in BEAM}
    tables = ["# A rotating beam for spim, in SI units\n", _table("beam", given, BEAM)]
    tables.append(_table_of("section", beam.section, SECTIONS))
    if beam.rotation is not None:
        tables.append(_table_of("rotation", beam.rotation, ROTATIONS))
    return "\n".join(tables)


def _table_of(name, thing, kinds):
    for kind, (make, keys) in kinds.items():
        if type(thing) is make:
            values = {key: getattr(thing, NAMES.get(key, key)) for key in keys}
            return _table(name, values, keys, kind)
    what = "a function" if callable(thing) else f"a {type(thing).__name__}"
    possible = ", ".join(make.__name__ for make, _ in kinds.values())
    raise ValueError(f"{name}: {what} cannot be written as TOML; {possible} can")


def _table(name, values, keys, kind=None):
    lines = [f"[{name}]"] + ([] if kind is None else [f'kind = "{kind}"'])
    for key, what in keys.items():
        value = values[key]
        if callable(value):
            raise ValueError(f"{key}: a function cannot be written as TOML; give numbers")
        if value is not None:
            lines.append(_line(key, _text(key, value), what.comment))
    return "\n".join(lines) + "\n"


def _line(key, text, comment):
    line = f"{key} = {text}"
    if len(line) + len(comment) < 96:
        return f"{line}  # {comment}"
    folded = textwrap.wrap(
        line, 96, subsequent_indent="    ", break_long_words=False, break_on_hyphens=False
    )
    return "\n".join([f"# {key}: {comment}", *folded])


def _text(key, value):
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return f'"{value}"'
    if type(value) in (int, float):
        return repr(value)
    return _listed(finite(key, value).tolist())


def _listed(value):
    """Numbers by repr, which reads back as the same double."""
    if isinstance(value, list):
        return f"[{', '.join(map(_listed, value))}]"
    return repr(value)
