// Order of the stages in one tick. Part of PlanGraph.
#pragma once

#include <vector>

#include "components/framework/graph.h"

namespace poise {

/// Fills in plan->order and plan->tick_sources: every stage after those it reads from in the same
/// tick and after its component's stages before it; among free stages the one that comes first in
/// the graph. Adds a problem that names the loop when there is no such order, or
/// when a loop, delayed or not, holds no tick source.
void OrderStages(const Graph& graph, const std::vector<const Wiring*>& wirings, GraphPlan* plan,
                 std::vector<GraphError::Problem>* problems);

}  // namespace poise
