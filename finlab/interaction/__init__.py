"""What actuators do to each other, to the hull, and what speed through the water takes from their thrust."""
