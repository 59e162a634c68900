#include "tools/cli/stall_watch.h"

#include <chrono>
#include <utility>

#include "components/framework/clock.h"

namespace poise {

StallThread::StallThread(int64_t patience, std::function<int64_t()> progress,
                         std::function<void(int64_t)> stalled) {
  thread_ =
      std::thread([this, patience, progress = std::move(progress), stalled = std::move(stalled)] {
        constexpr std::chrono::milliseconds kLook{200};
        StallWatch watch;
        std::unique_lock lock(mutex_);
        while (!changed_.wait_for(lock, kLook, [this] { return over_; })) {
          const int64_t at = progress();
          if (watch.Stood(at, NowNanoseconds()) <= patience || at < 0) continue;
          stalled(at);
          return;
        }
      });
}

StallThread::~StallThread() {
  {
    const std::lock_guard lock(mutex_);
    over_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

}  // namespace poise
