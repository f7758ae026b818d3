// A node of ROS 2: topic `wrench` in (body frame: forward, left, up), `commands` out, three for each actuator.
#include <geometry_msgs/msg/wrench.hpp>
#include <rclcpp/rclcpp.hpp>
#include <std_msgs/msg/float64_multi_array.hpp>
#include "robot.h"

class RobotAllocator : public rclcpp::Node {
public:
  RobotAllocator() : Node("robot_allocator") {
    if (fl_check(robot, robot_length) || robot_prepare(&work_)) throw std::runtime_error("no block of a robot");
    out_ = create_publisher<std_msgs::msg::Float64MultiArray>("commands", 1);
    in_ = create_subscription<geometry_msgs::msg::Wrench>(
        "wrench", 1, [this](const geometry_msgs::msg::Wrench &wrench) { answer(wrench); });
  }

private:
  void answer(const geometry_msgs::msg::Wrench &wrench) {
    const double values[6] = {wrench.force.x,  wrench.force.y,  wrench.force.z,
                              wrench.torque.x, wrench.torque.y, wrench.torque.z};
    fl_question question{};
    question.policy = &policy_;
    for (int k = 0; k < 6; k++) question.wrench[k] = fl_real(values[k]);
    if (robot_answer(&work_, &question, &answer_)) {
      RCLCPP_WARN(get_logger(), "a wrench that is not finite was left out");
      return;
    }
    std_msgs::msg::Float64MultiArray message;
    message.data.assign(answer_.command[0], answer_.command[0] + 3 * ROBOT_COUNT);
    out_->publish(message);
  }

  fl_work work_{};
  fl_answer answer_{};
  fl_policy policy_{FL_DIRECTION, 0, {1, 1, 1, 1, 1, 1}, {{0}}};
  rclcpp::Publisher<std_msgs::msg::Float64MultiArray>::SharedPtr out_;
  rclcpp::Subscription<geometry_msgs::msg::Wrench>::SharedPtr in_;
};

int main(int argc, char **argv) {
  rclcpp::init(argc, argv);
  rclcpp::spin(std::make_shared<RobotAllocator>());
  rclcpp::shutdown();
  return 0;
}
