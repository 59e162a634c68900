// Every way a graph can be wrong, each with the line its author sees.
#include "components/framework/graph.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "components/framework/optional_ports.h"
#include "components/framework/run.h"
#include "tests/framework/toy_components.h"

namespace poise {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class GraphTest : public ::testing::Test {
 protected:
  GraphTest() { AddToyComponents(&registry_); }

  /// All problems of the graph, one a line; "" when it is right.
  std::string Problems(const Graph& graph, const std::string& controller_config = "",
                       const std::string& filter_config = "") {
    RunSpec spec = ToyRun(graph, 10);
    Configure(&spec, "controller", controller_config);
    Configure(&spec, "filter", filter_config);
    try {
      BoundGraph bound(spec, registry_);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  }
  static void Configure(RunSpec* spec, const std::string& name, const std::string& text) {
    ComponentConfig* config = spec->add_config();
    config->set_component(name);
    config->set_text(text);
  }
  static Connection* FindPort(google::protobuf::RepeatedPtrField<Connection>* connections,
                              const std::string& port) {
    for (Connection& connection : *connections) {
      if (connection.port() == port) return &connection;
    }
    return nullptr;
  }

  ComponentRegistry registry_;
  Graph graph_ = ToyLoop();  // component 0: controller, 1: filter, 2: plant
};

TEST_F(GraphTest, ARightGraphIsPlanned) {
  const BoundGraph bound(ToyRun(graph_, 10), registry_);
  const GraphPlan& plan = bound.plan();
  std::vector<std::pair<int, int>> order;
  for (const GraphPlan::StageRef& ref : plan.order) order.emplace_back(ref.component, ref.stage);
  EXPECT_THAT(order,
              ElementsAre(std::pair(2, 0), std::pair(0, 0), std::pair(1, 0), std::pair(0, 1)));
  EXPECT_THAT(plan.tick_sources, ElementsAre(2));
  EXPECT_EQ(plan.channels[0].writer.component, 2);
  EXPECT_EQ(plan.channels[0].readers.size(), 3u);
  EXPECT_THAT(plan.channels[0].counts, ElementsAre(3, 2));
  EXPECT_EQ(plan.channels[5].writer.component, -1);
  FillPlan(plan, &graph_);
  EXPECT_THAT(graph_.channel(0).count(), ElementsAre(3, 2));
  EXPECT_EQ(graph_.channel(4).count_size(), 0);
}

TEST_F(GraphTest, UnknownComponentType) {
  graph_.mutable_component(1)->set_type("toy_filtre");
  EXPECT_THAT(Problems(graph_),
              HasSubstr("graph toy_loop: component[1].type: component filter: unknown component "
                        "type 'toy_filtre'; types: toy_clock, "
                        "toy_controller, toy_echo, toy_filter, toy_plant, toy_sink; "
                        "modules with others are looked for in"));
}

TEST_F(GraphTest, TheTypeDefaultsToTheName) {
  graph_.mutable_component(1)->clear_type();
  EXPECT_THAT(Problems(graph_),
              HasSubstr("component[1].name: component filter: unknown component type 'filter'"));
  graph_.mutable_component(1)->set_name("toy_filter");
  EXPECT_EQ(Problems(graph_), "");
}

TEST_F(GraphTest, NamesMustBeUniqueAndWellFormed) {
  graph_.mutable_component(1)->set_name("plant");
  EXPECT_EQ(
      Problems(graph_),
      "graph toy_loop: component[2].name: component plant: named twice; names must be unique");
  graph_.mutable_component(1)->set_name("recorder");
  EXPECT_EQ(Problems(graph_),
            "graph toy_loop: component[1].name: component recorder: the name is taken by the "
            "recorder; choose another");
  graph_.mutable_component(1)->set_name("Filter 2");
  EXPECT_THAT(Problems(graph_), HasSubstr("'Filter 2' is no component name"));
  graph_ = ToyLoop();
  *graph_.add_channel() = graph_.channel(0);
  EXPECT_THAT(Problems(graph_), HasSubstr("channel[6].name: channel SENSORS: named twice"));
  graph_.mutable_channel(6)->set_name("sensors");
  EXPECT_THAT(Problems(graph_), HasSubstr("'sensors' is no channel name"));
  for (const char* name : {"CONTROL", "HEALTH_X", "LCM_SELF_TEST"}) {
    graph_.mutable_channel(6)->set_name(name);
    EXPECT_THAT(Problems(graph_), HasSubstr("the name is taken by the framework"));
  }
}

TEST_F(GraphTest, ComponentsOfOneProcessMustAgree) {
  for (ComponentInstance& instance : *graph_.mutable_component()) instance.set_process("host");
  EXPECT_EQ(Problems(graph_), "");
  Graph graph = graph_;
  graph.mutable_component(1)->set_restart(true);
  EXPECT_EQ(Problems(graph),
            "graph toy_loop: component[1].process: component filter: has restart: true, but "
            "controller, in the same process host, has restart: false; components of one process "
            "must agree");
  graph = graph_;
  graph.mutable_component(2)->set_plant(true);
  EXPECT_THAT(Problems(graph), HasSubstr("component plant: has plant: true, but controller"));
  graph = graph_;
  graph.mutable_component(0)->set_owns_clock(true);
  EXPECT_THAT(Problems(graph),
              HasSubstr("component controller: owns the clock and must outlive the others of "
                        "process host; leave it in a process of its own"));
  graph = graph_;
  graph.mutable_component(0)->set_process("Host");
  EXPECT_THAT(Problems(graph), HasSubstr("'Host' is no process name"));
  graph.mutable_component(0)->set_process("recorder");
  EXPECT_THAT(Problems(graph), HasSubstr("the recorder runs in a process of its own"));
  graph = graph_;
  graph.mutable_component(0)->clear_process();
  graph.mutable_component(1)->set_process("controller");
  graph.mutable_component(2)->set_process("plant");
  EXPECT_EQ(Problems(graph), "");  // filter joins controller
  graph.mutable_component(0)->set_process("plant");
  EXPECT_THAT(Problems(graph),
              HasSubstr("component filter: process controller has the name of a component that is "
                        "not in it"));
}

TEST_F(GraphTest, UnknownMessageType) {
  graph_.mutable_channel(0)->set_type("robot_sensor_t");
  EXPECT_THAT(Problems(graph_),
              HasSubstr("channel[0].type: channel SENSORS: 'robot_sensor_t' is no message type"));
  graph_.mutable_channel(0)->set_type("health_t");  // holds strings: no exact size
  EXPECT_THAT(Problems(graph_), HasSubstr("'health_t' is no message type of a channel"));
}

TEST_F(GraphTest, UnknownChannel) {
  graph_.mutable_component(1)->mutable_input(0)->set_channel("SENSOR");
  EXPECT_EQ(Problems(graph_),
            "graph toy_loop: component[1].input[0].channel: component filter: input sensors: "
            "unknown channel 'SENSOR'; "
            "declare it with channel { }");
}

TEST_F(GraphTest, UnknownAndUnconnectedPorts) {
  graph_.mutable_component(1)->mutable_input(0)->set_port("sensor");
  EXPECT_EQ(Problems(graph_),
            "graph toy_loop: component[1]: component filter: input sensors is not connected; add "
            "input { port: \"sensors\" "
            "channel: ... }\n"
            "graph toy_loop: component[1].input[0].port: component filter: input 'sensor' does not "
            "exist; it has: sensors");
  graph_ = ToyLoop();
  graph_.mutable_component(2)->mutable_output()->RemoveLast();
  graph_.mutable_channel()->DeleteSubrange(4, 1);
  EXPECT_THAT(Problems(graph_), HasSubstr("component plant: output push is not connected"));
}

TEST_F(GraphTest, APortConnectedTwice) {
  *graph_.mutable_component(1)->add_input() = graph_.component(1).input(0);
  EXPECT_THAT(
      Problems(graph_),
      HasSubstr("component[1].input[1].port: component filter: input sensors is connected twice"));
}

TEST_F(GraphTest, TypeMismatch) {
  graph_.mutable_component(1)->mutable_input(0)->set_channel("TORQUE");
  EXPECT_EQ(Problems(graph_),
            "graph toy_loop: component[1].input[0]: component filter: input sensors carries "
            "robot_sensors_t, but channel "
            "TORQUE is task_torque_t");
}

TEST_F(GraphTest, CountsMismatch) {
  EXPECT_EQ(Problems(graph_, "", "wrong_counts: true"),
            "graph toy_loop: component[1].input[0]: component filter: input sensors expects "
            "num_joints = 4, num_feet = 2, but "
            "plant has num_joints = 3, num_feet = 2 on channel SENSORS");
}

TEST_F(GraphTest, AnInputNobodyWrites) {
  graph_.mutable_channel(5)->set_external(false);
  EXPECT_THAT(Problems(graph_),
              HasSubstr("channel[5]: channel STOP: controller reads it, but nobody writes it"));
  graph_ = ToyLoop();
  Channel* channel = graph_.add_channel();
  channel->set_name("SPARE");
  channel->set_type("external_push_t");
  EXPECT_EQ(Problems(graph_),
            "graph toy_loop: channel[6]: channel SPARE: nobody writes it; remove it (of a base's: "
            "remove: \"SPARE\") "
            "or mark it external");
}

TEST_F(GraphTest, TwoWriters) {
  *graph_.add_component() = graph_.component(1);
  graph_.mutable_component(3)->set_name("filter_2");
  EXPECT_EQ(Problems(graph_),
            "graph toy_loop: channel[1]: channel STATE has 2 writers (filter, filter_2); one only");
}

TEST_F(GraphTest, AnExternalChannelWithAWriter) {
  graph_.mutable_channel(4)->set_external(true);
  EXPECT_EQ(Problems(graph_),
            "graph toy_loop: channel[4]: channel PUSH is external, but plant writes it");
}

TEST_F(GraphTest, KindsOfInputsMustFitTheirChannels) {
  graph_ = ToyChain();
  graph_.mutable_channel(0)->set_external(true);
  graph_.mutable_component()->DeleteSubrange(0, 1);
  EXPECT_THAT(
      Problems(graph_),
      HasSubstr("component sink: input push waits for its message, but channel PUSH is external"));
}

TEST_F(GraphTest, ALoopInsideATickIsNamed) {
  Graph chain = ToyChain();
  chain.mutable_component(1)->mutable_input(0)->set_channel("SUM");
  EXPECT_EQ(Problems(chain),
            "graph toy_chain: component: loop inside one tick: sink -SUM-> sink; one input of it "
            "must read the message of the tick before");
  // Two filters that feed each other: nobody starts the tick.
  Graph ring;
  ParseTextProto(R"(name: "ring"
                    channel { name: "A" type: "external_push_t" }
                    channel { name: "B" type: "external_push_t" }
                    component { name: "a" type: "toy_sink" input { port: "push" channel: "B" } output { port: "sum" channel: "A" } }
                    component { name: "b" type: "toy_sink" input { port: "push" channel: "A" } output { port: "sum" channel: "B" } })",
                 "ring", &ring);
  EXPECT_EQ(Problems(ring),
            "graph ring: component: no component starts the tick: the first stage of one must read "
            "only messages of the tick "
            "before (or none)\n"
            "graph ring: component: loop inside one tick: a -A-> b -B-> a; one input of it must "
            "read the message of the tick "
            "before");
}

TEST_F(GraphTest, ADelayedLoopThatLeavesTheRobotOutIsNamed) {
  const std::string text = R"(name: "two"
      channel { name: "PUSH" type: "external_push_t" }
      channel { name: "A" type: "external_push_t" }
      channel { name: "B" type: "external_push_t" }
      component { name: "clock" type: "toy_clock" output { port: "push" channel: "PUSH" } }
      component { name: "a" type: "toy_echo" input { port: "push" channel: "PUSH" }
                  input { port: "before" channel: "B" } output { port: "sum" channel: "A" } }
      component { name: "b" type: "toy_sink" input { port: "push" channel: "A" }
                  output { port: "sum" channel: "B" } })";
  Graph two;
  ParseTextProto(text, "two", &two);
  EXPECT_EQ(Problems(two),
            "graph two: component: loop that does not pass through the robot (a component that "
            "starts the tick): a -A-> b -B-> a; remove one input of it");
  two.mutable_component(1)->mutable_input(1)->set_channel("A");
  EXPECT_THAT(Problems(two), HasSubstr("(a component that starts the tick): a -A-> a; "));
  two.mutable_component(1)->mutable_input(1)->set_channel("PUSH");  // delayed, but no loop
  EXPECT_EQ(Problems(two), "");
}

