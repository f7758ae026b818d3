"""Logs of autopilots and of ROS: what a robot was asked for, gave and lost, and what would have held it.

log = finlab.read_log("dive.ulg")
print(finlab.judge(log).sentence)
"""

from finlab.log.judge import judge as judge
from finlab.log.judgement import Judgement as Judgement
from finlab.log.read import Log as Log
from finlab.log.read import read_log as read_log
