"""Backbone materials by name."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Material:
    """Elastic constants of a backbone.

    Parameters
    ----------
    youngs_modulus_pa, shear_modulus_pa : float
        Moduli E and G [Pa].
    density_kg_m3 : float
        [kg/m^3].
    """

    youngs_modulus_pa: float
    shear_modulus_pa: float
    density_kg_m3: float


MATERIALS = {
    "nitinol": Material(54e9, 54e9 / 2.6, 6450.0),
    "spring_steel": Material(200e9, 200e9 / 2.66, 7870.0),
    "tpu": Material(70e6, 70e6 / 2.8, 1200.0),
}
"""Backbone materials by name; nu is 0.3, 0.33 and 0.4."""
