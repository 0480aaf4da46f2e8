"""Systems from a Hamiltonian as sympy has it."""

import functools
import importlib.util
import math

import numpy as np

from spim import _core
from spim._calls import cfunc_signature, given
from spim._functions import HamiltonianSystem, SemilinearSystem, SeparableSystem, _Called

# A gradient below this, beside the largest second derivative, is that of an equilibrium.
AT_REST = 1e-12


def from_sympy(H, q, p, parameters=None, *, t=None, equilibrium=None):
    """A system from its Hamiltonian in symbols.

    Parameters
    ----------
    H : sympy expression
        The Hamiltonian, of momenta, not of velocities.
    q, p : sequences of sympy symbols (n,), or one symbol each
        Coordinates and momenta, in the order of the state ``z = [q; p]``.
    parameters : dict, optional
        Numbers for the other symbols: symbol -> float.
    t : sympy symbol, optional
        Time, where H depends on it.
    equilibrium : array_like (2 n,), optional
        A state at which the linear part is taken: an equilibrium for all times. By default the
        origin, if it is one.

    Returns
    -------
    SeparableSystem
        Where ``H = T(p) + V(t, q)``. If there is an equilibrium, it has its linear part apart as
        well, and is stepped by methods for semilinear systems too: by splittings as well where
        velocities are linear, T a square form.
    SemilinearSystem
        Else, where there is an equilibrium. Splittings take it if what the linear part leaves is a
        force of coordinates, as in rotating frames.
    HamiltonianSystem
        Else.

        All have energy, gradient, remainder and second derivatives in closed form, and can be
        pickled. With numba installed they are compiled, for one state and for eight at once; else
        they are vectorised functions of NumPy.

    Raises
    ------
    ImportError
        sympy is not installed.
    ValueError
        A symbol without a number, or given twice; a function there is no code for; an H that is not
        real, or infinite with these parameters; `equilibrium` is none.
    TypeError
        An H that is no expression, coordinates that are no symbols, parameters that are no numbers.

    Examples
    --------
    >>> import spim
    >>> import sympy
    >>> x, y, px, py, k = sympy.symbols("x y p_x p_y k")
    >>> H = (px**2 + py**2 + x**2 + k * y**2) / 2 + x**2 * y - y**3 / 3
    >>> system = spim.from_sympy(H, [x, y], [px, py], {k: 1.0})
    >>> run = spim.integrate(system, [0.0, 0.1, 0.5, 0.0], (0.0, 10.0), 0.1, method="gauss16")
    >>> bool(abs(run.energy / run.energy[0] - 1.0).max() < 1e-14)
    True
    """
    try:
        import sympy
    except ImportError as error:
        raise ImportError("from_sympy: needs sympy; pip install sympy") from error
    recipe = H, q, p, parameters
    parameters = {sympy.sympify(key): _number(key, x) for key, x in (parameters or {}).items()}
    H = sympy.sympify(H)
    q, p = _coordinates(sympy, "q", q), _coordinates(sympy, "p", p)
    if len(q) != len(p) or not q:
        raise ValueError(f"q, p: must be as many, got {len(q)} and {len(p)}")
    _check_names([*q, *p, *([] if t is None else [t]), *parameters])
    known = {*q, *p, *parameters, *([] if t is None else [t])}
    if unknown := sorted(map(str, H.free_symbols - known)):
        raise ValueError(f"parameters: no number for {', '.join(unknown)}")
    if not all(math.isfinite(x) for x in parameters.values()):
        raise ValueError("parameters: must be finite")
    _check_formula(sympy, H, parameters)
    # Of real numbers there is more to be known, such as what the slope of |x| is.
    real = {x: sympy.Dummy(str(x), real=True) for x in known}
    H, t_real = H.xreplace(real), None if t is None else real[t]
    q, p = [real[x] for x in q], [real[x] for x in p]
    parameters = {real[x]: value for x, value in parameters.items()}
    symbols = _Symbols(sympy, q, p, parameters, t_real)
    n, z = len(q), [*q, *p]
    gradient = [sympy.diff(H, x) for x in z]
    hessian = [[symbols.slope(g, x) for x in z] for g in gradient]
    rates = [*gradient[n:], *(-g for g in gradient[:n])]
    jacobian = [*hessian[n:], *([-x for x in row] for row in hessian[:n])]
    linear, rest = _parts(symbols, rates, jacobian, equilibrium)
    mixed = [symbols.is_zero(hessian[i][n + j]) for i in range(n) for j in range(n)]
    timed = t is not None and any(g.has(t_real) for g in gradient[n:])
    function = symbols.function
    energy = {"hamiltonian": function("hamiltonian", z, [H], (1,))}
    if all(mixed) and not timed:
        kind = _Separable
        functions = {
            "force": function("force", q, rates[n:], (n,)),
            "velocity": function("velocity", p, rates[:n], (n,)),
        }
    elif linear is not None:
        kind, functions = _Semilinear, {}
    else:
        kind = _Hamiltonian
        functions = {"gradient": function("gradient", z, gradient, (2 * n,))}
        flat = [x for row in hessian for x in row]
        functions["hessian"] = function("hessian", z, flat, (2 * n, 2 * n))
    if kind is _Separable:
        flat = [x for row in jacobian for x in row]
        functions["jacobian"] = function("jacobian", z, flat, (2 * n, 2 * n))
    if linear is not None:
        # A force of coordinates alone, where velocities are linear.
        inputs = z
        if all(map(symbols.is_zero, rest[:n])) and not any(x.has(*p) for x in rest[n:]):
            inputs, rest = q, rest[n:]
        k = len(inputs)
        name = "force" if k == n else "nonlinear"
        functions["kick" if k == n else name] = function(name, inputs, rest, (k,))
        if kind is _Semilinear:
            flat = [symbols.slope(x, y) for x in rest for y in inputs]
            functions["jacobian"] = function("jacobian", inputs, flat, (k, k))
    system = kind.__new__(kind)
    system._set(n, functions | energy, linear)
    again = functools.partial(from_sympy, t=t, equilibrium=equilibrium)
    system._recipe = again, recipe
    return system


