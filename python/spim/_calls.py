"""Functions of systems as users give them: Python's, or pointers to compiled ones."""

import ctypes
import inspect
import re

import numpy as np

ONE = "void(double t, double* z, double* out)"
BATCH = "void(double* t, double* z, double* out)"


def cfunc_signature(batch=False, user_data=False):
    """The signature of compiled functions, for ``numba.cfunc``.

    Parameters
    ----------
    batch : bool
        False: of one state, ``void(double t, double* z, double* out)``. True: of eight at once,
        ``void(double* t, double* z, double* out)``, where arrays have a row of eight doubles for
        each component: ``t[lane]``, ``z[8 * component + lane]``, ``out[8 * component + lane]``.
    user_data : bool
        Whether a ``void*`` comes last, as ``scipy.LowLevelCallable(function, user_data)`` passes.

    Returns
    -------
    numba signature

    Raises
    ------
    ImportError
        numba is not installed. C and Cython need no more than the signature above.

    Notes
    -----
    ``z`` must not be written to. What a function does not write to ``out``, as where numba's
    raises, is nan to the caller, and so a `ModelError`. Functions are called from any thread,
    without the interpreter.

    Examples
    --------
    >>> import math
    >>> import numba
    >>> import spim
    >>> @numba.cfunc(spim.cfunc_signature())
    ... def gradient(t, z, out):
    ...     z, out = numba.carray(z, 2), numba.carray(out, 2)
    ...     out[0], out[1] = math.sin(z[0]), z[1]
    >>> pendulum = spim.HamiltonianSystem(1, gradient)
    >>> run = spim.integrate(pendulum, [2.0, 0.0], (0.0, 10.0), 0.1, method="gauss16")
    """
    try:
        from numba import types
    except ImportError as error:
        raise ImportError("cfunc_signature: needs numba; pip install numba") from error
    array = types.CPointer(types.float64)
    last = (types.voidptr,) if user_data else ()
    return types.void(array if batch else types.float64, array, array, *last)


def given(name, function, inputs, outputs, *, args=(), vectorized=False):
    """A function as the core takes it.

    `inputs`: components it is given; `outputs`: the shape of what it gives for one state.
    """
    described = {
        "name": name,
        "inputs": inputs,
        "outputs": list(outputs),
        "call": function,
        "args": list(args),
        "writes": False,
        "vectorized": vectorized,
        "one": None,
        "batch": None,
    }
    forms = function if isinstance(function, tuple) and not _is_low_level(function) else (function,)
    compiled = [_compiled(name, form) for form in forms]
    if compiled and all(compiled):
        if args or vectorized:
            raise TypeError(
                f"{name}: compiled functions take neither args= nor vectorized=; pass data as the "
                "user_data of a scipy.LowLevelCallable"
            )
        for form, pointer in compiled:
            if described[form] is not None:
                raise TypeError(f"{name}: a pair is a function of one state and one of eight")
            described[form] = pointer
        return described
    if not callable(function):
        raise TypeError(f"{name}: must be a function f(t, x), got {type(function).__name__}")
    described["writes"] = _writes(function, len(args))
    return described


def _writes(function, args):
    """Whether ``f(t, x, out, *args)`` writes its result, or ``f(t, x, *args)`` returns it."""
    try:
        parameters = inspect.signature(function).parameters.values()
    except (TypeError, ValueError):
        return False
    kinds = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
    return sum(p.kind in kinds and p.default is p.empty for p in parameters) >= 3 + args


def is_compiled(name, function):
    """Whether a function is a pointer, whose signature is checked then."""
    return _compiled(name, function) is not None


def _is_low_level(function):
    return type(function).__name__ == "LowLevelCallable"


def _compiled(name, function):
    """("one" or "batch", (address, user data)), or None for what is not a pointer."""
    data = None
    if _is_low_level(function):
        address, data, given_as = _of_capsule(tuple.__getitem__(function, 0))
    elif isinstance(function, ctypes._CFuncPtr):
        address, given_as = _address(function), _types_of(name, function)
    elif isinstance(getattr(function, "address", None), int) and hasattr(function, "ctypes"):
        address, given_as = function.address, _types_of(name, function.ctypes)
    else:
        return None
    if not address:
        raise ValueError(f"{name}: a null pointer")
    wanted = {
        ("void", "double", "double*", "double*"): "one",
        ("void", "double*", "double*", "double*"): "batch",
    }
    form = wanted.get(tuple(given_as[:4]))
    takes_data = given_as[4:] == ["void*"]
    if form is None or (given_as[4:] and not takes_data):
        shown = f"{given_as[0]}({', '.join(given_as[1:])})"
        raise ValueError(
            f"{name}: must have the signature {ONE} or, for eight states, {BATCH}, perhaps with a "
            f"void* last; got {shown}"
        )
    if takes_data and data is None:
        raise ValueError(
            f"{name}: takes user data, but is given none; scipy.LowLevelCallable(function, data) "
            "passes it"
        )
    return form, (address, data if takes_data else None)


def _address(function):
    return ctypes.cast(function, ctypes.c_void_p).value


def _types_of(name, function):
    """The signature of a pointer of ctypes, as words of C."""
    if function.argtypes is None:
        raise ValueError(f"{name}: a ctypes function needs argtypes and restype = None; set them")

    def word(kind):
        if kind is None:
            return "void"
        if kind is ctypes.c_double:
            return "double"
        if kind is ctypes.c_void_p:
            return "void*"
        if getattr(kind, "_type_", None) is ctypes.c_double:
            return "double*"
        return kind.__name__

    return [word(kind) for kind in (function.restype, *function.argtypes)]


def _of_capsule(capsule):
    """Address, user data and signature of what scipy.LowLevelCallable holds."""
    api = ctypes.pythonapi

    def call(function, result, *given):
        function = getattr(api, function)
        prototype = ctypes.PYFUNCTYPE(result, *[type(x) for x in given])
        return prototype(_address(function))(*given)

    capsule = ctypes.py_object(capsule)
    name = call("PyCapsule_GetName", ctypes.c_char_p, capsule)
    address = call("PyCapsule_GetPointer", ctypes.c_void_p, capsule, ctypes.c_char_p(name))
    data = call("PyCapsule_GetContext", ctypes.c_void_p, capsule)
    shape = re.fullmatch(r"\s*([\w\s*]+?)\s*\((.*)\)\s*", name.decode())
    if shape is None:
        return address, data, [name.decode()]
    result, arguments = shape.groups()
    return address, data, [_word(part) for part in (result, *arguments.split(","))]


def _word(declared):
    """A type of C without const and the name of a parameter."""
    words = [word for word in re.findall(r"\w+|\*", declared) if word != "const"]
    stars = "*" * words.count("*")
    names = [word for word in words if word != "*"]
    return (names[0] if names else "") + stars


def times_and_states(z, t, size):
    """States (..., size) as rows, their times, and the shape in front."""
    z = np.asarray(z, float)
    if not z.ndim or z.shape[-1] != size:
        raise ValueError(f"z: must have shape (..., {size}), got {z.shape}")
    times = np.broadcast_to(np.asarray(t, float), z.shape[:-1]).reshape(-1)
    return np.ascontiguousarray(times), np.ascontiguousarray(z.reshape(-1, size)), z.shape[:-1]
