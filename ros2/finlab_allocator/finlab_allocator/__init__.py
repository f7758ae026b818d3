"""The ROS 2 node `finlab_allocator`: wrenches in, commands of actuators out.

What is commanded, and when, is in modules that need no ROS: `parameters`, `frames`, `input_checks`,
`ticks`, `commander`, `status_report`. `messages` and `node` turn messages of ROS into calls of
these.
"""
