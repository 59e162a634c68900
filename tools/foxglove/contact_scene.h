// Forces between robot and ground, and where the robot stands, as Foxglove's scenes.
#pragma once

#include "components/balance/convex_polygon.h"
#include "components/robot/robot_model.h"
#include "tools/foxglove/foxglove.pb.h"
#include "tools/foxglove/tick_messages.h"

namespace poise {

/// m of arrow a newton.
inline constexpr double kMetresPerNewton = 1.0 / 900;

class ContactScene {
 public:
  /// `model` must outlive it.
  explicit ContactScene(const robot::RobotModel& model);

  /// Each foot's ground force on the robot at its centre of pressure, measured (ROBOT_SENSORS) and
  /// computed (JOINT_COMMAND), and the push. Entities that the tick does not tell are empty.
  foxglove::SceneUpdate Forces(const TickMessages& tick) const;
  /// Soles, support polygon, the region that the centre of pressure is kept in, centre of pressure
  /// computed and measured, capture point, foothold of a step, COM.
  foxglove::SceneUpdate Support(const TickMessages& tick) const;

 private:
  void AddFootForces(const std::vector<wrench_t>& wrenches, const std::vector<pose_t>& soles,
                     double diameter, const char* id, int64_t utime,
                     foxglove::SceneUpdate* scene) const;

  const robot::RobotModel& model_;
  std::vector<balance::ConvexPolygon> soles_;  // each in its own frame
  double least_load_;                          // N, of a foot whose force is shown
};

/// Sole poses: true ones where the tick has them; empty when it has none.
std::vector<pose_t> SolePoses(const TickMessages& tick);

}  // namespace poise
