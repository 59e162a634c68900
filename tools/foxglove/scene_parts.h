// Pieces of Foxglove's messages.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <string_view>

#include "tools/foxglove/foxglove.pb.h"

namespace poise {

/// The frame that nothing moves; its floor is z = 0.
inline constexpr const char* kWorldFrame = "world";

/// Red, green, blue and opacity, 0 to 1.
struct SceneColor {
  double r, g, b, a = 1;
};

/// `utime` in us.
google::protobuf::Timestamp SceneTime(int64_t utime);
/// `To`: Vector3 or Point3.
template <class To>
void Fill(const Eigen::Vector3d& from, To* to) {
  to->set_x(from.x());
  to->set_y(from.y());
  to->set_z(from.z());
}
void Fill(const Eigen::Quaterniond& from, foxglove::Quaternion* to);
void Fill(const Eigen::Isometry3d& from, foxglove::Pose* to);
void Fill(const SceneColor& from, foxglove::Color* to);

/// A thing in the scene that takes the place of an earlier one of that id; it stays until then.
foxglove::SceneEntity* AddEntity(int64_t utime, std::string_view frame, std::string_view id,
                                 foxglove::SceneUpdate* scene);
/// Adds an arrow from `start` along `vector` (m); none where the vector is shorter than a
/// millimetre.
void AddArrow(const Eigen::Vector3d& start, const Eigen::Vector3d& vector, double diameter,
              const SceneColor& color, foxglove::SceneEntity* entity);
void AddSphere(const Eigen::Vector3d& centre, double diameter, const SceneColor& color,
               foxglove::SceneEntity* entity);
/// Adds a closed line; none through fewer than two points.
void AddLoop(std::span<const Eigen::Vector3d> points, double thickness, const SceneColor& color,
             foxglove::SceneEntity* entity);

}  // namespace poise
