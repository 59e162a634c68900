#include "tools/scenario/former_fields.h"

#include <array>

#include "components/framework/configuration/configuration.h"
#include "fmt/format.h"

namespace poise {
namespace {

constexpr std::string_view kGroup = "sim_ode";
constexpr std::array<std::string_view, 2> kSoftness = {"erp", "cfm"};  // of sim_ode.ground

/// What to write in place of the field that protobuf's parser complains of.
std::string FormerFieldIn(std::string_view complaint) {
  const auto names = [&](std::string_view type, std::string_view field) {
    return complaint.find(fmt::format("\"poise.{}\" has no field named \"{}\"", type, field)) !=
           std::string_view::npos;
  };
  if (names("Scenario", kGroup)) return "write sim { ... }";
  for (const std::string_view field : kSoftness) {
    if (!names("Ground", field)) continue;
    return fmt::format("write ode {{ contact_{}: ... }} beside sim {{ ... }}", field);
  }
  return "";
}

}  // namespace

std::string FormerField(std::string_view path) {
  if (!path.starts_with(kGroup)) return "";
  const std::string_view rest = path.substr(kGroup.size());
  if (!rest.empty() && rest[0] != '.') return "";
  for (const std::string_view field : kSoftness) {
    if (rest == fmt::format(".ground.{}", field)) return fmt::format("write ode.contact_{}", field);
  }
  return fmt::format("write sim{}", rest);
}

void ParseScenario(std::string_view text, std::string_view source, Scenario* scenario) {
  try {
    ParseTextProto(text, source, scenario);
  } catch (const ConfigError& error) {
    const std::string hint = FormerFieldIn(error.what());
    if (hint.empty()) throw;
    std::string complaint = error.what();
    if (complaint.ends_with('.')) complaint.pop_back();
    throw ConfigError(fmt::format("{}; {}", complaint, hint));
  }
}

}  // namespace poise
