"""Layouts and commands in the formats of others: robot descriptions, tables, U-CAT's messages."""

from finlab.exchange.table import read_csv as read_csv
from finlab.exchange.table import write_csv as write_csv
from finlab.exchange.ucat import Flipper as Flipper
from finlab.exchange.ucat import flippers as flippers
from finlab.exchange.urdf import read_urdf as read_urdf
from finlab.exchange.urdf import write_urdf as write_urdf
