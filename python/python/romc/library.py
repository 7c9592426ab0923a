"""The shorthand for candidate terms."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Library:
    """The standard library of candidate terms, in this order: constant; z; dz; monomials of (z, dz) of degree 2 to
    `degree`, graded, with rising indices; sin z; sin dz; cos z; cos dz; u.

    `degree` 0 is the constant alone. `trigonometric` adds sines and cosines of each z and dz, `inputs` the latent
    inputs u. Other libraries are lists of terms: `["1", "z1", "dz1*sin(z1)", "u1"]`.
    """

    degree: int = 1
    trigonometric: bool = False
    inputs: bool = False

    def shorthand(self) -> str:
        """The same as the command line writes it: `degree=1,trigonometric,inputs`."""
        parts = [f"degree={self.degree}"]
        parts += ["trigonometric"] * self.trigonometric + ["inputs"] * self.inputs
        return ",".join(parts)
