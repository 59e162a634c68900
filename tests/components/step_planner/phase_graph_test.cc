// Plans that cannot work are refused, by the field that is wrong; those that can follow their
// arrows.
#include "components/step_planner/phase_graph.h"

#include <gtest/gtest.h>

#include <string>

#include "components/framework/configuration/configuration.h"
#include "components/framework/configuration/field_rules.h"
#include "components/step_planner/planner_config.h"

namespace poise {
namespace {

StepPlannerConfig Parse(const std::string& text) {
  StepPlannerConfig config;
  ParseTextProto(text, "test", &config);
  CheckStepPlannerConfig(config);
  return config;
}

TEST(PhaseGraph, ByDefaultThePhasesFollowEachOther) {
  const PhaseGraph graph(Parse("phase { duration: 1 } phase { duration: 0 } phase { }"));
  EXPECT_EQ(graph.size(), 3);
  EXPECT_EQ(graph.Follower(0, DONE), 1);
  EXPECT_EQ(graph.Follower(1, DONE), 2);
  EXPECT_EQ(graph.Follower(2, DONE), PhaseGraph::kNone);
  for (const Outcome outcome : {NO_SURFACE, CONTACT_LOST, TIMEOUT}) {
    EXPECT_EQ(graph.Follower(0, outcome), PhaseGraph::kNone);
  }
}

TEST(PhaseGraph, ArrowsLeadWhereTheyAreTold) {
  const PhaseGraph graph(Parse(R"(
    phase { name: "stand" duration: 1 next { to: "down" }
            next { on: CONTACT_LOST foot: LEFT_FOOT to: "right" } }
    phase { name: "right" support: RIGHT }
    phase { name: "down" duration: 1 support: RIGHT timeout: 2
            next { on: NO_SURFACE to: "right" } next { on: TIMEOUT to: "down" }
            next { to: "stand" } next { on: CONTACT_LOST to: "right" } }
  )"));
  EXPECT_EQ(graph.Follower(0, DONE), 2);
  EXPECT_EQ(graph.Follower(0, CONTACT_LOST, robot::Foot::kLeft), 1);
  EXPECT_EQ(graph.Follower(0, CONTACT_LOST, robot::Foot::kRight), PhaseGraph::kNone);
  EXPECT_EQ(graph.Follower(1, DONE), PhaseGraph::kNone);
  EXPECT_EQ(graph.Follower(2, DONE), 0);
  EXPECT_EQ(graph.Follower(2, NO_SURFACE), 1);
  EXPECT_EQ(graph.Follower(2, TIMEOUT), 2);
  for (const robot::Foot foot : robot::kFeet) {
    EXPECT_EQ(graph.Follower(2, CONTACT_LOST, foot), 1);
  }
}

TEST(PhaseGraph, SaysWhatANameMayHaveBeen) {
  try {
    Parse("phase { name: 'lower' duration: 1 next { to: 'lowr' } } phase { }");
    FAIL();
  } catch (const ConfigError& error) {
    EXPECT_NE(error.problem().find("did you mean lower?"), std::string::npos) << error.problem();
  }
}

struct Refused {
  const char* text;
  const char* field;
};

class RefusedConfig : public testing::TestWithParam<Refused> {};

TEST_P(RefusedConfig, NamesTheField) {
  try {
    StepPlannerConfig config;
    ParseTextProto(GetParam().text, "test", &config);
    CheckFields(config);
    CheckStepPlannerConfig(config);
    FAIL() << "accepted: " << GetParam().text;
  } catch (const ConfigError& error) {
    EXPECT_EQ(error.field(), GetParam().field) << error.what();
    EXPECT_FALSE(error.problem().empty());
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
  }
}

#define UNLOAD_LEFT "transition { kind: UNLOAD foot: LEFT_FOOT delay: 0.5 duration: 0.5 } "
#define LOAD_LEFT "transition { kind: LOAD foot: LEFT_FOOT } "

INSTANTIATE_TEST_SUITE_P(
    Settings, RefusedConfig,
    testing::Values(Refused{"", "phase"},
                    Refused{"contact { touch_load: 0 }", "contact.touch_load"},
                    Refused{"contact { touch_load: nan }", "contact.touch_load"},
                    Refused{"contact { search_depth: -0.01 }", "contact.search_depth"},
                    Refused{"walk { clearance: 0 }", "walk.clearance"},
                    Refused{"walk { gap: -1 }", "walk.gap"}));

INSTANTIATE_TEST_SUITE_P(
    Phases, RefusedConfig,
    testing::Values(
        Refused{"phase { duration: -1 } phase { }", "phase[0].duration"},
        Refused{"phase { duration: 1 } phase { duration: inf } phase { }", "phase[1].duration"},
        Refused{"phase { duration: 1 support: RIGHT } phase { support: LEFT }", "phase[1].support"},
        Refused{"phase { com { duration: -1 } }", "phase[0].com.duration"},
        Refused{"phase { com { delay: nan } }", "phase[0].com.delay"},
        Refused{"phase { body { x: nan } }", "phase[0].body.x"},
        Refused{"phase { body { x: 3 y: 1 } }", "phase[0].body"},
        Refused{"phase { gravity_compensation: true body { x: 1 } }",
                "phase[0].gravity_compensation"},
        Refused{"phase { support: RIGHT foot { foot: LEFT_FOOT turn { duration: -1 } } }",
                "phase[0].foot.turn.duration"},
        Refused{"phase { com { y: inf } }", "phase[0].com.y"},
        Refused{"phase { duration: 1 support: RIGHT gravity_compensation: true } "
                "phase { support: DOUBLE }",
                "phase[0].gravity_compensation"},
        Refused{"phase { gravity_compensation: true com { x: 0.1 } }",
                "phase[0].gravity_compensation"},
        Refused{"phase { support: RIGHT foot { z: 0.1 } }", "phase[0].foot.foot"},
        Refused{"phase { support: RIGHT foot { foot: RIGHT_FOOT } }", "phase[0].foot.foot"},
        Refused{"phase { foot { foot: RIGHT_FOOT } }", "phase[0].foot.foot"},
        Refused{"phase { support: RIGHT foot { foot: LEFT_FOOT duration: -2 } }",
                "phase[0].foot.duration"},
        Refused{"phase { transition { foot: LEFT_FOOT } }", "phase[0].transition.kind"},
        Refused{"phase { transition { kind: LOAD } }", "phase[0].transition.foot"},
        Refused{"phase { " UNLOAD_LEFT "}", "phase[0].transition"},
        Refused{"phase { duration: 2 " UNLOAD_LEFT "} phase { }", "phase[0].transition"},
        Refused{"phase { duration: 2 " UNLOAD_LEFT "} phase { support: LEFT }",
                "phase[0].transition"},
        Refused{"phase { duration: 0.9 " UNLOAD_LEFT "} phase { support: RIGHT }",
                "phase[0].transition.duration"},
        Refused{"phase { duration: 2 support: RIGHT " UNLOAD_LEFT "} phase { support: RIGHT }",
                "phase[0].transition"},
        Refused{"phase { " LOAD_LEFT "}", "phase[0].transition"},
        Refused{"phase { duration: 1 support: LEFT } phase { " LOAD_LEFT "}",
                "phase[1].transition"},
        Refused{"phase { duration: 1 support: RIGHT } phase { duration: 1 transition { kind: LOAD "
                "foot: LEFT_FOOT delay: 0.3 duration: 0.8 } } phase { }",
                "phase[1].transition.duration"},
        Refused{"phase { transition { kind: LOAD foot: LEFT_FOOT delay: -1 } }",
                "phase[0].transition.delay"}));

// One foot's way down is "down", "stand" behind it, and whatever follows.
#define DOWN(more) \
  "phase { name: 'down' duration: 1 support: RIGHT " more " } phase { name: 'stand' } "

INSTANTIATE_TEST_SUITE_P(
    Arrows, RefusedConfig,
    testing::Values(
        Refused{"phase { name: 'a' duration: 1 } phase { name: 'a' }", "phase[1].name"},
        Refused{"phase { name: 'a' duration: 1 next { to: 'b' } } phase { name: 'c' }",
                "phase[0].next[0].to"},
        Refused{"phase { duration: 1 next { to: 'b' } } phase { }", "phase[0].next[0].to"},
        Refused{"phase { duration: 1 next { } } phase { }", "phase[0].next[0].to"},
        Refused{"phase { name: 'a' next { to: 'a' } }", "phase[0].duration"},
        Refused{"phase { duration: 1 }", "phase[0].duration"},
        Refused{"phase { name: 'a' duration: 1 next { to: 'a' } next { to: 'a' } }",
                "phase[0].next[1].on"},
        Refused{"phase { name: 'a' next { on: CONTACT_LOST to: 'a' } "
                "next { on: CONTACT_LOST foot: LEFT_FOOT to: 'a' } }",
                "phase[0].next[1].on"},
        Refused{"phase { name: 'a' duration: 1 next { to: 'a' foot: LEFT_FOOT } }",
                "phase[0].next[0].foot"},
        // Never reached.
        Refused{"phase { } phase { }", "phase[1]"},
        Refused{"phase { name: 'a' duration: 1 next { to: 'a' } } phase { duration: 1 } phase { }",
                "phase[1]"},
        // Loops without time.
        Refused{"phase { name: 'a' duration: 0 next { to: 'a' } }", "phase[0].duration"},
        Refused{"phase { duration: 1 } phase { name: 'a' duration: 0 } "
                "phase { duration: 0 next { to: 'a' } }",
                "phase[1].duration"},
        // Outcomes that cannot come, and what they cannot lead to.
        Refused{DOWN("next { on: NO_SURFACE to: 'stand' }"), "phase[0].next[0].to"},
        Refused{DOWN("timeout: 1 next { on: TIMEOUT to: 'stand' }"), "phase[0].next[0].to"},
        Refused{DOWN("next { on: NO_SURFACE to: 'left' }") "phase { name: 'left' support: LEFT }",
                "phase[0].next[0].to"},
        Refused{"phase { name: 'a' next { on: NO_SURFACE to: 'a' } }", "phase[0].next[0].on"},
        Refused{DOWN("next { on: TIMEOUT to: 'down' }"), "phase[0].timeout"},
        Refused{DOWN("timeout: 1"), "phase[0].timeout"},
        Refused{DOWN("timeout: 0 next { on: TIMEOUT to: 'down' }"), "phase[0].timeout"},
        Refused{"phase { name: 'a' duration: 1 timeout: 1 next { on: TIMEOUT to: 'a' } } phase { }",
                "phase[0].timeout"},
        Refused{"phase { next { on: CONTACT_LOST to: 'right' } } "
                "phase { name: 'right' support: RIGHT }",
                "phase[0].next[0].foot"}));

}  // namespace
}  // namespace poise
