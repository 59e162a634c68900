// The feet's measured load, filtered.
#pragma once

#include "components/framework/component_type.h"
#include "gait_lab_messages/message_traits.hpp"
#include "poise/robot_state_t.hpp"

namespace gait_lab {

/// ROBOT_STATE -> FOOT_LOAD.
class FootLoad : public poise::Component {
 public:
  void Configure(const poise::ComponentContext& context, poise::Wiring* wiring) override;
  bool Archive(poise::StateArchive* archive) override;

 private:
  void Filter();

  poise::Input<poise::robot_state_t> robot_state_;
  poise::Output<foot_load_t> foot_load_;
  double gain_ = 1;  // of a new reading, per tick
  bool started_ = false;
};

poise::ComponentType FootLoadType();

}  // namespace gait_lab
