#include "foot_load.h"

#include <cmath>

#include "components/messages/archive_message.h"
#include "components/messages/robot_resource.h"
#include "foot_load.pb.h"

namespace poise {
std::string_view gait_lab_schema();  // generated from PROTOS
}

namespace gait_lab {

void FootLoad::Configure(const poise::ComponentContext& context, poise::Wiring* wiring) {
  const auto config = context.config<FootLoadConfig>();
  gain_ =
      config.time_constant() > 0 ? 1 - std::exp(-context.tick_period / config.time_constant()) : 1;
  const auto model = poise::LoadRobot(context);
  wiring->AddInput(&robot_state_, "robot_state", poise::JointAndFootCounts(*model));
  wiring->AddOutput(&foot_load_, "foot_load", poise::FootCounts(*model));
  wiring->AddStage("filter", {&robot_state_}, {&foot_load_},
                   [this](const poise::Tick&) { Filter(); });
}

// What a stage does depends on its inputs and on what it kept. No allocation, exception or output.
void FootLoad::Filter() {
  foot_load_t& out = *foot_load_;
  out.total = 0;
  out.sum = {};
  for (size_t i = 0; i < out.load.size(); ++i) {
    const poise::wrench_t& wrench = robot_state_->foot_wrench[i];
    const double measured = -wrench.force[2];  // the robot on the ground
    out.load[i] = started_ ? out.load[i] + gain_ * (measured - out.load[i]) : measured;
    out.total += out.load[i];
    for (int axis = 0; axis < 3; ++axis) {
      out.sum.force[axis] += wrench.force[axis];
      out.sum.moment[axis] += wrench.moment[axis];
    }
  }
  started_ = true;
}

bool FootLoad::Archive(poise::StateArchive* archive) {
  archive->Show(started_);
  poise::ArchiveMessage(&*foot_load_, archive);
  return true;
}

poise::ComponentType FootLoadType() {
  return {
      "foot_load",
      "load of the feet, filtered",
      [] { return std::make_unique<FootLoad>(); },
      {},
      {poise::Reads<poise::robot_state_t>("robot_state"), poise::Writes<foot_load_t>("foot_load")},
      FootLoadConfig::descriptor(),
      poise::gait_lab_schema};
}

}  // namespace gait_lab
