"""Values of sums in 60 digits, without overflow, beside those of their shorter forms: one case per line, as JSON."""

import json
import sys

import mpmath

mpmath.mp.dps = 60
FAR = 10**7


class TooFar(Exception):
    """An exponential that is not computed."""


def exp(argument):
    if argument > FAR:
        raise TooFar
    return mpmath.mpf(0) if argument < -FAR else mpmath.exp(argument)


def value(case):
    names = {name: mpmath.mpf(at) for name, at in case["at"].items()} | {"exp": exp}
    return sum(mpmath.mpf(c) * eval(term.replace("^", "**"), names) for c, term in case["sum"])


n_compared = 0
for line in open(sys.argv[1], encoding="utf-8"):
    case = json.loads(line)
    try:
        exact = value(case)
    except (TooFar, ZeroDivisionError):
        continue
    n_compared += 1
    if abs(case["simplified"] - exact) > 1e-8 * abs(exact):
        sys.exit(f"{case['name']} at {case['at']}: {case['simplified']}, exactly {mpmath.nstr(exact)}")
if n_compared < 500:
    sys.exit(f"{n_compared} points compared")
