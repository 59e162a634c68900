#include "components/framework/optional_ports.h"

#include <algorithm>

#include "fmt/format.h"

namespace poise {
namespace {

std::vector<OptionalPort>& All() {
  static std::vector<OptionalPort> all;
  return all;
}

}  // namespace

void AddOptionalPort(const OptionalPort& port) {
  const bool known = std::ranges::any_of(All(), [&](const OptionalPort& other) {
    return other.component == port.component && other.port == port.port &&
           other.input == port.input;
  });
  if (!known) All().push_back(port);
}

std::vector<OptionalPort> OptionalPortsOf(const std::string& component) {
  std::vector<OptionalPort> ports;
  std::ranges::copy_if(All(), std::back_inserter(ports),
                       [&](const OptionalPort& port) { return port.component == component; });
  return ports;
}

std::string WhereText(const OptionalPort& port) {
  std::string text;
  if (!port.when.empty()) text += fmt::format(" where {} is set", fmt::join(port.when, " or "));
  if (!port.unless.empty())
    text += fmt::format(" unless {} is set", fmt::join(port.unless, " or "));
  return text.empty() ? text : text.substr(1);
}

}  // namespace poise
