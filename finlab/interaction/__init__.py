"""What actuators do to each other, to the hull, and what speed through the water takes from their
thrust."""

INTERACTIONS: dict[str, str] = {
    "jets": "finlab.interaction.jets:Jets",
    "learned": "finlab.interaction.learned:Learned",
}
"""Type of an interaction in a layout -> where its class stands, `module:Class`; it is imported when
a layout names it."""
