"""The equations of a model, printed."""

from __future__ import annotations

from typing import Dict, List, Tuple

from romc import _romc

Summands = List[Tuple[float, str]]
# The same with the digits of the coefficient in print.
_Printed = List[Tuple[float, str, str]]


class Equations:
    """The latent accelerations of each phase, in their shortest equal form.

    In a notebook they show as formulas, `print` shows them as text with the quantities of the latent coordinates.
    """

    def __init__(self, model: "_romc.Model", arguments: Dict[str, object]) -> None:
        self._model = model
        self._arguments = arguments
        phases, self._rounding = _romc.equations(model, arguments)
        self._phases = phases

    @property
    def phases(self) -> List[str]:
        """Names of the phases."""
        return [phase["name"] for phase in self._phases]

    @property
    def rounding(self) -> str:
        """The rounding of the printed coefficients, in words."""
        return self._rounding

    def terms(self, phase: str) -> List[Summands]:
        """Coefficient and candidate term of each summand, one list per acceleration ddz1, ddz2, ..."""
        for known in self._phases:
            if known["name"] == phase:
                terms: List[_Printed] = known["terms"]
                return [[(coefficient, term) for coefficient, _, term in summands] for summands in terms]
        raise KeyError(f"{phase!r}, expected one of {', '.join(self.phases)}")

    def latex(self) -> str:
        """The file NAME.tex of `romc compile --emit latex`, for `\\input`."""
        return _romc.emit(self._model, ["latex"], self._arguments)[0][1]

    def markdown(self) -> str:
        """The file NAME.md of `romc compile --emit markdown`."""
        return _romc.emit(self._model, ["markdown"], self._arguments)[0][1]

    def __str__(self) -> str:
        return _romc.equations_text(self._model, self._arguments)

    def to_text(self) -> str:
        """Text that `romc import` and `romc check` read, with all digits where none are set."""
        lines = []
        for phase in self._phases:
            lines.append(f"[{phase['name']}]")
            for index, summands in enumerate(phase["terms"], 1):
                lines.append(f"ddz{index} = {_sum_text(summands)}")
        return "\n".join(lines) + "\n"

    def __repr__(self) -> str:
        return f"<Equations of {', '.join(self.phases)}>"

    def _repr_latex_(self) -> str:
        rows = []
        for phase in self._phases:
            rows.append(rf"\text{{{_tex_text(phase['name'])}: {_tex_text(phase['feet'])}}} \\")
            rows.append(phase["latex"] + r" \\[1ex]")
        body = "\n".join(rows)
        return f"$$\\begin{{array}}{{l}}\n{body}\n\\end{{array}}$$"


def _sum_text(summands: _Printed) -> str:
    """`0.36 - 0.91*dz2 + 1*u1`; coefficients that print as zero are left out."""
    text = ""
    for _, digits, term in summands:
        if float(digits) == 0.0:
            continue
        sign, size = ("-", digits[1:]) if digits.startswith("-") else ("+", digits)
        product = size if term == "1" else f"{size}*{term}" if _is_product(term) else f"{size}*({term})"
        text += f" {sign} {product}" if text else f"-{product}" if sign == "-" else product
    return text or "0"


def _is_product(term: str) -> bool:
    """Whether the term has no sum outside of parentheses."""
    depth = 0
    for place, character in enumerate(term):
        depth += (character == "(") - (character == ")")
        is_exponent = place > 0 and term[place - 1] in "eE^"
        if depth == 0 and character in "+-/" and not is_exponent:
            return False
    return True


def _tex_text(text: str) -> str:
    return "".join("\\" + character if character in "#$%&_{}" else character for character in text)