def _number(name, value):
    """The number of a parameter."""
    try:
        if isinstance(value, str) or np.ndim(value):
            raise TypeError
        return float(value)
    except (TypeError, ValueError):
        raise TypeError(f"parameters: {name} must be a real number, got {value!r}") from None


def _coordinates(sympy, name, given):
    given = [given] if isinstance(given, str) or not np.iterable(given) else list(given)
    for x in given:
        if not isinstance(x, sympy.Symbol):
            hint = "; put a symbol in its place in H" if isinstance(x, sympy.Function) else ""
            raise TypeError(f"{name}: must be sympy symbols, got {x!r}{hint}")
    return given


def _check_names(symbols):
    for i, x in enumerate(symbols):
        if x in symbols[:i]:
            raise ValueError(f"q, p, t, parameters: {x} is there twice")


def _check_formula(sympy, H, parameters):
    """Refuses what there are no real numbers of."""
    if not isinstance(H, sympy.Expr) or H.is_Matrix:
        raise TypeError(f"H: must be an expression, got {type(H).__name__}")
    unknown = H.atoms(sympy.core.function.AppliedUndef)
    if unknown:
        shown = ", ".join(sorted(map(str, unknown)))
        raise ValueError(f"H: no code for {shown}: a function without a formula")
    if H.has(sympy.I):
        raise ValueError(f"H: must be real, got {H}")
    with_numbers = H.subs(parameters)
    if with_numbers.has(sympy.zoo, sympy.nan, sympy.oo, -sympy.oo):
        raise ValueError(f"parameters: H is {with_numbers} with these")


