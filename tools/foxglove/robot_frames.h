// The robot's links as frames of a transform tree, and what is drawn in them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "components/robot/dynamics.h"
#include "components/robot/robot_model.h"
#include "tools/foxglove/foxglove.pb.h"
#include "tools/robot/robot_drawing.h"

namespace poise {

/// Frames named as the links of the maker's file, where that has them. The robot file may have
/// turned a body's frame: what is given here is the link's own.
class RobotFrames {
 public:
  /// `model` must outlive it.
  explicit RobotFrames(const robot::RobotModel& model);

  /// The link that a body's joint carries; of body 0 the root link.
  const std::string& link(int body) const { return links_[static_cast<size_t>(body)].name; }

  /// World to root link, and each moving link in the one that its joint hangs from.
  foxglove::FrameTransforms Moving(const robot::RobotState& state, int64_t utime);
  /// The links that are fixed to others.
  foxglove::FrameTransforms Fixed(int64_t utime) const;
  /// A further frame, fixed to a body at `pose` in the body's frame.
  void AddFixed(int body, const std::string& name, const Eigen::Isometry3d& pose,
                foxglove::FrameTransforms* transforms) const;
  /// What the robot looks like: an entity a link, fixed to the link's frame.
  foxglove::SceneUpdate Picture(const RobotDrawing& drawing, int64_t utime) const;

 private:
  struct Link {
    std::string name;
    Eigen::Isometry3d in_body;  // the link's frame in the body's
  };
  void DrawShape(const RobotDrawing& drawing, size_t shape, foxglove::SceneEntity* entity) const;
  void DrawCapsule(int body, foxglove::SceneEntity* entity) const;

  const robot::RobotModel& model_;
  std::vector<Link> links_;  // by body
  robot::RobotData data_;
};

}  // namespace poise
