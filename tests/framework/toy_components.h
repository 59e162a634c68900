// Small components that together have everything the runners must handle: a loop through the tick
// before, two stages, a free-running source with a sink that does not lead back, and an external
// channel.
#pragma once

#include "components/framework/component_registry.h"
#include "components/framework/graph.pb.h"

namespace poise {

/// toy_plant, toy_filter, toy_controller (the loop); toy_clock, toy_sink (the chain); toy_echo.
void AddToyComponents(ComponentRegistry* registry);

/// plant -> filter -> controller -> plant, with channel STOP from outside.
Graph ToyLoop();
/// clock -> sink.
Graph ToyChain();
/// A run of `graph` with a run id and ports of this process's own.
RunSpec ToyRun(const Graph& graph, int64_t num_ticks);

/// Calls of operator new in this process since its start.
int64_t AllocationCount();

}  // namespace poise
