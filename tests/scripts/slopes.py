"""Random expressions with kinks, and their slopes at points where arguments vanish, by limits in 800 digits.

    slopes.py COUNT SEED > slopes.txt

A line is an expression of z1, z2, dz1 and u1; these at a point; and the four slopes, all between tabs. A slope is the
limit of the derivative beside the point: from above, or from below where the function has no values above. It knows
nothing of the rules that romc applies: expressions are evaluated at p + t and p + t + h for t = 1e-150 and 1e-300.
"""

import math
import random
import sys

from mpmath import mp, mpf

mp.dps = 800
VARIABLES = ["z1", "z2", "dz1", "u1"]
NEAR, NEARER, STEP = mpf(10) ** -150, mpf(10) ** -300, mpf(10) ** -340


class Undefined(Exception):
    """The expression has no real value."""


class Unclear(Exception):
    """A kink so near that rounding decides, or a limit that is not reached."""


def evaluate(node, point, numbers, kinks=None):
    """The value of an expression; `kinks` gets the arguments of functions that are not smooth at zero."""
    kind = node[0]
    if kind == "variable":
        return point[node[1]]
    if kind == "number":
        return numbers.number(node[1])
    operands = [evaluate(operand, point, numbers, kinks) for operand in node[1:]]
    if kind == "+":
        return operands[0] + operands[1]
    if kind == "-":
        return operands[0] - operands[1]
    if kind == "*":
        return operands[0] * operands[1]
    if kind == "/":
        if operands[1] == 0:
            raise Undefined
        return operands[0] / operands[1]
    a = operands[0]
    is_integer = kind == "^" and node[2][0] == "number" and float(node[2][1]).is_integer()
    if kinks is not None and (kind in ("sqrt", "abs", "sign") or kind == "^" and not is_integer):
        kinks.append(a)
    if kind == "^":
        if is_integer:
            if a == 0 and node[2][1].startswith("-"):
                raise Undefined
            return a ** int(node[2][1])
        if a < 0 or a == 0 and operands[1] <= 0:
            raise Undefined
        return numbers.power(a, operands[1])
    if kind == "sqrt" and a < 0:
        raise Undefined
    return getattr(numbers, kind)(a)


class Exact:
    number, sqrt, sin, cos, tan, tanh, exp = mpf, mp.sqrt, mp.sin, mp.cos, mp.tan, mp.tanh, mp.exp
    abs, sign = abs, mp.sign

    @staticmethod
    def power(a, b):
        return mp.mpf(0) if a == 0 else mp.power(a, b)


class Double:
    number, sqrt, sin, cos, tan, tanh, exp = float, math.sqrt, math.sin, math.cos, math.tan, math.tanh, math.exp
    power = pow
    abs = abs

    @staticmethod
    def sign(a):
        return float((a > 0) - (a < 0))


def text(node):
    kind = node[0]
    if kind in ("variable", "number"):
        return node[1]
    if kind in "+-*/^":
        return f"({text(node[1])}){kind}({text(node[2])})"
    return f"{kind}({text(node[1])})"


def smooth(choose):
    """Something smooth that vanishes at one of the points."""
    variable = lambda: ("variable", choose.choice(VARIABLES))
    number = lambda value: ("number", value)
    a, b = variable(), variable()
    square = lambda node: ("^", node, number("2"))
    return choose.choice([
        lambda: a, lambda: a, lambda: a,
        lambda: ("-", a, b),
        lambda: ("-", number("1"), a),
        lambda: ("*", a, b),
        lambda: ("+", square(a), square(b)),
        lambda: ("+", square(a), square(("-", a, b))),
        lambda: square(a),
        lambda: ("^", a, number("3")),
        lambda: ("sin", a),
        lambda: ("tan", a),
        lambda: ("tanh", a),
        lambda: ("-", number("1"), ("cos", a)),
        lambda: ("-", ("exp", a), number("1")),
        lambda: ("-", ("sin", a), a),
        lambda: ("*", number("0.5"), a),
    ])()


