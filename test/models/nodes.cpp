// Nodes that nobody tracks. The private parameter `kind` says what one computes from `in`, and from `other`; those whose
// kind begins with `point` send the `point` that they make of `target`.
// `set_gain` changes the gain meanwhile, and `set_most` the most of `in` that is not passed over.
#include <deque>
#include <limits>
#include <random>
#include <string>

#include <geometry_msgs/PointStamped.h>
#include <ros/ros.h>
#include <std_msgs/Float64.h>
#include <std_msgs/Float64MultiArray.h>

int main(int argc, char** argv)
{
  ros::init(argc, argv, "opaque");
  ros::NodeHandle node;
  std::string kind;
  double gain, most = std::numeric_limits<double>::infinity();
  ros::param::param<std::string>("~kind", kind, "gain");
  ros::param::param("~gain", gain, 2.5);
  ros::Publisher out = node.advertise<std_msgs::Float64>("out", 10);
  ros::Publisher array;
  if (kind == "array") array = node.advertise<std_msgs::Float64MultiArray>("array", 10);
  double low_pass = 0.0, sum = 0.0, last_other = 0.0;
  std::deque<std::pair<ros::WallTime, double>> waiting;
  std::mt19937 random(std::random_device{}());

  const auto send = [&](double value)
  {
    std_msgs::Float64 message;
    message.data = value;
    out.publish(message);
  };
  const boost::function<void(const std_msgs::Float64::ConstPtr&)> take = [&](const std_msgs::Float64::ConstPtr& message)
  {
    const double value = message->data;
    if (value > most) return;
    if (kind == "gain") send(gain * value + 1.0);
    if (kind == "square") send(value * value);
    if (kind == "two") send(gain * value + 3.0 * last_other);
    if (kind == "low_pass") send(low_pass += 0.2 * (value - low_pass));
    if (kind == "saturation") send(std::min(1.0, value));
    if (kind == "random") send(value + std::uniform_real_distribution<double>(-1.0, 1.0)(random));
    if (kind == "sum") send(sum += value);
    if (kind == "clock") send(value + ros::WallTime::now().toSec());
    if (kind == "array")
    {
      std_msgs::Float64MultiArray message;
      message.data = {100.0 * gain * value, last_other, 7.0};
      array.publish(message);
    }
    if (kind == "delay") waiting.emplace_back(ros::WallTime::now() + ros::WallDuration(0.2), gain * value);
  };
  const boost::function<void(const std_msgs::Float64::ConstPtr&)> take_other =
      [&](const std_msgs::Float64::ConstPtr& message)
  {
    last_other = message->data;
    if (kind == "other") send(gain * last_other);
  };
  ros::Publisher point;
  if (kind.rfind("point", 0) == 0) point = node.advertise<geometry_msgs::PointStamped>("point", 10);
  std::deque<std::pair<ros::WallTime, geometry_msgs::PointStamped>> points;
  const boost::function<void(const geometry_msgs::PointStamped::ConstPtr&)> take_target =
      [&](const geometry_msgs::PointStamped::ConstPtr& message)
  {
    geometry_msgs::PointStamped made = *message;
    made.point.x = gain * message->point.x + 1.0;
    made.point.y = message->point.y * message->point.y;
    if (kind == "point") return point.publish(made);
    made.header.stamp = ros::Time();
    if (kind == "point_low_pass") made.point.x = low_pass += 0.8 * (made.point.x - low_pass);
    points.emplace_back(ros::WallTime::now() + ros::WallDuration(kind == "point_delay" ? 0.2 : 0.0), made);
  };
  const boost::function<void(const std_msgs::Float64::ConstPtr&)> take_gain =
      [&](const std_msgs::Float64::ConstPtr& message) { gain = message->data; };
  const boost::function<void(const std_msgs::Float64::ConstPtr&)> take_most =
      [&](const std_msgs::Float64::ConstPtr& message) { most = message->data; };
  const ros::Subscriber set_most = node.subscribe<std_msgs::Float64>("set_most", 10, take_most);
  const ros::Subscriber set_gain = node.subscribe<std_msgs::Float64>("set_gain", 10, take_gain);
  const ros::Subscriber in = node.subscribe<std_msgs::Float64>("in", 10, take);
  const ros::Subscriber other = node.subscribe<std_msgs::Float64>("other", 10, take_other);
  ros::Subscriber target;
  if (kind.rfind("point", 0) == 0) target = node.subscribe<geometry_msgs::PointStamped>("target", 10, take_target);
  const ros::WallTimer timer = node.createWallTimer(ros::WallDuration(0.002), [&](const ros::WallTimerEvent&)
  {
    while (!waiting.empty() && waiting.front().first <= ros::WallTime::now())
    {
      send(waiting.front().second);
      waiting.pop_front();
    }
    while (!points.empty() && points.front().first <= ros::WallTime::now())
    {
      point.publish(points.front().second);
      points.pop_front();
    }
  });
  ros::spin();
}
