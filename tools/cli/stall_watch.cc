#include "tools/cli/stall_watch.h"

#include <chrono>
#include <condition_variable>
#include <mutex>

#include "components/framework/clock.h"

namespace poise {

std::jthread WatchForStall(int64_t patience, std::function<int64_t()> progress,
                           std::function<void(int64_t)> stalled) {
  return std::jthread([=](const std::stop_token& stop) {
    constexpr std::chrono::milliseconds kLook{200};
    StallWatch watch;
    std::mutex mutex;
    std::unique_lock lock(mutex);
    std::condition_variable_any asked;
    while (!asked.wait_for(lock, stop, kLook, [&] { return stop.stop_requested(); })) {
      const int64_t at = progress();
      if (watch.Stood(at, NowNanoseconds()) <= patience || at < 0) continue;
      stalled(at);
      return;
    }
  });
}

}  // namespace poise
