#include "tools/foxglove/robot_frames.h"

#include <map>

#include "tools/foxglove/scene_parts.h"

namespace poise {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using Kind = robot::SourceShape::Kind;

constexpr SceneColor kSolid{0.62, 0.66, 0.72};
constexpr double kBone = 0.06;  // m, diameter of what stands for a body without a shape

void AddTransform(const std::string& parent, const std::string& child, const Isometry3d& pose,
                  int64_t utime, foxglove::FrameTransforms* transforms) {
  foxglove::FrameTransform* const transform = transforms->add_transforms();
  *transform->mutable_timestamp() = SceneTime(utime);
  transform->set_parent_frame_id(parent);
  transform->set_child_frame_id(child);
  Fill(Vector3d(pose.translation()), transform->mutable_translation());
  Fill(Eigen::Quaterniond(pose.linear()).normalized(), transform->mutable_rotation());
}

void AddCylinder(const Isometry3d& pose, double diameter, double length,
                 foxglove::SceneEntity* entity) {
  foxglove::CylinderPrimitive* const cylinder = entity->add_cylinders();
  Fill(pose, cylinder->mutable_pose());
  Fill(Vector3d(diameter, diameter, length), cylinder->mutable_size());
  cylinder->set_bottom_scale(1);
  cylinder->set_top_scale(1);
  Fill(kSolid, cylinder->mutable_color());
}

/// `pose` in the middle, along its z; `length` without the caps.
void AddCapsule(const Isometry3d& pose, double diameter, double length,
                foxglove::SceneEntity* entity) {
  AddCylinder(pose, diameter, length, entity);
  for (const double end : {-0.5, 0.5}) {
    AddSphere(pose * Vector3d(0, 0, end * length), diameter, kSolid, entity);
  }
}

}  // namespace

RobotFrames::RobotFrames(const robot::RobotModel& model) : model_(model), data_(model) {
  for (const robot::Body& body : model.bodies()) {
    const robot::Frame* const frame = model.FindFrame(body.name);
    links_.push_back({body.name, frame != nullptr ? frame->pose : Isometry3d::Identity()});
  }
}

foxglove::FrameTransforms RobotFrames::Moving(const robot::RobotState& state, int64_t utime) {
  ComputeKinematics(model_, state, &data_);
  std::vector<Isometry3d> pose(links_.size());
  foxglove::FrameTransforms transforms;
  for (size_t b = 0; b < links_.size(); ++b) {
    Isometry3d body = Isometry3d::Identity();
    body.linear() = data_.body_rotation[b];
    body.translation() = data_.base_position + data_.body_position[b];
    pose[b] = body * links_[b].in_body;
    const int parent = model_.bodies()[b].parent;
    if (parent < 0) {
      AddTransform(kWorldFrame, links_[b].name, pose[b], utime, &transforms);
    } else {
      AddTransform(link(parent), links_[b].name,
                   pose[static_cast<size_t>(parent)].inverse() * pose[b], utime, &transforms);
    }
  }
  return transforms;
}

foxglove::FrameTransforms RobotFrames::Fixed(int64_t utime) const {
  foxglove::FrameTransforms transforms;
  for (const robot::Frame& frame : model_.frames()) {
    const Link& carrier = links_[static_cast<size_t>(frame.body)];
    if (frame.name == carrier.name) continue;
    AddTransform(carrier.name, frame.name, carrier.in_body.inverse() * frame.pose, utime,
                 &transforms);
  }
  return transforms;
}

void RobotFrames::AddFixed(int body, const std::string& name, const Isometry3d& pose,
                           foxglove::FrameTransforms* transforms) const {
  const Link& carrier = links_[static_cast<size_t>(body)];
  AddTransform(carrier.name, name, carrier.in_body.inverse() * pose, 0, transforms);
}

void RobotFrames::DrawShape(const RobotDrawing& drawing, size_t index,
                            foxglove::SceneEntity* entity) const {
  const robot::SourceShape& shape = drawing.shapes[index];
  const Isometry3d pose =
      links_[static_cast<size_t>(drawing.body[index])].in_body.inverse() * shape.pose;
  switch (shape.kind) {
    case Kind::kBox: {
      foxglove::CubePrimitive* const cube = entity->add_cubes();
      Fill(pose, cube->mutable_pose());
      Fill(shape.size, cube->mutable_size());
      Fill(kSolid, cube->mutable_color());
      break;
    }
    case Kind::kSphere:
      AddSphere(pose.translation(), 2 * shape.size.x(), kSolid, entity);
      break;
    case Kind::kCylinder:
      AddCylinder(pose, 2 * shape.size.x(), shape.size.y(), entity);
      break;
    case Kind::kCapsule:
      AddCapsule(pose, 2 * shape.size.x(), shape.size.y(), entity);
      break;
    case Kind::kMesh: {
      const RobotDrawing::Mesh& mesh = drawing.meshes[static_cast<size_t>(drawing.mesh[index])];
      foxglove::TriangleListPrimitive* const triangles = entity->add_triangles();
      Fill(pose, triangles->mutable_pose());
      for (size_t v = 0; v + 2 < mesh.vertices.size(); v += 3) {
        const Vector3d vertex(mesh.vertices[v], mesh.vertices[v + 1], mesh.vertices[v + 2]);
        Fill(Vector3d(vertex.cwiseProduct(shape.size)), triangles->add_points());
      }
      for (const unsigned vertex : mesh.indices) triangles->add_indices(vertex);
      Fill(kSolid, triangles->mutable_color());
    }
  }
}

void RobotFrames::DrawCapsule(int body, foxglove::SceneEntity* entity) const {
  const Isometry3d to_link = links_[static_cast<size_t>(body)].in_body.inverse();
  bool any = false;
  for (const robot::Joint& joint : model_.joints()) {
    if (model_.bodies()[static_cast<size_t>(joint.body)].parent != body) continue;
    const Vector3d end = joint.origin.translation();
    Isometry3d pose = Isometry3d::Identity();
    pose.translation() = end / 2;
    if (end.norm() > 0) {
      pose.linear() = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), end).toRotationMatrix();
    }
    AddCapsule(to_link * pose, kBone, end.norm(), entity);
    any = true;
  }
  if (!any)
    AddSphere(to_link * model_.bodies()[static_cast<size_t>(body)].com, kBone, kSolid, entity);
}

foxglove::SceneUpdate RobotFrames::Picture(const RobotDrawing& drawing, int64_t utime) const {
  foxglove::SceneUpdate scene;
  std::map<int, foxglove::SceneEntity*> entities;
  const auto entity_of = [&](int body) {
    foxglove::SceneEntity*& entity = entities[body];
    if (entity == nullptr) {
      entity = AddEntity(utime, link(body), link(body), &scene);
      entity->set_frame_locked(true);
    }
    return entity;
  };
  for (size_t i = 0; i < drawing.shapes.size(); ++i) {
    DrawShape(drawing, i, entity_of(drawing.body[i]));
  }
  for (const int body : drawing.capsules) DrawCapsule(body, entity_of(body));
  return scene;
}

}  // namespace poise
