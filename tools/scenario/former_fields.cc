#include "tools/scenario/former_fields.h"

#include <algorithm>
#include <array>

#include "components/framework/configuration/configuration.h"
#include "fmt/format.h"

namespace poise {
namespace {

constexpr std::string_view kGroup = "sim_ode";
constexpr std::array<std::string_view, 2> kSoftness = {"erp", "cfm"};  // of sim_ode.ground
constexpr std::string_view kEstimator = "state_estimator.";
constexpr std::array<std::string_view, 6> kOfAnchoredFeet = {"method",
                                                             "orientation_time_constant",
                                                             "gravity_time_constant",
                                                             "gyro_bias_time_constant",
                                                             "anchor_time_constant",
                                                             "foot_rotation_tolerance"};
constexpr const char* kOneEstimator = "leave it out: the invariant filter is the one estimator";

/// Whether protobuf's parser complains that `type` has no field `field`.
bool Names(std::string_view complaint, std::string_view type, std::string_view field) {
  return complaint.find(fmt::format("\"poise.{}\" has no field named \"{}\"", type, field)) !=
         std::string_view::npos;
}

/// Whether the parser complains of a field that went with what it was of.
bool IsGone(std::string_view complaint) {
  return std::ranges::any_of(kOfAnchoredFeet, [&](std::string_view field) {
    return Names(complaint, "StateEstimatorConfig", field);
  });
}

/// What to write in place of the field that the parser complains of.
std::string FormerFieldIn(std::string_view complaint) {
  if (IsGone(complaint)) return kOneEstimator;
  if (Names(complaint, "Scenario", kGroup)) return "write sim { ... }";
  for (const std::string_view field : kSoftness) {
    if (!Names(complaint, "Ground", field)) continue;
    return fmt::format("write ode {{ contact_{}: ... }} beside sim {{ ... }}", field);
  }
  return "";
}

void Parse(std::string_view text, std::string_view source, Scenario* scenario,
           bool (*passes_over)(std::string_view complaint)) {
  try {
    ParseTextProto(text, source, scenario, passes_over);
  } catch (const ConfigError& error) {
    const std::string hint = FormerFieldIn(error.what());
    if (hint.empty()) throw;
    std::string complaint = error.what();
    if (complaint.ends_with('.')) complaint.pop_back();
    throw ConfigError(fmt::format("{}; {}", complaint, hint));
  }
}

}  // namespace

std::string FormerField(std::string_view path) {
  if (path.starts_with(kEstimator)) {
    const auto gone = std::ranges::find(kOfAnchoredFeet, path.substr(kEstimator.size()));
    return gone == kOfAnchoredFeet.end() ? "" : kOneEstimator;
  }
  if (!path.starts_with(kGroup)) return "";
  const std::string_view rest = path.substr(kGroup.size());
  if (!rest.empty() && rest[0] != '.') return "";
  for (const std::string_view field : kSoftness) {
    if (rest == fmt::format(".ground.{}", field)) return fmt::format("write ode.contact_{}", field);
  }
  return fmt::format("write sim{}", rest);
}

void ParseScenario(std::string_view text, std::string_view source, Scenario* scenario) {
  Parse(text, source, scenario, nullptr);
}

Scenario LoggedScenario(std::string_view text, std::string_view source) {
  Scenario scenario;
  Parse(text, source, &scenario, IsGone);
  return scenario;
}

}  // namespace poise
