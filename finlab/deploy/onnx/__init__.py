"""ONNX files without the package `onnx`: a small writer, a strict reader, and the models we ship in them.

The writer gives the same bytes for the same weights on any machine. The reader lets a robot take the weights
out of the file it was sent, and refuses what such a file has no business to hold.
"""