TEST_F(GraphTest, SeveralProblemsAtOnce) {
  graph_.mutable_component(1)->set_type("none");
  graph_.mutable_component(2)->mutable_output(0)->set_channel("NOWHERE");
  const std::string problems = Problems(graph_);
  EXPECT_THAT(problems, HasSubstr("unknown component type 'none'"));
  EXPECT_THAT(problems, HasSubstr("unknown channel 'NOWHERE'"));
  EXPECT_THAT(problems, HasSubstr("controller, filter reads it, but nobody writes it"));
}

TEST_F(GraphTest, ConfigurationErrorsNameComponentAndLine) {
  EXPECT_THAT(Problems(graph_, "gains {\n kq: 3 }"), HasSubstr("controller:2:"));
  EXPECT_EQ(Problems(graph_, "joints: -3"),
            "controller: input sensors: num_joints = -3 is outside 0 to 4096");
}

TEST_F(GraphTest, EmptyGraph) {
  EXPECT_EQ(Problems(Graph()), "graph : component: the graph has no component");
}

TEST(Progress, OnlyWhoDoesNotLeadBackReports) {
  EXPECT_TRUE(ProgressReporters(ToyLoop(), 2).empty());
  EXPECT_FALSE(MustReportProgress(ToyLoop(), 0));
  EXPECT_THAT(ProgressReporters(ToyChain(), 0), ElementsAre(1));
  EXPECT_FALSE(MustReportProgress(ToyChain(), 0));
  EXPECT_TRUE(MustReportProgress(ToyChain(), 1));
}

