#include "tools/foxglove/scene_parts.h"

#include <algorithm>
#include <string>

namespace poise {
namespace {

constexpr double kShortest = 1e-3;   // m, of an arrow
constexpr double kHeadShare = 0.25;  // of the arrow's length, at most
constexpr double kHeadWidth = 2.2;   // times the shaft's diameter
constexpr double kHeadLength = 3.0;  // times the shaft's diameter, at most

}  // namespace

google::protobuf::Timestamp SceneTime(int64_t utime) {
  google::protobuf::Timestamp time;
  time.set_seconds(utime / 1'000'000);
  time.set_nanos(static_cast<int32_t>(utime % 1'000'000) * 1'000);
  return time;
}

void Fill(const Eigen::Quaterniond& from, foxglove::Quaternion* to) {
  to->set_x(from.x());
  to->set_y(from.y());
  to->set_z(from.z());
  to->set_w(from.w());
}

void Fill(const Eigen::Isometry3d& from, foxglove::Pose* to) {
  Fill(Eigen::Vector3d(from.translation()), to->mutable_position());
  Fill(Eigen::Quaterniond(from.linear()), to->mutable_orientation());
}

void Fill(const SceneColor& from, foxglove::Color* to) {
  to->set_r(from.r);
  to->set_g(from.g);
  to->set_b(from.b);
  to->set_a(from.a);
}

foxglove::SceneEntity* AddEntity(int64_t utime, std::string_view frame, std::string_view id,
                                 foxglove::SceneUpdate* scene) {
  foxglove::SceneEntity* const entity = scene->add_entities();
  *entity->mutable_timestamp() = SceneTime(utime);
  entity->set_frame_id(std::string(frame));
  entity->set_id(std::string(id));
  return entity;
}

void AddArrow(const Eigen::Vector3d& start, const Eigen::Vector3d& vector, double diameter,
              const SceneColor& color, foxglove::SceneEntity* entity) {
  const double length = vector.norm();
  if (!(length > kShortest)) return;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = start;
  pose.linear() =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitX(), vector).toRotationMatrix();
  foxglove::ArrowPrimitive* const arrow = entity->add_arrows();
  Fill(pose, arrow->mutable_pose());
  const double head = std::min(kHeadLength * diameter, kHeadShare * length);
  arrow->set_shaft_length(length - head);
  arrow->set_shaft_diameter(diameter);
  arrow->set_head_length(head);
  arrow->set_head_diameter(kHeadWidth * diameter);
  Fill(color, arrow->mutable_color());
}

void AddSphere(const Eigen::Vector3d& centre, double diameter, const SceneColor& color,
               foxglove::SceneEntity* entity) {
  foxglove::SpherePrimitive* const sphere = entity->add_spheres();
  Fill(Eigen::Isometry3d(Eigen::Translation3d(centre)), sphere->mutable_pose());
  Fill(Eigen::Vector3d(Eigen::Vector3d::Constant(diameter)), sphere->mutable_size());
  Fill(color, sphere->mutable_color());
}

void AddLoop(std::span<const Eigen::Vector3d> points, double thickness, const SceneColor& color,
             foxglove::SceneEntity* entity) {
  if (points.size() < 2) return;
  foxglove::LinePrimitive* const line = entity->add_lines();
  line->set_type(foxglove::LinePrimitive::LINE_LOOP);
  Fill(Eigen::Isometry3d::Identity(), line->mutable_pose());
  line->set_thickness(thickness);
  for (const Eigen::Vector3d& point : points) Fill(point, line->add_points());
  Fill(color, line->mutable_color());
}

}  // namespace poise
