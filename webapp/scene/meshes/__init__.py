"""Shapes as plain triangle meshes: numpy in, numpy out. Metres, body or fin frame."""
