#include "components/framework/graph_order.h"

#include <algorithm>

#include "fmt/format.h"

namespace poise {
namespace {

struct Edge {
  size_t from;
  int channel;  ///< -1: the component's own order of stages
};

struct Node {
  GraphPlan::StageRef ref;
  std::vector<Edge> before;  ///< must run before this one
};

size_t IndexOf(const std::vector<InputPort*>& ports, const InputPort* port) {
  return static_cast<size_t>(std::find(ports.begin(), ports.end(), port) - ports.begin());
}

bool HasSameTickInput(const Stage& stage) {
  return std::any_of(stage.inputs.begin(), stage.inputs.end(),
                     [](const InputPort* input) { return input->kind() == InputKind::kSameTick; });
}

/// What each stage reads, in this tick or, with `delayed`, in the next one too.
std::vector<Node> MakeNodes(const std::vector<const Wiring*>& wirings, const GraphPlan& plan,
                            bool delayed) {
  std::vector<Node> nodes;
  std::vector<size_t> writer(plan.channels.size(), 0);  // node that writes the channel
  for (size_t c = 0; c < wirings.size(); ++c) {
    const std::vector<Stage>& stages = wirings[c]->stages();
    for (size_t s = 0; s < stages.size(); ++s) {
      for (size_t o = 0; o < wirings[c]->outputs().size(); ++o) {
        const auto& outputs = stages[s].outputs;
        if (std::find(outputs.begin(), outputs.end(), wirings[c]->outputs()[o]) != outputs.end()) {
          writer[static_cast<size_t>(plan.output_channel[c][o])] = nodes.size();
        }
      }
      nodes.push_back({{static_cast<int>(c), static_cast<int>(s)}, {}});
    }
  }
  for (size_t n = 0; n < nodes.size(); ++n) {
    const auto c = static_cast<size_t>(nodes[n].ref.component);
    if (nodes[n].ref.stage > 0) nodes[n].before.push_back({n - 1, -1});
    for (const InputPort* input :
         wirings[c]->stages()[static_cast<size_t>(nodes[n].ref.stage)].inputs) {
      if (input->kind() == InputKind::kLatest) continue;
      if (input->kind() == InputKind::kPreviousTick && !delayed) continue;
      const int channel = plan.input_channel[c][IndexOf(wirings[c]->inputs(), input)];
      nodes[n].before.push_back({writer[static_cast<size_t>(channel)], channel});
    }
  }
  return nodes;
}

/// Every node in `done == false` waits for another such node: follow them until one comes twice.
std::string DescribeLoop(const Graph& graph, const GraphPlan& plan, const std::vector<Node>& nodes,
                         const std::vector<bool>& done) {
  std::vector<size_t> path;
  std::vector<int> channels;
  size_t at = static_cast<size_t>(std::find(done.begin(), done.end(), false) - done.begin());
  while (std::find(path.begin(), path.end(), at) == path.end()) {
    path.push_back(at);
    const auto& before = nodes[at].before;
    const auto edge =
        std::find_if(before.begin(), before.end(), [&](const Edge& e) { return !done[e.from]; });
    channels.push_back(edge->channel);
    at = edge->from;
  }
  const auto start = static_cast<size_t>(std::find(path.begin(), path.end(), at) - path.begin());
  const auto name = [&](size_t n) { return graph.component(nodes[n].ref.component).name(); };
  std::string text = name(at);  // against the arrows, so print backwards
  for (size_t i = path.size(); i-- > start;) {
    const size_t to = path[i];
    if (channels[i] >= 0) {
      text +=
          fmt::format(" -{}-> {}", plan.channels[static_cast<size_t>(channels[i])].name, name(to));
    }
  }
  return text;
}

/// Takes away the tick sources, then all that waits for nothing: what is left holds a loop.
void CheckDelayedLoops(const Graph& graph, const std::vector<const Wiring*>& wirings,
                       const GraphPlan& plan, std::vector<GraphError::Problem>* problems) {
  const std::vector<Node> nodes = MakeNodes(wirings, plan, true);
  std::vector<bool> done;
  for (const Node& node : nodes) {
    done.push_back(std::find(plan.tick_sources.begin(), plan.tick_sources.end(),
                             node.ref.component) != plan.tick_sources.end());
  }
  for (bool changed = true; changed;) {
    changed = false;
    for (size_t n = 0; n < nodes.size(); ++n) {
      const auto& before = nodes[n].before;
      if (done[n] ||
          !std::all_of(before.begin(), before.end(), [&](const Edge& e) { return done[e.from]; }))
        continue;
      done[n] = changed = true;
    }
  }
  if (std::find(done.begin(), done.end(), false) == done.end()) return;
  problems->push_back(
      {"component", fmt::format("loop that does not pass through the robot (a component that "
                                "starts the tick): {}; remove one input of it",
                                DescribeLoop(graph, plan, nodes, done))});
}

}  // namespace

void OrderStages(const Graph& graph, const std::vector<const Wiring*>& wirings, GraphPlan* plan,
                 std::vector<GraphError::Problem>* problems) {
  for (size_t c = 0; c < wirings.size(); ++c) {
    if (!HasSameTickInput(wirings[c]->stages()[0]))
      plan->tick_sources.push_back(static_cast<int>(c));
  }
  if (plan->tick_sources.empty()) {
    problems->push_back(
        {"component",
         "no component starts the tick: the first stage of one must read only messages of "
         "the tick before (or none)"});
  }
  const std::vector<Node> nodes = MakeNodes(wirings, *plan, false);
  std::vector<bool> done(nodes.size(), false);
  for (size_t count = 0; count < nodes.size(); ++count) {
    size_t next = nodes.size();
    for (size_t n = 0; n < nodes.size() && next == nodes.size(); ++n) {
      const auto& before = nodes[n].before;
      if (!done[n] &&
          std::all_of(before.begin(), before.end(), [&](const Edge& e) { return done[e.from]; }))
        next = n;
    }
    if (next == nodes.size()) {
      problems->push_back(
          {"component",
           fmt::format("loop inside one tick: {}; one input of it must read the message of "
                       "the tick before",
                       DescribeLoop(graph, *plan, nodes, done))});
      return;
    }
    done[next] = true;
    plan->order.push_back(nodes[next].ref);
  }
  CheckDelayedLoops(graph, wirings, *plan, problems);
}

}  // namespace poise