def kinked(choose, depth):
    """A function with a kink."""
    inner = smooth(choose) if depth <= 0 or choose.random() < 0.6 else expression(choose, depth - 1)
    power = choose.choice(["0.5", "1.5", "2.5", "0.3", "0.7", "0.75", "0.25", "1.2", "0.9", "0.1", "-0.5", "2.3"])
    return choose.choice([
        lambda: ("sqrt", ("abs", inner)), lambda: ("sqrt", ("abs", inner)),
        lambda: ("sqrt", inner), lambda: ("sqrt", inner),
        lambda: ("abs", inner), lambda: ("sign", inner),
        lambda: ("^", ("abs", inner), ("number", power)),
        lambda: ("^", inner, ("number", power)),
        lambda: ("^", ("abs", inner), ("variable", choose.choice(VARIABLES))),
        lambda: ("sqrt", ("+", ("abs", inner), ("abs", smooth(choose)))),
        lambda: ("sqrt", ("+", ("^", smooth(choose), ("number", "2")), ("^", smooth(choose), ("number", "2")))),
    ])()


def expression(choose, depth):
    part = lambda: kinked(choose, depth - 1) if choose.random() < 0.7 else smooth(choose)
    return choose.choice([
        part,
        lambda: ("*", part(), part()), lambda: ("*", part(), part()), lambda: ("*", part(), part()),
        lambda: ("*", part(), ("*", part(), part())),
        lambda: ("+", part(), part()),
        lambda: ("-", part(), part()),
        lambda: ("-", ("sqrt", ("variable", "z1")), ("sqrt", ("*", ("number", "2"), part()))),
        lambda: (choose.choice(["cos", "tanh", "exp", "sin"]), part()),
        lambda: ("*", (choose.choice(["cos", "tanh", "exp", "sin"]), part()), part()),
        # Not of a root: sqrt(x)^2 is x also where x is negative.
        lambda: ("^", smooth(choose), ("number", choose.choice(["2", "3"]))),
        lambda: ("/", part(), ("+", ("number", "1"), ("abs", part()))),
    ])()


def point(choose):
    """Coordinates that floats hold, often zero, one or equal."""
    values = [choose.choice([0.0, 0.0, 0.0, 0.75, -0.5, 1.0, 2.0, -1.25]) for _ in VARIABLES]
    if choose.random() < 0.25:
        values[1] = values[0]
    return dict(zip(VARIABLES, values))


def slope_beside(node, at, variable, side):
    """The derivative's limit on one side."""
    def derivative(t):
        def value(shift):
            moved = dict(at)
            moved[variable] = at[variable] + side * shift
            return evaluate(node, moved, Exact)
        return (value(t + STEP) - value(t)) / (side * STEP)
    near, nearer = derivative(NEAR), derivative(NEARER)
    if abs(near - nearer) <= mpf(10) ** -12 * max(1, abs(nearer)):
        return float(nearer)
    if abs(nearer) > 10 * abs(near) and abs(nearer) > 1e5 and near * nearer > 0:
        return math.copysign(math.inf, nearer)
    raise Unclear


def slope(node, at, variable):
    try:
        return slope_beside(node, at, variable, 1)
    except Undefined:
        return slope_beside(node, at, variable, -1)


def line(node, values):
    """The slopes at a point, or nothing where the function has no value or rounding decides."""
    exact = {name: mpf(value) for name, value in values.items()}
    try:
        kinks, rounded = [], []
        value = evaluate(node, exact, Exact, kinks)
        found = evaluate(node, values, Double, rounded)
        if not math.isfinite(found) or abs(value) > 1e6:
            return None
        for kink, of_floats in zip(kinks, rounded):
            if (of_floats == 0) != (kink == 0) or 0 < abs(kink) < 1e-3:
                return None
        slopes = [slope(node, exact, name) for name in VARIABLES]
    except (Undefined, Unclear, OverflowError, ZeroDivisionError):
        return None
    numbers = [*values.values(), *slopes]
    return "\t".join([text(node), *(repr(number) for number in numbers)])


def fingerprint(node):
    """Values by which equal expressions are known; a model has no term twice, and none that is zero."""
    values = []
    for point in ([0.31, 0.47, 0.83, 0.59], [-0.31, 0.47, -0.83, 0.59], [0.31, -0.47, 0.83, -0.59], [-0.37, -0.41, -0.7, -0.9]):
        try:
            values.append(float(f"{float(evaluate(node, dict(zip(VARIABLES, map(mpf, point))), Exact)):.9g}"))
        except Undefined:
            values.append(0.0)
    return tuple(values)


def main(count, seed):
    choose = random.Random(seed)
    done, seen = 0, {(0.0,) * 4}
    while done < count:
        node = expression(choose, 2)
        if fingerprint(node) in seen:
            continue
        seen.add(fingerprint(node))
        points = {tuple(values.values()): values for values in (point(choose) for _ in range(6))}
        lines = [found for values in points.values() if (found := line(node, values))]
        if lines:
            done += 1
            print("\n".join(lines))


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
