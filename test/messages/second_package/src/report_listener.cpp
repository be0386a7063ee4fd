// Prints the reports that it hears: tracked ones, and ordinary ones that carry provenance in-band.
#include <cstdio>

#include <ros/ros.h>
#include <second_package/ReportTracked.h>

static void print(const char* what, const second_package::Report& report, std::size_t provenance) {
  std::printf("%s: best %g %s of %zu, provenance %s\n", what, report.best.value, report.best.unit.c_str(),
              report.all.size(), provenance ? "there" : "none");
  std::fflush(stdout);
}

static void heard_tracked(const second_package::ReportTracked::ConstPtr& message) {
  print("tracked", message->data, message->provenance.data.size());
}

static void heard_ordinary(const second_package::Report::ConstPtr& message) { print("ordinary", *message, 0); }

int main(int argc, char** argv) {
  ros::init(argc, argv, "report_listener");
  ros::NodeHandle node;
  const ros::Subscriber tracked = node.subscribe("report", 10, heard_tracked);
  const ros::Subscriber ordinary = node.subscribe("report_in_band", 10, heard_ordinary);
  ros::spin();
}
