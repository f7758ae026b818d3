"""Errors of the laws and tables of actuators."""
