"""How far the forces of actuators may be from their laws and tables."""
