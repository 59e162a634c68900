// A controller that is late or lost while the robot starts: the paper's robot, all components in
// one process, in lockstep, so that no machine's speed matters.
#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>

#include "components/framework/runners/inline_runner.h"
#include "poise/bridge_status_t.hpp"
#include "poise/ground_truth_t.hpp"
#include "poise/joint_command_t.hpp"
#include "tools/scenario/registry.h"
#include "tools/scenario/run_setup.h"
#include "tools/scenario/scenario_loading.h"

namespace poise {
namespace {

using Lost = std::function<bool(int64_t tick)>;

/// A component whose command is none in some ticks: the bridge refuses it as stale, as it does one
/// that is sent again for want of a new one.
class Loser final : public Component {
 public:
  Loser(std::unique_ptr<Component> inner, Lost lost)
      : inner_(std::move(inner)), lost_(std::move(lost)) {}

  void Configure(const ComponentContext& context, Wiring* wiring) override {
    inner_->Configure(context, &inner_wiring_);
    const Wiring& inner = inner_wiring_;
    for (InputPort* port : inner.inputs()) {
      wiring->AddInput(port, port->name(), port->counts(), port->kind());
    }
    for (OutputPort* port : inner.outputs()) {
      wiring->AddOutput(port, port->name(), port->counts());
    }
    for (const Stage& stage : inner.stages()) {
      wiring->AddStage(stage.name, stage.inputs, stage.outputs, [this, &stage](const Tick& tick) {
        stage.run(tick);
        if (stage.outputs.empty() || !lost_(tick.index)) return;
        const void* message = stage.outputs.at(0)->message();
        auto* command = static_cast<joint_command_t*>(const_cast<void*>(message));
        command->status = joint_command_t::STATUS_INVALID_INPUT;
      });
    }
  }

