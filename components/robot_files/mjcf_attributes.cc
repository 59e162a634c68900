#include "components/robot_files/mjcf_attributes.h"

#include <tinyxml2.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <map>

#include "components/robot/xml_text.h"

namespace poise::robot {
namespace {

using Names = std::vector<std::string_view>;

constexpr double kMaxNumber = 1e6;  // in any unit that the file may use: beyond it, a mistake

const Names kActuators = {"general",     "motor",  "position", "velocity",
                          "intvelocity", "damper", "cylinder"};

// Numeric attributes that reach MuJoCo, by element.
const std::map<std::string_view, Names> kNumbers = {
    {"joint", {"axis", "pos", "range", "ref", "armature", "damping", "frictionloss"}},
    {"geom", {"size", "pos", "fromto", "mass", "density", "contype", "conaffinity", "group"}},
    {"site", {"pos"}},
    {"body", {"pos"}},
    {"inertial", {"pos"}},
    {"actuator", {"gear", "ctrlrange", "forcerange"}},
    {"compiler", {"inertiagrouprange"}},
};
// Those whose value is one of a few words.
const std::map<std::string_view, Names> kWords = {
    {"type",
     {"hinge", "slide", "ball", "free", "box", "sphere", "cylinder", "capsule", "ellipsoid"}},
    {"limited", {"true", "false", "auto"}},
    {"ctrllimited", {"true", "false", "auto"}},
    {"forcelimited", {"true", "false", "auto"}},
    {"angle", {"degree", "radian"}},
    {"inertiafromgeom", {"true", "false", "auto"}},
    {"autolimits", {"true", "false"}},
};
const std::map<std::string_view, Names> kWordsOf = {
    {"joint", {"type", "limited"}},
    {"geom", {"type"}},
    {"actuator", {"ctrllimited", "forcelimited"}},
    {"compiler", {"angle", "inertiafromgeom", "autolimits"}},
};

bool Has(const Names& names, std::string_view name) {
  return std::ranges::find(names, name) != names.end();
}

}  // namespace

void FailMjcfAt(const tinyxml2::XMLElement& at, const std::string& text) {
  throw RobotError(fmt::format("MJCF line {}: {}", at.GetLineNum(), text));
}

void FailMjcfLength(const tinyxml2::XMLElement& at, const char* name, size_t has, size_t needs) {
  FailMjcf(at, "{} of <{}> has {} numbers, it needs {}", name, Shown(at), has, needs);
}

std::string Shown(const tinyxml2::XMLElement& element) { return OneLine(element.Value()); }

std::vector<double> MjcfNumbers(const tinyxml2::XMLElement& element, std::string_view name) {
  std::vector<double> numbers;
  const char* text = element.Attribute(std::string(name).c_str());
  while (text != nullptr) {
    while (std::isspace(static_cast<unsigned char>(*text))) ++text;
    if (*text == '\0') break;
    char* end = nullptr;
    const double number = std::strtod(text, &end);
    if (end == text || !std::isfinite(number) || std::abs(number) > kMaxNumber ||
        (*end != '\0' && !std::isspace(static_cast<unsigned char>(*end)))) {
      FailMjcf(element, "{} of <{}> is '{}': numbers of at most {:g} must stand there", name,
               Shown(element), OneLine(element.Attribute(std::string(name).c_str())), kMaxNumber);
    }
    numbers.push_back(number);
    text = end;
  }
  return numbers;
}

std::string KeptAttributes(const tinyxml2::XMLElement& element, std::string_view kind) {
  std::string text;
  const auto keep = [&](std::string_view name) {
    const std::vector<double> numbers = MjcfNumbers(element, name);
    if (numbers.empty()) return;
    text += fmt::format(" {}='", name);
    for (const double number : numbers) text += fmt::format("{:.17g} ", number);
    text.back() = '\'';
  };
  for (const std::string_view name : kNumbers.at(kind)) keep(name);
  if (kind != "joint" && kind != "actuator" && kind != "compiler") {
    for (const std::string_view name : kOrientations) keep(name);
  }
  if (const auto words = kWordsOf.find(kind); words != kWordsOf.end()) {
    for (const std::string_view name : words->second) {
      const std::string value = Attribute(element, std::string(name).c_str());
      if (value.empty()) continue;
      if (!Has(kWords.at(name), value)) {
        // Types that MuJoCo need not see are told by the reader.
        if (kind == "geom") continue;
        FailMjcf(element, "{} of <{}> is '{}': it is unknown", name, Shown(element), value);
      }
      text += fmt::format(" {}='{}'", name, value);
    }
  }
  return text;
}

bool IsGeomType(const std::string& type) { return Has(kWords.at("type"), type); }

bool IsActuator(const std::string& element) { return Has(kActuators, element); }

}  // namespace poise::robot
