// The process graph, checked before anything starts.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "components/framework/component_registry.h"
#include "components/framework/graph.pb.h"

namespace poise {

/// All that is wrong with a graph. what() holds one line a problem.
class GraphError : public ConfigError {
 public:
  struct Problem {
    std::string field;  ///< dotted path in the Graph message, "component[2].input[0].channel" (see
                        ///< LocateField)
    std::string text;
  };
  GraphError(const std::string& graph_name, std::vector<Problem> problems);
  const std::vector<Problem>& problems() const { return problems_; }

 private:
  std::vector<Problem> problems_;
};

/// How a checked graph runs.
struct GraphPlan {
  struct Endpoint {
    int component = -1;  ///< index in the graph
    int port = -1;       ///< index in the wiring's inputs() or outputs()
  };
  struct ChannelPlan {
    std::string name;
    std::string type;
    bool external = false;
    Endpoint writer;  ///< component -1: external
    std::vector<Endpoint> readers;
    MessageCounts counts;
    int encoded_size = 0;
  };
  struct StageRef {
    int component = -1;
    int stage = -1;
  };
  std::vector<ChannelPlan> channels;  ///< in the order of the graph
  std::vector<StageRef> order;        ///< of one tick; the same for the same graph
  std::vector<int> tick_sources;  ///< components whose first stage waits for no message of its tick

  /// Index of the channel that a component's input or output is connected to.
  std::vector<std::vector<int>> input_channel;   ///< [component][input]
  std::vector<std::vector<int>> output_channel;  ///< [component][output]
};

/// What is wrong with the graph's processes: components of one must be able to live and die
/// together.
std::vector<GraphError::Problem> ProcessProblems(const Graph& graph);

/// Checks names, types and connections as far as the graph and the components' declared ports tell.
/// Throws GraphError.
void CheckGraph(const Graph& graph, const ComponentRegistry& registry);

/// Checks one configured component against its place in the graph: ports, types. Throws GraphError.
void CheckWiring(const Graph& graph, int component, const Wiring& wiring);

/// Checks everything; wirings[i] belongs to graph.component(i). Throws GraphError.
GraphPlan PlanGraph(const Graph& graph, const std::vector<const Wiring*>& wirings);

/// Writes what processes must know of the whole into `graph`: the counts of every channel
/// (Channel.count), and the order of the stages of components that share a process (stage_place).
void FillPlan(const GraphPlan& plan, Graph* graph);

/// Holds the run's own numbers to their rules. Throws ConfigError, with `prefix` before the field.
void CheckRun(const RunSpec& spec, const std::string& prefix = "run: ");

struct ConfiguredComponent {
  int index = -1;  ///< in the graph
  std::string name;
  std::unique_ptr<Component> component;
  Wiring wiring;
};

/// Makes and configures component `index` of the run. A problem in its configuration is thrown as
/// ConfigError with field "NAME.field of its own configuration".
ConfiguredComponent ConfigureComponent(const RunSpec& spec, int index,
                                       const ComponentFactory& factory, SharedObjects* shared);

/// All components of a run, made, configured and checked.
class BoundGraph {
 public:
  /// `configuring`, where given, has the index of the component whose Configure runs, -1 between
  /// them. Throws GraphError or ConfigError.
  BoundGraph(const RunSpec& spec, const ComponentRegistry& registry,
             std::atomic<int>* configuring = nullptr);
  BoundGraph(BoundGraph&&) = default;
  BoundGraph& operator=(BoundGraph&&) = default;

  const GraphPlan& plan() const { return plan_; }
  int num_components() const { return static_cast<int>(components_.size()); }
  ConfiguredComponent& component(int i) { return components_[static_cast<size_t>(i)]; }
  const ConfiguredComponent& component(int i) const { return components_[static_cast<size_t>(i)]; }

 private:
  SharedObjects shared_;
  std::vector<ConfiguredComponent> components_;
  GraphPlan plan_;
};

}  // namespace poise
