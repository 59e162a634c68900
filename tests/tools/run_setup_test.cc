// What a run's components are configured with: by its scenario, by its ports, by a replay's --set.
#include "tools/scenario/run_setup.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "fmt/format.h"
#include "tools/scenario/scenario_loading.h"

namespace poise {
namespace {

RunSpec SpecOf(const std::string& scenario, const std::vector<std::string>& set) {
  RunChanges changes;
  changes.set = set;
  return MakeRunSpec(LoadScenario(scenario, changes), changes);
}

bool Warns(const std::string& scenario, const std::string& set, const std::string& beginning) {
  RunChanges changes;
  changes.set = {set};
  return std::ranges::any_of(SetUpRun(scenario, changes).warnings,
                             [&](const std::string& text) { return text.starts_with(beginning); });
}

TEST(SetUpRun, WarnsOfAPushAfterTheRunsEnd) {
  for (const auto& [start, warned] : {std::pair{"2.9", false}, {"3", true}, {"10", true}}) {
    EXPECT_EQ(Warns("push_double_support", fmt::format("sim.push[0].start={}", start),
                    "sim.push[0].start: "),
              warned)
        << start;
  }
}

TEST(SetUpRun, WarnsOfACommandToWalkThatNobodyFollows) {
  const std::string command = "step_planner.walk.command has no effect";
  EXPECT_FALSE(Warns("walk", "step_planner.walk.enabled=true", command));
  EXPECT_TRUE(Warns("walk", "step_planner.walk.enabled=false", command));
}

// Else emulated drives of two runs would answer each other's bridge, or a robot's.
TEST(ChoosePorts, GivesBothEndsOfEmulatedDrivesWhatIsThisRunsAlone) {
  for (const std::string drives : {"ethercat", "unitree"}) {
    RunChanges changes;
    changes.drives = drives;
    const LoadedScenario loaded = LoadScenario("stand", changes);
    RunSpec spec = MakeRunSpec(loaded, changes);
    const RunSpec before = spec;
    const RunSource source = ChoosePorts(loaded.scenario, &spec);
    const std::string own =
        drives == "ethercat"
            ? fmt::format("port: {}\n", spec.first_port() + 3 + spec.graph().channel_size())
            : fmt::format("tag: \"poise-{}-{}\"\n", spec.run_id(), spec.first_port());
    ASSERT_EQ(spec.config_size(), before.config_size());
    int ends = 0;
    for (int i = 0; i < spec.config_size(); ++i) {
      const std::string& text = spec.config(i).text();
      const bool end = text.find(own) != std::string::npos;
      ends += end ? 1 : 0;
      EXPECT_EQ(text == before.config(i).text(), !end) << spec.config(i).component();
    }
    EXPECT_EQ(ends, 2) << drives;
  }
}

struct Change {
  const char* scenario;
  std::vector<std::string> set;
};

// A planner that walks or recovers has a channel more.
TEST(ChangeConfigurations, GiveWhatARunWithTheSameSettingsHas) {
  const std::vector<Change> all{
      {"stand", {"task_controller.com.kp=150"}},
      {"stand", {"step_planner.walk.enabled=true"}},
      {"stand",
       {"task_controller.foot.kp=700", "step_planner.walk.enabled=true",
        "task_controller.foot.kd=60", "sim.ground.friction=0.5", "ode.contact_erp=0.3"}},
      {"stand", {"step_planner.recovery.enabled=true"}},
      {"walk", {"step_planner.walk.command[0].vx=0.05"}},
  };
  for (const Change& change : all) {
    const RunSpec wanted = SpecOf(change.scenario, change.set);
    RunSpec changed = SpecOf(change.scenario, {});
    ChangeConfigurations(change.set, &changed);
    const std::string name = change.scenario + (" " + change.set.back());
    ASSERT_EQ(changed.config_size(), wanted.config_size()) << name;
    for (int i = 0; i < wanted.config_size(); ++i) {
      EXPECT_EQ(changed.config(i).component(), wanted.config(i).component()) << name;
      EXPECT_EQ(changed.config(i).text(), wanted.config(i).text()) << name;
    }
    EXPECT_EQ(changed.graph().ShortDebugString(), wanted.graph().ShortDebugString()) << name;
  }
}

}  // namespace
}  // namespace poise
