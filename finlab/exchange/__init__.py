"""Layouts in the forms of others: robot descriptions, parameters of autopilots, allocation
matrices."""

from finlab.exchange.convert import FOREIGN as FOREIGN
from finlab.exchange.convert import convert as convert
from finlab.exchange.convert import read_any as read_any
from finlab.exchange.convert import read_robot as read_robot
from finlab.exchange.exchange import Exchange as Exchange
from finlab.exchange.inquiry import Reading as Reading
from finlab.exchange.inquiry import read_asking as read_asking
from finlab.exchange.matrix_table import is_robot_table as is_robot_table
from finlab.exchange.mjcf_control import mujoco_control as mujoco_control
from finlab.exchange.notes import Note as Note
from finlab.exchange.questions import Answers as Answers
from finlab.exchange.questions import Choice as Choice
from finlab.exchange.questions import Question as Question
from finlab.exchange.questions import QuestionError as QuestionError

__all__ = [
    "FOREIGN",
    "Answers",
    "Choice",
    "Exchange",
    "Note",
    "Question",
    "QuestionError",
    "Reading",
    "convert",
    "is_robot_table",
    "mujoco_control",
    "read_any",
    "read_asking",
    "read_robot",
]
