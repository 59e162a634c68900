// Runs a whole graph inside one process, in memory.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "components/framework/bus/packet_filter.h"
#include "components/framework/graph.h"
#include "components/framework/operator_acts.h"
#include "components/framework/runners/latency_histogram.h"
#include "components/framework/runners/run_position.h"

namespace poise {

/// Runs the stages of all components in the plan's order; messages pass by reference.
/// Deterministic: it gives the numbers that the graph of processes gives. Not thread-safe.
class InlineRunner {
 public:
  /// Called after each stage for each of its outputs, in their order. `channel` is an index in the
  /// graph.
  using Tap = std::function<void(int channel, const OutputPort& output, const Tick& tick)>;

  /// Makes, configures and checks all components. Throws GraphError or ConfigError.
  InlineRunner(const RunSpec& spec, const ComponentRegistry& registry);
  /// Runs the components of `graph`, which was made of `spec` and has not run yet.
  InlineRunner(const RunSpec& spec, BoundGraph graph);
  ~InlineRunner();

  void set_tap(Tap tap) { tap_ = std::move(tap); }
  /// Called for every message of an external channel: those injected, and components' answers to an
  /// operator's acts.
  using ExternalTap = std::function<void(int channel, std::span<const uint8_t> data)>;
  void set_external_tap(ExternalTap tap) { external_tap_ = std::move(tap); }

  /// Keeps `position`, which must outlive the last Step, at the stage that runs.
  void set_position(RunPosition* position) { position_ = position; }
  struct StageName {
    std::string component, stage;
  };
  /// In the order in which they run.
  std::vector<StageName> StageNames();

  /// Runs one tick, all stages. False when the run has ended (before or in this tick).
  bool Step();
  /// Runs the stages of the next tick that come before the first one of a component for which
  /// `until` holds. Step goes on from there.
  void BeginTick(const std::function<bool(int component)>& until);
  /// Whether stages of the next tick have run.
  bool begun() const { return next_stage_ > 0; }
  /// Runs up to `ticks` ticks; ends early when the run ends or `*stop` becomes true. Returns the
  /// ticks run.
  int64_t Run(int64_t ticks, const std::atomic<bool>* stop = nullptr);

  /// Shows an encoded message of an external channel to its readers from the next stage on, an
  /// operator's act in its tick. False when it was refused.
  bool Inject(const std::string& channel, std::span<const uint8_t> data);

  int64_t ticks_completed() const { return next_tick_; }
  /// True once a component has finished or failed, or num_ticks of the run are done.
  bool ended() const { return ended_; }
  bool failed() const { return failed_; }
  const std::string& end_detail() const { return end_detail_; }
  /// Name of the component that has ended the run; empty: none has.
  const std::string& end_component() const { return end_component_; }

  const GraphPlan& plan() const { return graph_.plan(); }
  BoundGraph& graph() { return graph_; }
  /// Time in a component's stages, outputs' tap not counted.
  const LatencyHistogram& latency(int component) const;
  /// Has the calls of `count`, this thread's allocations so far, told apart by stage from now on.
  void CountAllocations(int64_t (*count)()) { count_allocations_ = count; }
  struct StageAllocations {
    std::string component, stage;
    int64_t ticks = 0;  ///< that allocate
    int64_t total = 0, most = 0;
  };
  /// In the order of the tick.
  std::vector<StageAllocations> allocations() const;
  /// Time of whole ticks.
  const LatencyHistogram& tick_latency() const { return tick_latency_; }

 private:
  struct BoundStage;
  struct Delayed;
  struct External;

  /// False when an output is not finite: the tick ends there.
  bool RunStage(BoundStage& stage, const Tick& tick);
  void Stop(const ConfiguredComponent& component, bool failed, const std::string& why);
  void TakeAnswers();

  int64_t run_id_ = 0;
  double period_ = 0;
  int64_t lead_ = 0;
  int64_t num_ticks_ = 0;
  BoundGraph graph_;
  Tap tap_;
  ExternalTap external_tap_;
  RunPosition own_position_;
  RunPosition* position_ = &own_position_;
  std::vector<ActInput*> acts_;
  int answer_channel_ = -1;  // -1: the graph has none
  std::vector<uint8_t> answer_bytes_;
  std::vector<BoundStage> stages_;
  std::vector<Delayed> delayed_;
  std::vector<External> external_;
  std::vector<LatencyHistogram> latency_;
  LatencyHistogram tick_latency_;
  int64_t next_tick_ = 0;
  size_t next_stage_ = 0;  // of that tick
  int64_t (*count_allocations_)() = nullptr;
  bool ended_ = false;
  bool failed_ = false;
  std::string end_detail_, end_component_;
};

}  // namespace poise
