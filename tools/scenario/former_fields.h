// Fields that a scenario had before.
#pragma once

#include <string>
#include <string_view>

#include "tools/scenario/scenario.pb.h"

namespace poise {

/// What to do about the former path `path` ("sim_ode.push[0].peak"): "write sim.push[0].peak".
/// Empty when it is none.
std::string FormerField(std::string_view path);

/// ParseTextProto of a scenario: its error says what to do about a former name.
void ParseScenario(std::string_view text, std::string_view source, Scenario* scenario);
/// The scenario of a run that has been, parsed from `text`: fields that went with what they set are
/// passed over. Throws as ParseScenario does.
Scenario LoggedScenario(std::string_view text, std::string_view source);

}  // namespace poise
