#include "tools/robot_import/robot_fields.h"

#include <algorithm>
#include <cctype>
#include <cmath>

namespace poise {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;

std::string Lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

bool Contains(const std::string& text, const char* word) {
  return Lower(text).find(word) != std::string::npos;
}

double Clean(double value) { return std::round(value * 1e6) / 1e6 + 0.0; }

void SetPose(const Isometry3d& pose, Pose* result) {
  const Vector3d& p = pose.translation();
  if (Clean(p.x()) != 0) result->set_x(Clean(p.x()));
  if (Clean(p.y()) != 0) result->set_y(Clean(p.y()));
  if (Clean(p.z()) != 0) result->set_z(Clean(p.z()));
  const Matrix3d& r = pose.linear();
  const double pitch = std::asin(std::clamp(-r(2, 0), -1.0, 1.0));
  const double roll = std::atan2(r(2, 1), r(2, 2)), yaw = std::atan2(r(1, 0), r(0, 0));
  const auto angle = [](double a) { return std::round(a * 1e10) / 1e10; };
  if (std::abs(roll) > 1e-9) result->set_roll(angle(roll));
  if (std::abs(pitch) > 1e-9) result->set_pitch(angle(pitch));
  if (std::abs(yaw) > 1e-9) result->set_yaw(angle(yaw));
}

}  // namespace poise
