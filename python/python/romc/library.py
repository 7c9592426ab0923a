"""The shorthand for candidate terms."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional


@dataclass(frozen=True)
class Library:
    """The standard library of candidate terms: constant; z; dz; monomials of (z, dz) of degree 2 to `degree`, graded,
    with rising indices; sines and cosines; u.

    `order` is that of the sines and cosines in the rows of Xi, in which trainers differ: `"paper"` (sin z, cos z, sin
    dz, cos dz: Appendix B of the paper), `"interleaved"` (sin z1, cos z1, sin z2, ..., then dz: the paper's training
    code, PySINDy's `FourierLibrary`) or `"romc"` (sin z, sin dz, cos z, cos dz). Without it recordings (`inputs_from=`)
    decide, or the model is refused. Models keep romc's order.

    `degree` 0 is the constant alone. `trigonometric` adds sines and cosines of each z and dz, `inputs` the latent
    inputs u. Other libraries are lists of terms: `["1", "z1", "dz1*sin(z1)", "u1"]`.
    """

    degree: int = 1
    trigonometric: bool = False
    inputs: bool = False
    order: Optional[str] = None

    def shorthand(self) -> str:
        """The same as the command line writes it: `degree=1,trigonometric,inputs`."""
        parts = [f"degree={self.degree}"]
        parts += ["trigonometric"] * self.trigonometric + ["inputs"] * self.inputs
        return ",".join(parts)
