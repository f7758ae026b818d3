"""Layouts in the forms of others: robot descriptions, parameters of autopilots, allocation
matrices."""

from finlab.exchange.convert import FOREIGN as FOREIGN
from finlab.exchange.convert import convert as convert
from finlab.exchange.convert import read_any as read_any
from finlab.exchange.convert import read_robot as read_robot
from finlab.exchange.exchange import Exchange as Exchange
from finlab.exchange.matrix_table import is_robot_table as is_robot_table
from finlab.exchange.mjcf_write import mujoco_control as mujoco_control

__all__ = [
    "FOREIGN",
    "Exchange",
    "convert",
    "is_robot_table",
    "mujoco_control",
    "read_any",
    "read_robot",
]
