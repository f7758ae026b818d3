"""Widgets of the panel beside the 3D view: one file per group.

A panel is a function that builds its widgets once, turns what the user does into intents of the
session, and declares what they show as functions of facts (`webapp/board.py`). It keeps no truth of
its own.
"""
