// A work item of PX4: setpoints of thrust and torque in, `actuator_motors` out. For robots of thrusters.
#pragma once
#include <px4_platform_common/px4_work_queue/ScheduledWorkItem.hpp>
#include <uORB/Publication.hpp>
#include <uORB/Subscription.hpp>
#include <uORB/topics/actuator_motors.h>
#include <uORB/topics/vehicle_thrust_setpoint.h>
#include <uORB/topics/vehicle_torque_setpoint.h>
#include "robot.h"

class RobotAllocator : public px4::ScheduledWorkItem {
public:
  RobotAllocator() : ScheduledWorkItem("robot_allocator", px4::wq_configurations::rate_ctrl) {}

  bool start(uint32_t interval_us) { // false: not the robot of these C files
    if (fl_check(robot, robot_length) || robot_prepare(&_work)) return false;
    ScheduleOnInterval(interval_us);
    return true;
  }

  void Run() override { // setpoints are shares of the wrench scale; PX4's y and z point right and down
    vehicle_thrust_setpoint_s thrust{};
    vehicle_torque_setpoint_s torque{};
    if (!_thrust.copy(&thrust) || !_torque.copy(&torque)) return;
    const fl_real *scale = reinterpret_cast<const fl_head *>(robot)->wrench_scale;
    fl_question question{};
    question.policy = &_policy;
    for (int k = 0; k < 3; k++) {
      const float sign = k ? -1.f : 1.f;
      question.wrench[k] = sign * thrust.xyz[k] * scale[k];
      question.wrench[3 + k] = sign * torque.xyz[k] * scale[3 + k];
    }
    if (robot_answer(&_work, &question, &_answer)) return; // a setpoint is not finite
    actuator_motors_s motors{};
    motors.timestamp = motors.timestamp_sample = thrust.timestamp;
    for (int i = 0; i < actuator_motors_s::NUM_CONTROLS; i++)
      motors.control[i] = i < ROBOT_COUNT ? float(_answer.command[i][0] / ROBOT_ACTUATOR(i)->command_max[0]) : NAN;
    _motors.publish(motors);
  }

private:
  fl_work _work{};
  fl_answer _answer{};
  fl_policy _policy{FL_DIRECTION, 0, {1, 1, 1, 1, 1, 1}, {{0}}};
  uORB::Subscription _thrust{ORB_ID(vehicle_thrust_setpoint)}, _torque{ORB_ID(vehicle_torque_setpoint)};
  uORB::Publication<actuator_motors_s> _motors{ORB_ID(actuator_motors)};
};
