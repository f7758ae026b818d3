"""Logs of autopilots and of ROS: what a robot was asked for, gave and lost, and what would have
held it.

from finlab.log import judge, read_log

print(judge(read_log("dive.ulg")).sentence)
"""

from finlab.log.judgement import Judgement as Judgement
from finlab.log.judging import judge as judge
from finlab.log.read import Log as Log
from finlab.log.read import read_log as read_log

__all__ = ["Judgement", "Log", "judge", "read_log"]
