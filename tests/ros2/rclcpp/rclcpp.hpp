// What the exported node needs of rclcpp, at the level of messages: no middleware, no threads.
#pragma once

#include <chrono>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#define RCLCPP_WARN_THROTTLE(logger, clock, milliseconds, ...) \
  do { (void)(logger); (void)(clock); std::fprintf(stderr, __VA_ARGS__); std::fputc('\n', stderr); } while (0)

namespace rclcpp
{
struct Time {};
struct Clock { using SharedPtr = std::shared_ptr<Clock>; };
struct Logger {};
struct QoS {
  explicit QoS(int) {}
  QoS & keep_last(int) {return *this;}
};
struct SensorDataQoS : QoS { SensorDataQoS() : QoS(5) {} };

struct TimerBase {
  using SharedPtr = std::shared_ptr<TimerBase>;
  std::function<void()> call;
};

template<class Message>
struct Publisher {
  using SharedPtr = std::shared_ptr<Publisher>;
  std::string topic;
  std::vector<Message> published;
  void publish(const Message & message) {published.push_back(message);}
};

template<class Message>
struct Subscription {
  using SharedPtr = std::shared_ptr<Subscription>;
  std::string topic;
  std::function<void(const Message &)> call;
};

using Value = std::variant<double, std::string, std::vector<std::string>, std::vector<double>>;

struct Parameter {
  Value value;
  double as_double() const {return std::get<double>(value);}
};

// Parameters that override those of the node, as a file of parameters does.
inline std::map<std::string, Value> & overrides()
{
  static std::map<std::string, Value> all;
  return all;
}

class Node
{
public:
  explicit Node(const std::string & name) : name_(name) {}

  template<class T>
  T declare_parameter(const std::string & name, const T & by_default)
  {
    const auto found = overrides().find(name);
    parameters_[name].value = found == overrides().end() ? Value(by_default) : found->second;
    return std::get<T>(parameters_[name].value);
  }
  Parameter get_parameter(const std::string & name) const {return parameters_.at(name);}

  template<class Message>
  std::shared_ptr<Publisher<Message>> create_publisher(const std::string & topic, const QoS &)
  {
    auto made = std::make_shared<Publisher<Message>>();
    made->topic = topic;
    publisher = made;
    return made;
  }

  template<class Message, class Call>
  std::shared_ptr<Subscription<Message>> create_subscription(const std::string & topic, const QoS &, Call && call)
  {
    auto made = std::make_shared<Subscription<Message>>();
    made->topic = topic;
    made->call = std::forward<Call>(call);
    subscription = made;
    return made;
  }

  template<class Period, class Call>
  TimerBase::SharedPtr create_wall_timer(Period, Call && call)
  {
    timer = std::make_shared<TimerBase>();
    timer->call = std::forward<Call>(call);
    return timer;
  }

  Time now() const {return {};}
  Logger get_logger() const {return {};}
  Clock::SharedPtr get_clock() const {return std::make_shared<Clock>();}

  // For who drives the node in place of a middleware.
  std::shared_ptr<void> publisher, subscription;
  TimerBase::SharedPtr timer;

private:
  std::string name_;
  std::map<std::string, Parameter> parameters_;
};

void init(int argc, char ** argv);
void spin(std::shared_ptr<Node> node);
inline void shutdown() {}
}  // namespace rclcpp
