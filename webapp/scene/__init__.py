"""Nodes of the 3D view. Every node has a fixed name and is changed in place, never added
again."""
