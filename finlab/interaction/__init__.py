"""Hydrodynamic interaction: the forces of jets on other actuators and on the hull, and the loss of
thrust by speed through the water."""

INTERACTIONS: dict[str, str] = {
    "jets": "finlab.interaction.jets:Jets",
    "linear": "finlab.interaction.linear:Linear",
    "learned": "finlab.interaction.learned:Learned",
}
"""Type of an interaction in a layout -> where its class stands, `module:Class`; it is imported when
a layout names it."""