 private:
  std::unique_ptr<Component> inner_;
  Wiring inner_wiring_;
  Lost lost_;
};

struct Outcome {
  std::string end;                           ///< empty: it stood to the planned end
  int64_t let_go = -1, first_followed = -1;  ///< ticks
  double least_height = 1;                   ///< m, of the true COM
  double com_moved = 0;                      ///< m, from the scenario's time 0 to the end
  double moved_before = 0;                   ///< m, from the start to the scenario's time 0
  double crane_force = 0;                    ///< N, largest
  bool crane_at_zero = false;
};

/// Starts push_double_support without its push, as `poise run --realtime` would.
Outcome Start(const Lost& lost, std::vector<std::string> set = {}, bool realtime = true) {
  RunChanges changes;
  changes.realtime = realtime;
  changes.duration = 1;
  changes.set = std::move(set);
  changes.set.insert(changes.set.begin(), "sim.push=");
  const RunSpec spec = SetUpRun("push_double_support", changes).spec;
  ComponentRegistry registry;
  for (const auto& [type, entry] : Components().entries()) {
    ComponentFactory factory = entry.make;
    if (type == "redistributor") {
      factory = [factory, lost] { return std::make_unique<Loser>(factory(), lost); };
    }
    registry.Add(type, entry.summary, std::move(factory));
  }
  InlineRunner runner(spec, registry);
  Outcome outcome;
  Eigen::Vector3d start = Eigen::Vector3d::Zero();
  runner.set_tap([&](int, const OutputPort& port, const Tick& tick) {
    if (port.name() == "bridge_status") {
      const auto& status = *static_cast<const bridge_status_t*>(port.message());
      if (status.state == bridge_status_t::STATE_RUNNING && outcome.first_followed < 0) {
        outcome.first_followed = tick.index;
      }
    }
    if (port.name() != "ground_truth") return;
    const auto& truth = *static_cast<const ground_truth_t*>(port.message());
    const Eigen::Vector3d com(truth.com_position);
    outcome.least_height = std::min(outcome.least_height, com.z());
    outcome.crane_force = std::max(outcome.crane_force, Eigen::Vector3d(truth.crane_force).norm());
    if (truth.crane_share == 0 && outcome.let_go < 0) outcome.let_go = tick.index;
    if (tick.index == 0) start = com;
    if (tick.index == spec.lead_ticks()) {
      outcome.moved_before = (com - start).norm();
      start = com;
      outcome.crane_at_zero = truth.crane_share > 0;
    }
    outcome.com_moved = (com - start).norm();
  });
  runner.Run(spec.num_ticks());
  outcome.end = runner.end_detail();
  return outcome;
}

/// Stands, freely, from the scenario's time 0 on.
void ExpectStands(const Outcome& outcome) {
  EXPECT_EQ(outcome.end, "");
  EXPECT_FALSE(outcome.crane_at_zero);
  EXPECT_GT(outcome.least_height, 0.73);  // started at 0.75
  EXPECT_LT(outcome.com_moved, 2e-3);
}

const Lost kNever = [](int64_t) { return false; };

TEST(LateStart, TheCraneCarriesLittleOfARobotThatIsControlledAndLetsGoInTime) {
  const Outcome outcome = Start(kNever);
  ExpectStands(outcome);
  EXPECT_EQ(outcome.first_followed, 0);
  // 0.3 s of following, then a second.
  EXPECT_NEAR(static_cast<double>(outcome.let_go), 650, 3);
  EXPECT_LT(outcome.crane_force, 150);  // of 500 N of weight
}

TEST(LateStart, AControllerThatIsLateByAnyTimeFindsTheRobotUp) {
  for (const int64_t late : {1, 25, 151, 500}) {
    const Outcome outcome = Start([late](int64_t tick) { return tick < late; });
    SCOPED_TRACE(late);
    ExpectStands(outcome);
    EXPECT_EQ(outcome.first_followed, late);
    EXPECT_NEAR(static_cast<double>(outcome.let_go), static_cast<double>(late + 650), 3);
  }
}

TEST(LateStart, WithoutCraneAndHoldTheSameControllerFindsItFallen) {
  const Outcome outcome = Start([](int64_t tick) { return tick < 26; }, {}, /*realtime=*/false);
  EXPECT_NE(outcome.end.find("the robot fell at 0.302 s"), std::string::npos) << outcome.end;
}

TEST(LateStart, AControllerThatIsLostWhileTheCraneLetsGoFindsTheRobotUp) {
  for (const int64_t lost : {0, 150, 400, 640}) {
    const Outcome outcome =
        Start([lost](int64_t tick) { return tick >= lost && tick < lost + 60; });
    SCOPED_TRACE(lost);
    ExpectStands(outcome);
    EXPECT_GT(outcome.let_go, lost + 60 + 150);
  }
}

TEST(LateStart, TheFirstPhasesMoveWaitsForTheScenario) {
  const Outcome outcome =
      Start(kNever, {"step_planner.phase[0].com.target=SHIFT", "step_planner.phase[0].com.x=0.02",
                     "step_planner.phase[0].com.duration=0.5"});
  EXPECT_EQ(outcome.end, "");
  EXPECT_LT(outcome.moved_before, 5e-3);
  EXPECT_NEAR(outcome.com_moved, 0.02, 4e-3);
}

TEST(LateStart, AControllerThatNeverComesEndsTheRunWithoutAFall) {
  const Outcome outcome = Start([](int64_t) { return true; });
  EXPECT_NE(outcome.end.find("the crane still holds the robot at 0.000 s"), std::string::npos)
      << outcome.end;
  EXPECT_TRUE(outcome.crane_at_zero);
  EXPECT_GT(outcome.least_height, 0.73);
}

TEST(LateStart, ARunInLockstepHasNeitherCraneNorLead) {
  const LoadedScenario loaded = LoadScenario("push_double_support", {});
  EXPECT_FALSE(loaded.scenario.sim().has_crane());
  EXPECT_EQ(loaded.scenario.lead(), 0);
  EXPECT_FALSE(loaded.scenario.hw_bridge().hold_before_command());
  RunChanges realtime;
  realtime.realtime = true;
  realtime.set = {"sim.crane=", "lead=0", "hw_bridge.hold_before_command=false"};
  const LoadedScenario taken_away = LoadScenario("push_double_support", realtime);
  EXPECT_FALSE(taken_away.scenario.sim().has_crane());
  EXPECT_EQ(taken_away.scenario.lead(), 0);
}

}  // namespace
}  // namespace poise
