"""Planar forces of fins: what each can push, how that adds up, the least it costs. numpy and scipy."""
