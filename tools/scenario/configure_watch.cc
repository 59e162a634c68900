#include "tools/scenario/configure_watch.h"

#include <unistd.h>

#include <cstdint>
#include <cstdio>

#include "fmt/format.h"

namespace poise {
namespace {

constexpr int64_t kSecond = 1'000'000'000;   // ns
constexpr int64_t kPatience = 30 * kSecond;  // the launcher's for a process to be ready

}  // namespace

ConfigureWatch::ConfigureWatch(const RunSpec& spec)
    : thread_(
          kPatience, [this] { return configuring_.load(); },
          [&spec](int64_t component) {
            fmt::print(stderr, "poise: {} hangs: its Configure has not returned for {} s\n",
                       spec.graph().component(static_cast<int>(component)).name(),
                       kPatience / kSecond);
            std::fflush(nullptr);
            _exit(1);
          }) {}

}  // namespace poise
