"""How far the bending follows noisy surfaces: down to the wave from which on noise outweighs what is to be found."""

from __future__ import annotations

from ..flatten.sphere import Flat
from ..surface.fairing import noise

POWER = 0.02
"""What the squared coefficients of a displacement, each coordinate's in the modes of the Laplacian, times the squared
eigenvalues are, in roots of the area: nearly the same for all waves, as a plate's. Measured on what was found of twenty
pairs without noise (faces, teeth, a brain, a hand, feet, an ear, heads, a bent piece, a depth scan), medians: 0.03 for
waves of 2 pi times 0.12 to 0.06 and 0.06 to 0.04, 0.02 from there to 0.025."""


def shortest(source: Flat, target: Flat) -> float:
    """Return the wavelength over 2 pi, in roots of the area, at which noise and displacements have the same power.

    The squared coefficients of noise are all the same, a vertex's variance over the number of vertices; those of
    displacements fall with the fourth power of the wave number. A plate that is as soft as to pass half of the wave at
    which they meet is the best filter there is (Wiener 1949). 0 without noise.
    """
    power = sum(
        noise(surface.exact, surface.mesh) ** 2 / (surface.mesh.area * int(surface.mesh.used.sum()))
        for surface in (source, target)
        if surface.exact is not None
    )
    return float((power / POWER) ** 0.25)