class _Symbolic(_Called):
    """What systems of sympy have in common."""

    def _set(self, n, functions, linear):
        self._dof, self._functions, self._linear_part = n, functions, linear
        if linear is not None:
            self._linear = _core.Linear(linear)

    @property
    def size(self):
        """Length 2 n of the state."""
        return 2 * self._dof

    _has_energy = True
    _kept = "symplectic"

    def _energies(self, times, states):
        return self._values("hamiltonian", times, states)

    @property
    def linear(self):
        """The linear part at the equilibrium, (2 n, 2 n), or None."""
        return None if self._linear_part is None else self._linear_part.copy()

    def __repr__(self):
        return f"{type(self).__name__[1:]}System({self.size} states, of symbols)"


class _Separable(_Symbolic, SeparableSystem):
    """Of T(p) + V(t, q)."""


class _Semilinear(_Symbolic, SemilinearSystem):
    """With an equilibrium."""


class _Hamiltonian(_Symbolic, HamiltonianSystem):
    """Of any Hamiltonian."""


def _parts(symbols, rates, jacobian, equilibrium):
    """The linear part as numbers, and the rest in symbols; None where there is no equilibrium."""
    sympy, z = symbols.sympy, symbols.z
    m = len(z)
    at = np.zeros(m) if equilibrium is None else np.asarray(equilibrium, float)
    if at.shape != (m,):
        raise ValueError(f"equilibrium: must have shape ({m},), got {at.shape}")
    # Where coordinates are 0, they go, and symbols cancel.
    place = {x: sympy.Float(v) if v else sympy.Integer(0) for x, v in zip(z, at, strict=True)}
    matrix = [[entry.subs(place) for entry in row] for row in jacobian]
    there = [rate.subs(place) for rate in rates]
    entries = [*there, *(x for row in matrix for x in row)]
    if symbols.t is not None and any(x.has(symbols.t) for x in entries):
        entries = [sympy.nan]
    try:
        numbers = np.array([float(x.subs(symbols.parameters)) for x in entries])
    except (TypeError, ValueError):
        numbers = np.array([np.nan])
    slope = np.abs(numbers[m:]).max(initial=0.0)
    if not np.isfinite(numbers).all() or not np.abs(numbers[:m]).max() <= AT_REST * slope:
        if equilibrium is not None:
            raise ValueError(f"equilibrium: the rates there are {numbers[:m]}, not 0")
        return None, None
    if slope == 0.0:
        return None, None
    linear = numbers[m:].reshape(m, m)
    rest = []
    for rate, row in zip(rates, matrix, strict=True):
        left = rate - sum(a * x for a, x in zip(row, z, strict=True))
        spread = sympy.expand(left)
        rest.append(min((left, spread), key=lambda form: form.count_ops()))
    return linear, rest


