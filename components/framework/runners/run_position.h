// Where a run stands, for who watches it from another thread or process.
#pragma once

#include <atomic>
#include <cstdint>

namespace poise {

/// Lock-free, so that it may lie in memory that processes share.
struct RunPosition {
  static constexpr int32_t kNoStage = -1;

  std::atomic<int64_t> tick{-1};         ///< that is being computed; -1: none yet
  std::atomic<int32_t> stage{kNoStage};  ///< its index in InlineRunner::StageNames()
};
static_assert(std::atomic<int64_t>::is_always_lock_free);

}  // namespace poise
