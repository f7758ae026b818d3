// What the examples take of Arduino, PX4 and ROS 2, by the names and types of their headers; nothing behind them.
#pragma once
#include <cmath>
#include <cstdint>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>
enum { LOW, HIGH, OUTPUT = 1, LED_BUILTIN = 13 };
void pinMode(int, int);
void digitalWrite(int, int);
void delay(unsigned long);

namespace px4 {
struct wq_config_t {};
namespace wq_configurations { static constexpr wq_config_t rate_ctrl{}; }
struct ScheduledWorkItem {
  ScheduledWorkItem(const char *, const wq_config_t &) {}
  virtual ~ScheduledWorkItem() = default;
  void ScheduleOnInterval(uint32_t, uint32_t = 0) {}
  virtual void Run() = 0;
};
} // namespace px4
struct orb_metadata {};
static const orb_metadata vehicle_thrust_setpoint, vehicle_torque_setpoint, actuator_motors;
#define ORB_ID(name) &name
namespace uORB {
template <typename T> struct Publication {
  explicit Publication(const orb_metadata *) {}
  bool publish(const T &) { return true; }
};
struct Subscription {
  Subscription(const orb_metadata *) {}
  bool copy(void *) { return true; }
};
} // namespace uORB
struct vehicle_thrust_setpoint_s { uint64_t timestamp, timestamp_sample; float xyz[3]; };
struct vehicle_torque_setpoint_s { uint64_t timestamp, timestamp_sample; float xyz[3]; };
struct actuator_motors_s {
  static constexpr uint8_t NUM_CONTROLS = 12;
  uint64_t timestamp, timestamp_sample;
  uint16_t reversible_flags;
  float control[12];
};

#define RCLCPP_WARN(logger, ...) ((void)(logger))
namespace rclcpp {
template <typename T> struct Publisher {
  using SharedPtr = std::shared_ptr<Publisher>;
  void publish(const T &) {}
};
template <typename T> struct Subscription { using SharedPtr = std::shared_ptr<Subscription>; };
struct Node {
  explicit Node(const std::string &) {}
  int get_logger() const { return 0; }
  template <typename T> typename Publisher<T>::SharedPtr create_publisher(const std::string &, int) { return {}; }
  template <typename T, typename F> typename Subscription<T>::SharedPtr create_subscription(const std::string &, int, F f) {
    return std::function<void(const T &)>(f) ? nullptr : nullptr;
  }
};
inline void init(int, char **) {}
inline void spin(std::shared_ptr<Node>) {}
inline void shutdown() {}
} // namespace rclcpp
namespace geometry_msgs::msg {
struct Vector3 { double x, y, z; };
struct Wrench { Vector3 force, torque; };
} // namespace geometry_msgs::msg
namespace std_msgs::msg { struct Float64MultiArray { std::vector<double> data; }; }
