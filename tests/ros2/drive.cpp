// Drives the node: a state in each line of the input, its command in each line of the output. What a line begins with
// is what happens: "state x1 x2 ...", "names a b ..." and "frame f" for the states to come, "silence" for the timer,
// "time N" to send the last state N times and print the median of the nanoseconds from message in to command out.
#include <algorithm>
#include <chrono>
#include <iostream>
#include <sstream>
#include <thread>

#include "messages.hpp"
#include "rclcpp/rclcpp.hpp"

namespace
{
using State = Messages::State;
using Command = Messages::Command;

#ifdef POSE
void place(State & state, const std::vector<double> & x)
{
  state.pose.position.x = x.at(0), state.pose.position.y = x.at(1), state.pose.position.z = x.at(2);
}
void print(const Command & command)
{
  const auto & v = command.twist.linear;
  std::cout << v.x << " " << v.y << " " << v.z << " " << command.header.frame_id << "\n";
}
#else
void place(State & state, const std::vector<double> & x) {state.position = x;}
void print(const Command & command)
{
  for (double value : command.data) {
    std::cout << value << " ";
  }
  std::cout << "\n";
}
#endif

template<class T>
std::vector<T> rest(std::istream & line)
{
  std::vector<T> all;
  for (T each; line >> each; ) {
    all.push_back(each);
  }
  return all;
}
}  // namespace

// Arguments: NAME=number, NAME=text, or NAME=1,2,... for a parameter.
void rclcpp::init(int argc, char ** argv)
{
  for (int i = 1; i < argc; ++i) {
    const std::string text = argv[i], value = text.substr(text.find('=') + 1);
    std::istringstream number(value);
    double as_number;
    if (value.find(',') != std::string::npos) {
      std::vector<double> numbers;
      std::istringstream each(value);
      for (std::string one; std::getline(each, one, ','); ) {
        numbers.push_back(std::stod(one));
      }
      overrides()[text.substr(0, text.find('='))] = numbers;
    } else if (number >> as_number) {
      overrides()[text.substr(0, text.find('='))] = as_number;
    } else {
      overrides()[text.substr(0, text.find('='))] = value;
    }
  }
}

void rclcpp::spin(std::shared_ptr<Node> node)
{
  auto & in = *std::static_pointer_cast<Subscription<State>>(node->subscription);
  auto & out = *std::static_pointer_cast<Publisher<Command>>(node->publisher);
  std::cout.precision(17);
  std::cout << in.topic << " " << out.topic << "\n";
  State state;
  for (std::string text; std::getline(std::cin, text); ) {
    std::istringstream line(text);
    std::string what;
    line >> what;
    out.published.clear();
    if (what == "state") {
      std::vector<double> x;
      for (const std::string & each : rest<std::string>(line)) {
        x.push_back(std::stod(each));
      }
      place(state, x);
      in.call(state);
    } else if (what == "silence") {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      node->timer->call();
    } else if (what == "time") {
      std::vector<long> took(rest<std::size_t>(line).at(0));
      for (long & each : took) {
        const auto begin = std::chrono::steady_clock::now();
        in.call(state);
        each = std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now() - begin).count();
      }
      std::sort(took.begin(), took.end());
      std::cout << took[took.size() / 2] << "\n";
      continue;
    }
#ifdef POSE
    if (what == "frame") {
      line >> state.header.frame_id;
      continue;
    }
#else
    if (what == "names") {
      state.name = rest<std::string>(line);
      continue;
    }
#endif
    out.published.empty() ? void(std::cout << "none\n") : print(out.published.back());
  }
}
