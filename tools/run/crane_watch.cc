#include "tools/run/crane_watch.h"

namespace poise {

CraneWatch::CraneWatch(const RunSpec& spec)
    : period_(spec.tick_period()), lead_(spec.lead_ticks()) {
  const int channel = FindChannelOfType(spec.graph(), "ground_truth_t");
  if (channel >= 0 && lead_ > 0) {
    tap_ = std::make_unique<ChannelTap<ground_truth_t>>(spec, channel);
  }
}

void CraneWatch::Receive() {
  ground_truth_t truth;
  while (tap_ && tap_->Next(&truth)) {
    held_ = held_ || truth.crane_share > 0;
    const bool free = truth.crane_share == 0;
    if (held_ && free) let_go_ = MakeTick(truth.tick, period_, lead_).time;
    // Without a crane the first message tells that there is nothing to watch.
    if (free) tap_.reset();
  }
}

}  // namespace poise
