#include "tools/scenario/configure_watch.h"

#include <unistd.h>

#include <cstdint>
#include <cstdio>

#include "fmt/format.h"

namespace poise {
ConfigureWatch::ConfigureWatch(const RunSpec& spec)
    : thread_(
          kReadyPatience, [this] { return configuring_.load(); },
          [&spec](int64_t component) {
            fmt::print(stderr, "poise: {} hangs: its Configure has not returned for {} s\n",
                       spec.graph().component(static_cast<int>(component)).name(),
                       kReadyPatience / 1'000'000'000);
            std::fflush(nullptr);
            _exit(1);
          }) {}

}  // namespace poise
