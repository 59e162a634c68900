// Components that share a process, against the same components in processes of their own and
// inline.
#include <gmock/gmock.h>
#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "components/framework/configuration/configuration.h"
#include "components/framework/graph.h"
#include "components/framework/run.h"
#include "components/framework/runners/process_runner.h"
#include "tests/framework/process_harness.h"
#include "tests/framework/toy_components.h"

namespace poise {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// Puts components of `graph` into the process "host".
Graph Hosted(Graph graph, const std::vector<std::string>& names) {
  for (ComponentInstance& instance : *graph.mutable_component()) {
    if (std::ranges::find(names, instance.name()) != names.end()) instance.set_process("host");
  }
  return graph;
}

/// Every way to put two or three of the loop into one process. In {controller, plant} the stages of
/// both wait for the filter between them.
const std::vector<std::vector<std::string>> kLoopGroups = {{"controller", "filter"},
                                                           {"controller", "plant"},
                                                           {"filter", "plant"},
                                                           {"controller", "filter", "plant"}};

TEST(Hosting, EveryGroupingGivesTheBytesOfTheInlineRunner) {
  for (const auto& group : kLoopGroups) {
    SCOPED_TRACE(testing::PrintToString(group));
    const RunSpec spec = ToyRun(Hosted(ToyLoop(), group), 500);
    const ProcessRun run = RunAsProcesses(spec);
    ExpectEqualToInline(spec, run, 500);
    EXPECT_EQ(run.health.size(), 3u);  // one a component, as ever
    for (const auto& [name, health] : run.health) {
      EXPECT_EQ(health.state, health_t::STATE_FINISHED) << name;
      EXPECT_EQ(health.messages_refused, 0) << name;
      EXPECT_EQ(health.publish_errors, 0) << name;
      EXPECT_EQ(health.ticks_completed, 500) << name;
      EXPECT_GT(health.latency_median, 0) << name;
    }
  }
}

TEST(Hosting, MessagesBetweenThemDoNotGoOverTheBus) {
  const RunSpec spec = ToyRun(Hosted(ToyLoop(), {"controller", "filter"}), 300);
  const ProcessRun run = RunAsProcesses(spec);
  ExpectEqualToInline(spec, run, 300);
  // One channel, and for the controller two inputs of it; a third would bring 300 more.
  EXPECT_NEAR(static_cast<double>(run.health.at("filter").messages_received), 300, 50);
  EXPECT_NEAR(static_cast<double>(run.health.at("controller").messages_received), 600, 100);
}

TEST(Hosting, StaysEqualWhenMessagesAreLost) {
  for (const auto& group : kLoopGroups) {
    SCOPED_TRACE(testing::PrintToString(group));
    RunSpec spec = ToyRun(Hosted(ToyLoop(), group), 300);
    spec.set_drop_rate(0.1);
    const ProcessRun run = RunAsProcesses(spec, {.reverse = true});
    ExpectEqualToInline(spec, run, 300);
    int64_t dropped = 0;
    for (const auto& [name, health] : run.health) dropped += health.messages_dropped;
    // All three in one process hear nobody.
    if (group.size() == 3) {
      EXPECT_EQ(dropped, 0);
    } else {
      EXPECT_GT(dropped, 15);
    }
  }
}

TEST(Hosting, AFastSourceDoesNotWaitForWhoSharesItsProcess) {
  RunSpec spec = ToyRun(Hosted(ToyChain(), {"clock", "sink"}), 1000);
  ExpectEqualToInline(spec, RunAsProcesses(spec), 1000);
}

TEST(Hosting, ATickDoesNotAllocate) {
  for (const auto& group : kLoopGroups) {
    SCOPED_TRACE(testing::PrintToString(group));
    RunSpec spec = ToyRun(Hosted(ToyLoop(), group), 0);
    spec.set_drop_rate(0.02);
    // The one whose tick ends last: an end itself allocates.
    Configure(&spec, "controller", "finish_at: 600 report_allocations: true");
    const ProcessRun run = RunAsProcesses(spec);
    ASSERT_FALSE(run.timed_out);
    EXPECT_EQ(run.health.at("controller").detail, "allocations: 0");
  }
}

TEST(Hosting, TheOneThatEndsTheRunIsNamed) {
  for (const bool fail : {false, true}) {
    RunSpec spec = ToyRun(Hosted(ToyLoop(), {"controller", "plant"}), 0);
    Configure(&spec, "plant", fail ? "finish_at: 123 fail: true" : "finish_at: 123");
    const ProcessRun run = RunAsProcesses(spec);
    ExpectEqualToInline(spec, run, 124);
    EXPECT_EQ(run.health.at("plant").state,
              fail ? health_t::STATE_FAILED : health_t::STATE_FINISHED);
    EXPECT_EQ(run.health.at("plant").detail, "toy finished");
    EXPECT_EQ(run.health.at("controller").state, health_t::STATE_FINISHED);
    EXPECT_EQ(run.health.at("controller").detail, "");
    EXPECT_EQ(run.health.at("controller").tick, 123);
  }
}

TEST(Hosting, ANumberThatIsNotFiniteIsNotReadByTheNext) {
  RunSpec spec = ToyRun(Hosted(ToyLoop(), {"controller", "plant"}), 0);
  Configure(&spec, "plant", "nan_at: 50");
  const ProcessRun run = RunAsProcesses(spec);
  ASSERT_FALSE(run.timed_out);
  EXPECT_EQ(run.health.at("plant").state, health_t::STATE_FAILED);
  EXPECT_EQ(run.health.at("plant").detail, "output sensors is not finite at tick 50");
  EXPECT_EQ(run.health.at("controller").tick, 49);
  EXPECT_EQ(run.exit_codes.at("host"), 1);
  EXPECT_EQ(run.exit_codes.at("filter"), 0);
}

/// The registry and the run of `spec` with what FillPlan adds.
struct Prepared {
  explicit Prepared(RunSpec run) : spec(std::move(run)) {
    AddToyComponents(&registry);
    FillPlan(BoundGraph(spec, registry).plan(), spec.mutable_graph());
  }
  std::string Error(const std::string& process) const {
    const RunSource source(spec);
    ProcessRunnerOptions options;
    options.socket = &source.socket();
    try {
      ProcessRunner(spec, process, registry, options);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  }
  ComponentRegistry registry;
  RunSpec spec;
};

TEST(Hosting, ThePlanGivesTheStagesTheirPlaces) {
  const Prepared run(ToyRun(Hosted(ToyLoop(), {"controller", "plant"}), 10));
  // plant.step, controller.prepare, filter.filter, controller.control
  EXPECT_THAT(run.spec.graph().component(0).stage_place(), ElementsAre(1, 3));
  EXPECT_EQ(run.spec.graph().component(1).stage_place_size(), 0);  // alone
  EXPECT_THAT(run.spec.graph().component(2).stage_place(), ElementsAre(0));
}

TEST(Hosting, RefusesWhatCannotWork) {
  Prepared run(ToyRun(Hosted(ToyLoop(), {"controller", "plant"}), 10));
  EXPECT_THAT(run.Error("controller"),
              HasSubstr("has no process 'controller'; it has host, filter"));
  run.spec.mutable_graph()->mutable_component(0)->clear_stage_place();
  EXPECT_THAT(run.Error("host"), HasSubstr("controller: the run gives the places of 0 of its 2"));

  // In real time a follower may skip a tick: who reads the tick before would wait for ever.
  Graph echo;
  ParseTextProto(R"(
    name: "echo"
    channel { name: "PUSH" type: "external_push_t" }
    channel { name: "SUM" type: "external_push_t" }
    channel { name: "ECHO" type: "external_push_t" }
    component {
      name: "clock" type: "toy_clock" owns_clock: true
      output { port: "push" channel: "PUSH" }
    }
    component {
      name: "sink" type: "toy_sink" process: "both"
      input { port: "push" channel: "PUSH" } output { port: "sum" channel: "SUM" }
    }
    component {
      name: "echo" type: "toy_echo" process: "both"
      input { port: "push" channel: "PUSH" } input { port: "before" channel: "SUM" }
      output { port: "sum" channel: "ECHO" }
    })",
                 "echo", &echo);
  Prepared lockstep(ToyRun(echo, 200));
  ExpectEqualToInline(lockstep.spec, RunAsProcesses(lockstep.spec), 200);
  Prepared realtime(lockstep.spec);
  realtime.spec.set_realtime(true);
  EXPECT_THAT(realtime.Error("both"), HasSubstr("another's message of the tick before"));
}

TEST(Hosting, AComponentsOwnProgramRefusesToRunItAlone) {
  const std::string path = testing::TempDir() + "/hosted_" + std::to_string(getpid()) + ".pbtxt";
  std::string text;
  google::protobuf::TextFormat::PrintToString(ToyRun(Hosted(ToyLoop(), {"filter", "plant"}), 1),
                                              &text);
  std::ofstream(path) << text;
  const auto [code, error] =
      RunProgram({TOY_PROCESS, "toy_filter", "--run", path, "--component", "filter"});
  EXPECT_EQ(code, 2);
  EXPECT_THAT(error, HasSubstr("filter shares process host with others; run: component_host"));
  const auto [host_code, host_error] = RunProgram({TOY_PROCESS, "host", "--run", path});
  EXPECT_EQ(host_code, 2);
  EXPECT_THAT(host_error, HasSubstr("--process is required; see component_host --help"));
  unlink(path.c_str());
}

}  // namespace
}  // namespace poise
