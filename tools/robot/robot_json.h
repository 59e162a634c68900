// A robot as JSON, for drawing it.
#pragma once

#include <Eigen/Geometry>
#include <nlohmann/json_fwd.hpp>

#include "components/robot/robot_model.h"
#include "logging/run_record.h"
#include "tools/robot/robot_drawing.h"

namespace poise {

/// {"position" m, "orientation" w, x, y, z}.
nlohmann::ordered_json PoseJson(const Eigen::Isometry3d& pose);

/// Bodies (parent, joint, origin in the parent, axis), joints with their limits, soles, and what is
/// drawn of it.
nlohmann::ordered_json RobotJson(const robot::RobotModel& model, const RobotDrawing& drawing);
/// The run's, with meshes where the maker's file and they are still where the run found them.
nlohmann::ordered_json RobotJson(const logging::RunRecord& run);

}  // namespace poise