TEST(WiringTest, RefusesWhatCannotWork) {
  Input<robot_sensors_t> input;
  Output<robot_state_t> output;
  Wiring wiring;
  const auto error_of = [](auto&& f) -> std::string {
    try {
      f();
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(error_of([&] { wiring.AddInput(&input, "in", {12}); }),
            "input in: its type has 2 counts, 1 given");
  EXPECT_EQ(error_of([&] { wiring.AddStage("s", {&input}, {}, {}); }),
            "stage s: an input of it was not added before");
  wiring.AddInput(&input, "in", {12, 2});
  EXPECT_EQ(error_of([&] {
              wiring.AddInput(&input, "in", {12, 2});
            }),
            "input in is declared twice");
  wiring.AddOutput(&output, "out", {12, 2});
  wiring.AddStage("s", {&input}, {&output}, [](const Tick&) {});
  EXPECT_EQ(error_of([&] { wiring.AddStage("t", {}, {&output}, {}); }),
            "output out belongs to the stages s and t; one only");
}

// What a type declares is checked without configuring anything, and is what it is.
class DeclaredPortsTest : public GraphTest {
 protected:
  /// The toy filter, declared with these ports.
  std::string ProblemsWith(std::vector<PortType> ports, bool bind) {
    ComponentRegistry registry;
    for (const auto& [name, type] : registry_.entries()) {
      ComponentType copy = type;
      if (name == "toy_filter") copy.ports = ports;
      registry.Add(copy);
    }
    try {
      if (bind) {
        BoundGraph(ToyRun(graph_, 10), registry);
      } else {
        CheckGraph(graph_, registry);
      }
    } catch (const GraphError& error) {
      return error.what();
    }
    return "";
  }

  /// As the filter has them.
  std::vector<PortType> Right() {
    std::vector<PortType> ports;
    const BoundGraph bound(ToyRun(graph_, 10), registry_);
    const Wiring& wiring = bound.component(1).wiring;
    for (const InputPort* input : wiring.inputs()) {
      ports.push_back({input->name(), input->type_name(), true, input->kind()});
    }
    for (const OutputPort* output : wiring.outputs()) {
      ports.push_back({output->name(), output->type_name(), false});
    }
    return ports;
  }
};

TEST_F(DeclaredPortsTest, AreCheckedAgainstTheGraphAlone) {
  EXPECT_EQ(ProblemsWith(Right(), false), "");
  std::vector<PortType> ports = Right();
  ports[0].type = "health_t";
  EXPECT_THAT(ProblemsWith(ports, false), HasSubstr("carries health_t, but channel"));
  ports = Right();
  ports.push_back({"more", "robot_state_t", true});
  EXPECT_THAT(ProblemsWith(ports, false), HasSubstr("input more is not connected"));
  ports = Right();
  ports.erase(ports.begin());
  EXPECT_THAT(ProblemsWith(ports, false), HasSubstr("does not exist; it has"));
  ports = Right();
  ports[0].kind = InputKind::kLatest;
  EXPECT_THAT(ProblemsWith(ports, false), HasSubstr("the result would depend on timing"));
}

TEST_F(DeclaredPortsTest, AreWhatTheComponentIs) {
  EXPECT_EQ(ProblemsWith(Right(), true), "");
  std::vector<PortType> ports = Right();
  ports[0].kind = InputKind::kPreviousTick;
  EXPECT_THAT(ProblemsWith(ports, true), HasSubstr("make them equal"));
}

// Another type's: a graph may have it or not, but the component must be as the graph says.
TEST_F(DeclaredPortsTest, APortThatNotEveryRunHasMayBeThere) {
  std::vector<PortType> ports = Right();
  const PortType output = ports.back();
  ASSERT_FALSE(output.input);
  ports.pop_back();
  EXPECT_THAT(ProblemsWith(ports, false), HasSubstr("does not exist; it has"));
  AddOptionalPort({"toy_filter", output.name, output.type, {"toy.enabled"}});
  EXPECT_EQ(ProblemsWith(ports, false), "");
  EXPECT_EQ(ProblemsWith(ports, true), "");
  AddOptionalPort({"toy_filter", "more", output.type, {"toy.enabled"}});
  EXPECT_EQ(ProblemsWith(ports, true), "");
  ports = Right();
  const PortType input = ports.front();
  ASSERT_TRUE(input.input);
  ports.erase(ports.begin());
  EXPECT_THAT(ProblemsWith(ports, false), HasSubstr("does not exist; it has"));
  AddOptionalPort({"toy_filter", input.name, "health_t", {}, {"toy.follows"}, true, input.kind});
  EXPECT_THAT(ProblemsWith(ports, false), HasSubstr("carries health_t, but channel"));
  EXPECT_THAT(ProblemsWith(ports, true), HasSubstr("carries health_t, but channel"));
  // Whoever mistypes the name is told of it, though this graph does not connect it.
  graph_.mutable_component(1)->mutable_output(0)->set_port("mroe");
  EXPECT_THAT(ProblemsWith(ports, false), HasSubstr("'mroe' does not exist; it has: "));
  EXPECT_THAT(ProblemsWith(ports, false), HasSubstr("more"));
}

}  // namespace
}  // namespace poise
