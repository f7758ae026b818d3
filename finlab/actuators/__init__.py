"""The laws of actuators: force of a command and power, with derivatives; one kind per file."""
