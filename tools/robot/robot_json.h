// A robot as JSON, for drawing it.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string_view>

#include "components/robot/robot_model.h"
#include "logging/run_record.h"

namespace poise {

/// A robot and the URDF that it was read from: bodies (parent, joint, origin in the parent, axis), joints with their limits,
/// soles, and the boxes, cylinders and spheres of the URDF's visual elements in body frames. Poses
/// are {"position" m, "orientation" w, x, y, z}. A visual that is a mesh, or that cannot be read,
/// is left out: nothing but the drawing depends on it.
nlohmann::ordered_json RobotJson(const robot::RobotModel& model, std::string_view urdf);
/// The run's.
nlohmann::ordered_json RobotJson(const logging::RunRecord& run);

}  // namespace poise