class _Symbols:
    """Symbols, and functions of them."""

    def __init__(self, sympy, q, p, parameters, t):
        self.sympy, self.z, self.parameters, self.t = sympy, [*q, *p], parameters, t
        self.compiles = importlib.util.find_spec("numba") is not None

    def slope(self, expression, x):
        """The derivative, but for kinks."""
        found = self.sympy.diff(expression, x)
        return found.replace(self.sympy.DiracDelta, lambda *_: self.sympy.Integer(0))

    def is_zero(self, expression):
        if expression == 0:
            return True
        # Some place first: to simplify may take long.
        names = [*self.z, *([] if self.t is None else [self.t])]
        place = {x: self.sympy.Float(0.3 + 0.07 * i) for i, x in enumerate(names)}
        value = expression.subs({**place, **self.parameters})
        if value.is_number and value.is_finite and abs(value) > 1e-8:
            return False
        return self.sympy.simplify(expression) == 0

    def function(self, name, inputs, expressions, shape):
        """A function of time and some symbols, as the core takes it."""
        single = name in ("hessian", "jacobian", "hamiltonian")
        lines, namespace = self._body(inputs, expressions)
        if not self.compiles:
            import numpy

            text = ["def function(t, z, out):", *_lines(lines, "z[{}]", "out[{}]", 4)]
            if len(shape) > 1:
                text = _flattened(text)
            exec("\n".join(text), space := {**namespace, "numpy": numpy})
            return given(name, space["function"], len(inputs), shape, vectorized=len(shape) == 1)
        import numba

        m, k = len(inputs), len(expressions)
        arrays = f"    z, out = carray(z, {m}), carray(out, {k})"
        one = ["def function(t, z, out):", arrays, *_lines(lines, "z[{}]", "out[{}]", 4)]
        forms = [self._compiled(numba, one, namespace, batch=False)]
        if not single:
            eight = [
                "def function(times, z, out):",
                f"    times, z, out = carray(times, 8), carray(z, ({m}, 8)), carray(out, ({k}, 8))",
                "    for lane in range(8):",
                "        t = times[lane]",
                *_lines(lines, "z[{}, lane]", "out[{}, lane]", 8),
            ]
            forms.append(self._compiled(numba, eight, namespace, batch=True))
        return given(name, tuple(forms), m, shape)

    def _compiled(self, numba, text, namespace, batch):
        space = {**namespace, "math": math, "carray": numba.carray}
        exec("\n".join(text), space)
        # Without exceptions: what is no number is seen by the caller.
        make = numba.cfunc(cfunc_signature(batch), error_model="numpy")
        return make(space["function"])

    def _body(self, inputs, expressions):
        """Assignments (target or number of the result, text), and the numbers they need."""
        sympy = self.sympy
        plain = sympy.numbered_symbols("x_", cls=sympy.Dummy)
        common, results = sympy.cse(expressions, symbols=plain)
        names = {x: f"z_{i}" for i, x in enumerate(inputs)}
        names |= {x: f"a_{i}" for i, x in enumerate(self.parameters)}
        names |= {x: f"x_{i}" for i, (x, _) in enumerate(common)}
        if self.t is not None:
            names[self.t] = "t"
        printer = _printer(self.compiles)({x: sympy.Symbol(name) for x, name in names.items()})
        lines = [("read", f"z_{i}", i) for i in range(len(inputs))]
        lines += [("set", names[x], printer.text(of)) for x, of in common]
        lines += [("give", i, printer.text(of)) for i, of in enumerate(results)]
        return lines, {names[x]: value for x, value in self.parameters.items()}


def _lines(lines, read, give, indent):
    """Assignments as text."""
    texts = []
    for kind, target, what in lines:
        if kind == "read":
            texts.append(f"{target} = {read.format(what)}")
        elif kind == "set":
            texts.append(f"{target} = {what}")
        else:
            texts.append(f"{give.format(target)} = {what}")
    return [" " * indent + text for text in texts]


def _flattened(text):
    """Results of a matrix, row by row."""
    return [text[0], "    out = out.reshape(-1)", *text[1:]]


@functools.cache
def _printer(compiled):
    """A printer of sympy's that keeps all digits of numbers."""
    from sympy.core.function import AppliedUndef, Derivative
    from sympy.printing.numpy import NumPyPrinter
    from sympy.printing.pycode import PythonCodePrinter

    base = PythonCodePrinter if compiled else NumPyPrinter

    class Printer(base):
        def __init__(self, names):
            super().__init__({"fully_qualified_modules": True})
            self.names = names

        def text(self, expression):
            try:
                text = self.doprint(expression.xreplace(self.names))
            except NotImplementedError:
                text = "#"
            # Older ones say so in a comment.
            if "#" in text or expression.atoms(AppliedUndef, Derivative):
                raise ValueError(f"H: no code for it or its derivatives: {expression}")
            return text

        def _print_Float(self, expression):
            return repr(float(expression))

    return Printer
