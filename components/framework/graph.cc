// Checks of a graph and its components. The order of a tick is in
// graph_order.cc.
#include "components/framework/graph.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <set>

#include "components/framework/configuration/field_rules.h"
#include "components/framework/graph_order.h"
#include "components/framework/modules.h"
#include "components/framework/operator_acts.h"
#include "components/framework/optional_ports.h"
#include "components/framework/run.h"
#include "fmt/format.h"

namespace poise {
namespace {

using Problems = std::vector<GraphError::Problem>;

void Throw(const Graph& graph, Problems problems) {
  if (!problems.empty()) throw GraphError(graph.name(), std::move(problems));
}

bool IsName(const std::string& name, char first, char last) {
  return !name.empty() && name.size() <= 48 && name[0] >= first && name[0] <= last &&
         std::all_of(name.begin(), name.end(), [&](char c) {
           return (c >= first && c <= last) || (c >= '0' && c <= '9') || c == '_';
         });
}

std::string TypeNames() {
  std::vector<std::string> names;
  for (const MessageType& type : MessageTypes()) {
    if (!type.has_strings) names.push_back(type.name);
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

void CheckChannels(const Graph& graph, Problems* problems) {
  std::set<std::string> seen;
  for (int i = 0; i < graph.channel_size(); ++i) {
    const Channel& channel = graph.channel(i);
    const std::string field = fmt::format("channel[{}]", i);
    const auto fail = [&](const char* part, const std::string& text) {
      problems->push_back({field + part, fmt::format("channel {}: {}", channel.name(), text)});
    };
    if (!IsName(channel.name(), 'A', 'Z')) {
      fail(".name", fmt::format("'{}' is no channel name; use capitals, digits and _, at most 48",
                                channel.name()));
      continue;
    }
    if (channel.name() == kControlChannel || channel.name().starts_with("HEALTH_") ||
        channel.name() == "LCM_SELF_TEST") {
      fail(".name", "the name is taken by the framework; choose another");
    }
    if (!seen.insert(channel.name()).second) fail(".name", "named twice; names must be unique");
    const MessageType* type = FindMessageType(channel.type());
    if (type == nullptr || type->has_strings) {
      fail(".type", fmt::format("'{}' is no message type of a channel; types: {}; {}",
                                channel.type(), TypeNames(), ModulesSearched()));
    }
  }
}

void CheckComponents(const Graph& graph, const ComponentRegistry& registry, Problems* problems) {
  if (graph.component_size() == 0) problems->push_back({"component", "the graph has no component"});
  std::set<std::string> seen;
  for (int i = 0; i < graph.component_size(); ++i) {
    const ComponentInstance& instance = graph.component(i);
    const std::string field = fmt::format("component[{}]", i);
    const auto fail = [&](const std::string& part, const std::string& text) {
      problems->push_back({field + part, fmt::format("component {}: {}", instance.name(), text)});
    };
    if (!IsName(instance.name(), 'a', 'z')) {
      fail(".name", fmt::format("'{}' is no component name; use small letters, "
                                "digits and _, at most 48",
                                instance.name()));
    }
    if (instance.name() == kRecorderName)
      fail(".name", "the name is taken by the recorder; choose another");
    if (!seen.insert(instance.name()).second) fail(".name", "named twice; names must be unique");
    if (registry.Find(TypeOf(instance)) == nullptr) {
      std::vector<std::string> types;
      for (const auto& [type, entry] : registry.entries()) types.push_back(type);
      fail(instance.has_type() ? ".type" : ".name",
           fmt::format("unknown component type '{}'; types: {}; {}", TypeOf(instance),
                       fmt::join(types, ", "), ModulesSearched()));
    }
  }
}

struct Uses {
  std::vector<std::string> writers;
  std::vector<std::string> readers;
};

void CheckConnections(const Graph& graph, Problems* problems) {
  std::map<std::string, Uses> uses;
  for (const Channel& channel : graph.channel()) uses[channel.name()];
  for (int i = 0; i < graph.component_size(); ++i) {
    const ComponentInstance& instance = graph.component(i);
    for (const bool is_input : {true, false}) {
      std::set<std::string> ports;
      const auto& connections = is_input ? instance.input() : instance.output();
      for (int k = 0; k < connections.size(); ++k) {
        const Connection& connection = connections[k];
        const std::string field =
            fmt::format("component[{}].{}[{}]", i, is_input ? "input" : "output", k);
        const std::string where = fmt::format("component {}: {} {}", instance.name(),
                                              is_input ? "input" : "output", connection.port());
        if (!ports.insert(connection.port()).second) {
          problems->push_back({field + ".port", where + " is connected twice"});
        }
        const auto use = uses.find(connection.channel());
        if (use == uses.end()) {
          problems->push_back(
              {field + ".channel",
               fmt::format("{}: unknown channel '{}'; declare it with channel {{ }}", where,
                           connection.channel())});
          continue;
        }
        (is_input ? use->second.readers : use->second.writers).push_back(instance.name());
      }
    }
  }
  for (int i = 0; i < graph.channel_size(); ++i) {
    const Channel& channel = graph.channel(i);
    const Uses& use = uses[channel.name()];
    const std::string field = fmt::format("channel[{}]", i);
    if (channel.external() && !use.writers.empty()) {
      problems->push_back({field, fmt::format("channel {} is external, but {} writes it",
                                              channel.name(), fmt::join(use.writers, ", "))});
    } else if (use.writers.size() > 1) {
      problems->push_back(
          {field, fmt::format("channel {} has {} writers ({}); one only", channel.name(),
                              use.writers.size(), fmt::join(use.writers, ", "))});
    } else if (!channel.external() && use.writers.empty()) {
      problems->push_back(
          {field, use.readers.empty()
                      ? fmt::format("channel {0}: nobody writes it; remove it (of a base's: "
                                    "remove: \"{0}\") or mark it external",
                                    channel.name())
                      : fmt::format("channel {}: {} reads it, but nobody writes it", channel.name(),
                                    fmt::join(use.readers, ", "))});
    }
  }
}

int ChannelIndex(const Graph& graph, const std::string& name) {
  for (int i = 0; i < graph.channel_size(); ++i) {
    if (graph.channel(i).name() == name) return i;
  }
  return -1;
}

/// Index of the connection of `port`, or -1.
int FindConnection(const google::protobuf::RepeatedPtrField<Connection>& connections,
                   const std::string& port) {
  for (int k = 0; k < connections.size(); ++k) {
    if (connections[k].port() == port) return k;
  }
  return -1;
}

std::vector<PortType> PortsOf(const Wiring& wiring) {
  std::vector<PortType> ports;
  for (const InputPort* input : wiring.inputs()) {
    ports.push_back({input->name(), input->type_name(), true, input->kind()});
  }
  for (const OutputPort* output : wiring.outputs()) {
    ports.push_back({output->name(), output->type_name(), false});
  }
  return ports;
}

/// Every declared port connected, every connection declared, types equal; only an input that takes
/// the latest message reads what comes from outside the graph.
void CheckPorts(const Graph& graph, int component, const std::vector<PortType>& ports,
                Problems* problems) {
  const ComponentInstance& instance = graph.component(component);
  const std::string field = fmt::format("component[{}]", component);
  for (const bool is_input : {true, false}) {
    const char* const direction = is_input ? "input" : "output";
    const auto& connections = is_input ? instance.input() : instance.output();
    const std::string prefix = fmt::format("component {}: {} ", instance.name(), direction);
    std::vector<std::string> names;
    for (const PortType& port : ports) {
      if (port.input != is_input) continue;
      names.push_back(port.name);
      const int k = FindConnection(connections, port.name);
      if (k < 0 && port.type == kActType) continue;
      if (k < 0) {
        problems->push_back({field, fmt::format("{0}{1} is not connected; add {2} {{ port: "
                                                "\"{1}\" channel: ... }}",
                                                prefix, port.name, direction)});
        continue;
      }
      const int at = ChannelIndex(graph, connections[k].channel());
      if (at < 0) continue;
      const Channel& channel = graph.channel(at);
      const std::string place = fmt::format("{}.{}[{}]", field, direction, k);
      if (channel.type() != port.type) {
        problems->push_back(
            {place, fmt::format("{}{} carries {}, but channel {} is {}", prefix, port.name,
                                port.type, channel.name(), channel.type())});
      }
      if (!is_input || channel.external() == (port.kind == InputKind::kLatest)) continue;
      problems->push_back(
          {place, fmt::format("{}{} {}", prefix, port.name,
                              channel.external()
                                  ? fmt::format("waits for its message, but channel {} is external "
                                                "and does not keep step with the ticks",
                                                channel.name())
                                  : fmt::format("takes the latest message, but channel {} is "
                                                "written inside the graph: the result would depend "
                                                "on timing",
                                                channel.name()))});
    }
    for (const OptionalPort& port : OptionalPortsOf(TypeOf(instance))) {
      const bool named = std::find(names.begin(), names.end(), port.port) != names.end();
      if (port.input == is_input && !named) names.push_back(port.port);
    }
    for (int k = 0; k < connections.size(); ++k) {
      if (std::find(names.begin(), names.end(), connections[k].port()) != names.end()) continue;
      // An operator's acts reach who takes them: in such a place another type may stand.
      const int at = ChannelIndex(graph, connections[k].channel());
      if (is_input && at >= 0 && graph.channel(at).type() == kActType) continue;
      problems->push_back(
          {fmt::format("{}.{}[{}].port", field, direction, k),
           fmt::format("{}'{}' does not exist; it has: {}", prefix, connections[k].port(),
                       names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", ")))});
    }
  }
}

/// The declared ports, with those that not every run has where `has` says so.
template <class Has>
std::vector<PortType> WithOptional(const std::string& component, std::vector<PortType> declared,
                                   const Has& has) {
  for (const OptionalPort& optional : OptionalPortsOf(component)) {
    const bool declares = std::ranges::any_of(declared, [&](const PortType& port) {
      return port.input == optional.input && port.name == optional.port;
    });
    if (declares || !has(optional)) continue;
    declared.push_back({optional.port, optional.type, optional.input, optional.kind});
  }
  return declared;
}

/// What a component declares of itself is what it is.
void CheckDeclared(const Graph& graph, int component, const std::vector<PortType>& declared,
                   const Wiring& wiring, Problems* problems) {
  if (declared.empty()) return;
  const auto describe = [](std::vector<PortType> ports) {
    std::vector<std::string> lines;
    for (const PortType& port : ports) {
      lines.push_back(fmt::format("{} {} of {}{}", port.input ? "input" : "output", port.name,
                                  port.type,
                                  port.kind == InputKind::kPreviousTick ? " (tick before)"
                                  : port.kind == InputKind::kLatest     ? " (latest)"
                                                                        : ""));
    }
    std::sort(lines.begin(), lines.end());
    return fmt::format("{}", fmt::join(lines, ", "));
  };
  const std::vector<PortType> ports = PortsOf(wiring);
  const auto has = [&](const OptionalPort& optional) {
    return std::ranges::any_of(ports, [&](const PortType& port) {
      return port.input == optional.input && port.name == optional.port;
    });
  };
  const std::string says =
      describe(WithOptional(TypeOf(graph.component(component)), declared, has));
  const std::string is = describe(ports);
  if (says == is) return;
  problems->push_back(
      {fmt::format("component[{}]", component),
       fmt::format("component {}: its type declares {}; its Configure {}; make them equal",
                   graph.component(component).name(), says, is)});
}

template <class Port>
bool InSomeStage(const std::vector<Stage>& stages, const Port* port,
                 std::vector<Port*> Stage::*ports) {
  return std::any_of(stages.begin(), stages.end(), [&](const Stage& stage) {
    return std::find((stage.*ports).begin(), (stage.*ports).end(), port) != (stage.*ports).end();
  });
}

void CheckComponent(const Graph& graph, int i, const Wiring& wiring, Problems* problems) {
  const ComponentInstance& instance = graph.component(i);
  const std::string field = fmt::format("component[{}]", i);
  CheckPorts(graph, i, PortsOf(wiring), problems);
  if (wiring.stages().empty()) {
    problems->push_back({field, fmt::format("component {}: has no stage", instance.name())});
  }
  for (const InputPort* input : wiring.inputs()) {
    if (!InSomeStage(wiring.stages(), input, &Stage::inputs)) {
      problems->push_back({field, fmt::format("component {}: no stage reads input {}",
                                              instance.name(), input->name())});
    }
  }
  for (const OutputPort* output : wiring.outputs()) {
    if (!InSomeStage(wiring.stages(), output, &Stage::outputs)) {
      problems->push_back({field, fmt::format("component {}: no stage writes output {}",
                                              instance.name(), output->name())});
    }
  }
}

std::string Describe(std::span<const char* const> names, const MessageCounts& counts) {
  std::vector<std::string> parts;
  for (size_t i = 0; i < counts.size(); ++i)
    parts.push_back(fmt::format("{} = {}", names[i], counts[i]));
  return fmt::format("{}", fmt::join(parts, ", "));
}

GraphPlan ConnectPorts(const Graph& graph, const std::vector<const Wiring*>& wirings,
                       Problems* problems) {
  GraphPlan plan;
  for (const Channel& channel : graph.channel()) {
    plan.channels.push_back({channel.name(), channel.type(), channel.external(), {}, {}, {}, 0});
  }
  for (int i = 0; i < graph.component_size(); ++i) {
    const ComponentInstance& instance = graph.component(i);
    const Wiring& wiring = *wirings[static_cast<size_t>(i)];
    auto& outputs = plan.output_channel.emplace_back();
    for (const OutputPort* output : wiring.outputs()) {
      const int c = ChannelIndex(
          graph, instance.output(FindConnection(instance.output(), output->name())).channel());
      GraphPlan::ChannelPlan& channel = plan.channels[static_cast<size_t>(c)];
      channel.writer = {i, static_cast<int>(outputs.size())};
      channel.counts = output->counts();
      channel.encoded_size = output->encoded_size();
      outputs.push_back(c);
    }
  }
  for (int i = 0; i < graph.component_size(); ++i) {
    const ComponentInstance& instance = graph.component(i);
    const Wiring& wiring = *wirings[static_cast<size_t>(i)];
    auto& inputs = plan.input_channel.emplace_back();
    for (const InputPort* input : wiring.inputs()) {
      const int k = FindConnection(instance.input(), input->name());
      if (k < 0) {  // an operator's acts, which this graph has not
        inputs.push_back(-1);
        continue;
      }
      const int c = ChannelIndex(graph, instance.input(k).channel());
      GraphPlan::ChannelPlan& channel = plan.channels[static_cast<size_t>(c)];
      if (channel.external && channel.readers.empty()) {
        channel.counts = input->counts();
        channel.encoded_size = input->encoded_size();
      }
      if (input->counts() != channel.counts) {
        const std::string other =
            channel.external ? "another reader" : graph.component(channel.writer.component).name();
        problems->push_back(
            {fmt::format("component[{}].input[{}]", i, k),
             fmt::format("component {}: input {} expects {}, but {} has {} on "
                         "channel {}",
                         instance.name(), input->name(),
                         Describe(input->count_names(), input->counts()), other,
                         Describe(input->count_names(), channel.counts), channel.name)});
      }
      channel.readers.push_back({i, static_cast<int>(inputs.size())});
      inputs.push_back(c);
    }
  }
  return plan;
}

}  // namespace

GraphError::GraphError(const std::string& graph_name, std::vector<Problem> problems)
    : ConfigError([&] {
        std::vector<std::string> lines;
        for (const Problem& problem : problems) {
          lines.push_back(fmt::format("graph {}: {}: {}", graph_name, problem.field, problem.text));
        }
        return fmt::format("{}", fmt::join(lines, "\n"));
      }()),
      problems_(std::move(problems)) {}

std::vector<GraphError::Problem> ProcessProblems(const Graph& graph) {
  Problems problems;
  for (int i = 0; i < graph.component_size(); ++i) {
    const ComponentInstance& instance = graph.component(i);
    if (!instance.has_process()) continue;
    const std::string& process = instance.process();
    const auto fail = [&](const std::string& text) {
      problems.push_back({fmt::format("component[{}].process", i),
                          fmt::format("component {}: {}", instance.name(), text)});
    };
    if (!IsName(process, 'a', 'z')) {
      fail(fmt::format("'{}' is no process name; use small letters, digits and _, at most 48",
                       process));
      continue;
    }
    if (process == kRecorderName) fail("the recorder runs in a process of its own; choose another");
    const std::vector<int> members = ComponentsOf(graph, process);
    if (members.size() < 2) continue;
    if (instance.owns_clock()) {
      fail(
          fmt::format("owns the clock and must outlive the others of process {}; leave it in a "
                      "process of its own",
                      process));
    }
    // One that disagrees with the first is named once.
    const ComponentInstance& first = graph.component(members.front());
    const auto agree = [&](const char* what, bool own, bool others) {
      if (own == others) return;
      fail(
          fmt::format("has {0}: {1}, but {2}, in the same process {3}, has {0}: {4}; components "
                      "of one process must agree",
                      what, own, first.name(), process, others));
    };
    agree("restart", instance.restart(), first.restart());
    agree("plant", instance.plant(), first.plant());
  }
  for (int i = 0; i < graph.component_size(); ++i) {
    const ComponentInstance& instance = graph.component(i);
    if (!instance.has_process() || instance.process() == instance.name()) continue;
    for (int k = 0; k < graph.component_size(); ++k) {
      const ComponentInstance& other = graph.component(k);
      if (other.name() != instance.process() || ProcessOf(other) == instance.process()) continue;
      problems.push_back(
          {fmt::format("component[{}].process", i),
           fmt::format("component {}: process {} has the name of a component that is not in it; "
                       "choose another",
                       instance.name(), instance.process())});
    }
  }
  return problems;
}

void CheckGraph(const Graph& graph, const ComponentRegistry& registry) {
  Problems problems;
  CheckChannels(graph, &problems);
  CheckComponents(graph, registry, &problems);
  std::ranges::move(ProcessProblems(graph), std::back_inserter(problems));
  CheckConnections(graph, &problems);
  for (int i = 0; i < graph.component_size(); ++i) {
    const ComponentType* const type = registry.TypeNamed(TypeOf(graph.component(i)));
    if (type == nullptr || type->ports.empty()) continue;
    const auto connected = [&](const OptionalPort& port) {
      const ComponentInstance& instance = graph.component(i);
      return FindConnection(port.input ? instance.input() : instance.output(), port.port) >= 0;
    };
    CheckPorts(graph, i, WithOptional(type->name, type->ports, connected), &problems);
  }
  Throw(graph, std::move(problems));
}

void CheckWiring(const Graph& graph, int component, const Wiring& wiring) {
  Problems problems;
  CheckComponent(graph, component, wiring, &problems);
  Throw(graph, std::move(problems));
}

GraphPlan PlanGraph(const Graph& graph, const std::vector<const Wiring*>& wirings) {
  Problems problems;
  CheckChannels(graph, &problems);
  CheckConnections(graph, &problems);
  for (int i = 0; i < graph.component_size(); ++i) {
    CheckComponent(graph, i, *wirings[static_cast<size_t>(i)], &problems);
  }
  Throw(graph, std::move(problems));

  problems.clear();
  GraphPlan plan = ConnectPorts(graph, wirings, &problems);
  OrderStages(graph, wirings, &plan, &problems);
  Throw(graph, std::move(problems));
  return plan;
}

void FillPlan(const GraphPlan& plan, Graph* graph) {
  for (int i = 0; i < graph->channel_size(); ++i) {
    const MessageCounts& counts = plan.channels[static_cast<size_t>(i)].counts;
    graph->mutable_channel(i)->mutable_count()->Assign(counts.begin(), counts.end());
  }
  for (int i = 0; i < graph->component_size(); ++i) {
    ComponentInstance* instance = graph->mutable_component(i);
    instance->clear_stage_place();
    if (ComponentsOf(*graph, ProcessOf(*instance)).size() < 2) continue;
    for (size_t place = 0; place < plan.order.size(); ++place) {
      // Its own stages stand in their order.
      if (plan.order[place].component == i) instance->add_stage_place(static_cast<int>(place));
    }
  }
}

void CheckRun(const RunSpec& spec, const std::string& prefix) {
  RequireFields(spec, {"tick_period"}, prefix);
  CheckFields(spec, prefix);
}

ConfiguredComponent ConfigureComponent(const RunSpec& spec, int index,
                                       const ComponentFactory& factory, SharedObjects* shared) {
  ConfiguredComponent result;
  const ComponentInstance& instance = spec.graph().component(index);
  result.index = index;
  result.name = instance.name();
  result.component = factory();
  ComponentContext context;
  context.name = result.name;
  for (const ComponentConfig& config : spec.config()) {
    if (config.component() == result.name) context.config_text = config.text();
  }
  context.tick_period = spec.tick_period();
  context.lead_ticks = spec.lead_ticks();
  context.num_ticks = spec.num_ticks();
  context.seed =
      InstanceSeed(spec.seed(), instance.has_seed_name() ? instance.seed_name() : result.name);
  std::map<std::string, std::string> resources;
  for (const Resource& resource : spec.resource()) resources[resource.name()] = resource.text();
  context.resources = &resources;
  context.shared = shared;
  try {
    result.component->Configure(context, &result.wiring);
  } catch (const ConfigError& error) {
    if (!error.field().empty())
      throw ConfigError(result.name + "." + error.field(), error.problem());
    const std::string what = error.what();
    if (what.find(result.name) != std::string::npos) throw;
    throw ConfigError(fmt::format("{}: {}", result.name, what));
  }
  return result;
}

BoundGraph::BoundGraph(const RunSpec& spec, const ComponentRegistry& registry,
                       std::atomic<int>* configuring) {
  CheckRun(spec);
  CheckGraph(spec.graph(), registry);
  std::vector<const Wiring*> wirings;
  for (int i = 0; i < spec.graph().component_size(); ++i) {
    const ComponentFactory* factory = registry.Find(TypeOf(spec.graph().component(i)));
    if (configuring != nullptr) configuring->store(i);
    components_.push_back(ConfigureComponent(spec, i, *factory, &shared_));
    if (configuring != nullptr) configuring->store(-1);
  }
  Problems problems;
  for (int i = 0; i < num_components(); ++i) {
    wirings.push_back(&component(i).wiring);
    CheckDeclared(spec.graph(), i, registry.TypeNamed(TypeOf(spec.graph().component(i)))->ports,
                  *wirings.back(), &problems);
  }
  Throw(spec.graph(), std::move(problems));
  plan_ = PlanGraph(spec.graph(), wirings);
}

}  // namespace poise
