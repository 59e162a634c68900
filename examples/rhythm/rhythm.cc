// Steps on the spot at a rhythm: a planner of footsteps of one's own.
#include "components/framework/component_type.h"
#include "components/framework/module_entry.h"
#include "components/messages/robot_resource.h"
#include "components/robot/posture.h"
#include "poise/message_traits.hpp"
#include "poise/robot_state_t.hpp"
#include "rhythm.pb.h"
#include "steps/message_traits.hpp"

namespace poise {
std::string_view rhythm_lab_schema();  // generated from PROTOS
}

namespace rhythm {

/// ROBOT_STATE -> STRIDE.
class Rhythm : public poise::Component {
 public:
  void Configure(const poise::ComponentContext& context, poise::Wiring* wiring) override {
    const auto config = context.config<RhythmConfig>();
    const auto model = poise::LoadRobot(context);
    wiring->AddInput(&robot_state_, "robot_state", poise::JointAndFootCounts(*model));
    wiring->AddOutput(&stride_, "stride", {});
    stride_->period = config.period();
    stride_->left[0] = -poise::robot::StandingSpacing(*model);  // of the right foot
    stride_->left[1] = poise::robot::StandingSpacing(*model);
    wiring->AddStage("plan", {&robot_state_}, {&stride_}, [this, config](const poise::Tick& tick) {
      stride_->walks = tick.time >= config.from() && tick.time < config.until() ? 1 : 0;
    });
  }
  bool Archive(poise::StateArchive*) override { return true; }  // it keeps nothing

 private:
  poise::Input<poise::robot_state_t> robot_state_;
  poise::Output<steps::stride_t> stride_;
};

poise::ComponentType RhythmType() {
  return {
      "rhythm",
      "steps on the spot at a rhythm",
      [] { return std::make_unique<Rhythm>(); },
      {},
      {poise::Reads<poise::robot_state_t>("robot_state"), poise::Writes<steps::stride_t>("stride")},
      RhythmConfig::descriptor(),
      poise::rhythm_lab_schema};
}

}  // namespace rhythm

POISE_MODULE { poise::AddComponent(rhythm::RhythmType()); }
