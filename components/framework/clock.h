// The runners' clock. Components never see it.
#pragma once

#include <cstdint>
#include <ctime>

namespace poise {

/// ns, CLOCK_MONOTONIC.
inline int64_t NowNanoseconds() {
  timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

}  // namespace poise
