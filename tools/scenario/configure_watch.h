// Names the component whose Configure does not return.
#pragma once

#include <atomic>

#include "components/framework/graph.pb.h"
#include "tools/cli/stall_watch.h"

namespace poise {

/// Watches, while it lives, a BoundGraph that is being made. Where one Configure has not returned
/// for kReadyPatience, it says whose that is and ends the program.
class ConfigureWatch {
 public:
  /// `spec` outlives the watch.
  explicit ConfigureWatch(const RunSpec& spec);

  /// For BoundGraph to keep.
  std::atomic<int>* configuring() { return &configuring_; }

 private:
  std::atomic<int> configuring_{-1};  // index in the graph; -1: none
  StallThread thread_;
};

}  // namespace poise
