"""Layouts in the formats of others: robot descriptions."""

from finlab.exchange.urdf import read_urdf as read_urdf
from finlab.exchange.urdf import write_urdf as write_urdf
