// Forces between robot and ground, and where the robot stands, as Foxglove's scenes.
#pragma once

#include "components/balance/convex_polygon.h"
#include "components/robot/robot_model.h"
#include "logging/derived/tick_messages.h"
#include "tools/foxglove/foxglove.pb.h"

namespace poise {

class ContactScene {
 public:
  explicit ContactScene(const robot::RobotModel& model);

  /// Each foot's ground force on the robot at its centre of pressure (DERIVED), measured
  /// or observed (ROBOT_STATE) and computed (JOINT_COMMAND), and the push. Entities that the tick
  /// does not tell are empty.
  foxglove::SceneUpdate Forces(const logging::TickMessages& tick) const;
  /// Soles, support polygon, the region that the centre of pressure is kept in, centre of pressure
  /// computed and measured, capture point, foothold of a step, COM.
  foxglove::SceneUpdate Support(const logging::TickMessages& tick) const;

 private:
  std::vector<balance::ConvexPolygon> soles_;  // each in its own frame
};

}  // namespace poise
