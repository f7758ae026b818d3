"""What stands in the panel beside the 3D view: one file per group of widgets.

A panel builds its widgets once, turns what the user does into intents of the session, and writes the session
and the answer back into its widgets in `refresh`. It keeps no truth of its own.
"""
