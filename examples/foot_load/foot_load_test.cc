// The component of examples/foot_load, which docs/start/own_component.md shows.
#include "foot_load.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

namespace poise {
namespace {

using gait_lab::foot_load_t;
using gait_lab::FootLoad;

std::string DyrosFile(const std::string& ending) {
  return ReadFile(POISE_SOURCE_DIR "/deploy/robots/dyros/dyros_legs." + ending);
}

void Configure(const std::string& config, FootLoad* component, Wiring* wiring) {
  const std::map<std::string, std::string> resources = {{"robot", DyrosFile("pbtxt")},
                                                        {"urdf", DyrosFile("urdf")}};
  SharedObjects shared;
  ComponentContext context;
  context.name = "foot_load";
  context.config_text = config;
  context.tick_period = 0.002;
  context.resources = &resources;
  context.shared = &shared;
  component->Configure(context, wiring);
}

// A step of the load against the closed form of a first-order low-pass.
TEST(FootLoadExample, FiltersAStepOfTheLoad) {
  FootLoad component;
  Wiring wiring;
  Configure("time_constant: 0.02", &component, &wiring);
  robot_state_t state;
  const int32_t counts[] = {12, 2};
  MessageTraits<robot_state_t>::Resize(state, counts);
  wiring.inputs()[0]->Bind(&state);
  foot_load_t& out = **static_cast<Output<foot_load_t>*>(wiring.outputs()[0]);
  for (int tick = 0; tick <= 20; ++tick) {
    state.foot_wrench[0].force[2] = tick == 0 ? -100 : -200;
    state.foot_wrench[1].force[2] = -50;
    wiring.stages()[0].run(Tick{});
    const double right = 200 - 100 * std::exp(-tick * 0.002 / 0.02);
    EXPECT_NEAR(out.load[0], right, 1e-9);
    EXPECT_NEAR(out.load[1], 50, 1e-9);
    EXPECT_NEAR(out.total, right + 50, 1e-9);
    EXPECT_EQ(out.sum.force[2], tick == 0 ? -150 : -250);  // as measured
  }
}

TEST(FootLoadExample, RefusesATimeThatCannotBe) {
  FootLoad component;
  Wiring wiring;
  EXPECT_THROW(Configure("time_constant: -1", &component, &wiring), ConfigError);
}

}  // namespace
}  // namespace poise
