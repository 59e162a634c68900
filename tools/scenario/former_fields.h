// Names that fields of a scenario had before.
#pragma once

#include <string>
#include <string_view>

#include "tools/scenario/scenario.pb.h"

namespace poise {

/// What to write in place of the former path `path` ("sim_ode.push[0].peak"): "write
/// sim.push[0].peak". Empty when it is none.
std::string FormerField(std::string_view path);

/// ParseTextProto of a scenario: its error says what to write in place of a former name.
void ParseScenario(std::string_view text, std::string_view source, Scenario* scenario);

}  // namespace poise
