#include "components/robot/xml_text.h"

#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <cctype>

#include "components/robot/robot_model.h"

namespace poise::robot {
namespace {

// Parsers recurse over nested elements.
constexpr int kMaxNesting = 64;
constexpr size_t kMaxBytes = 16u << 20;

auto LineAt(std::string_view xml, size_t offset) {
  return 1 + std::ranges::count(xml.substr(0, offset), '\n');
}

// The place where elements are nested too deep, found before any parser sees the text; npos: there
// is none.
size_t TooDeep(std::string_view xml) {
  int depth = 0;
  for (size_t i = xml.find('<'); i != std::string_view::npos; i = xml.find('<', i + 1)) {
    const std::string_view rest = xml.substr(i + 1);
    if (rest.starts_with("!--")) {
      i = xml.find("-->", i);
      if (i == std::string_view::npos) break;
    } else if (rest.starts_with("/")) {
      depth = std::max(0, depth - 1);
    } else if (!rest.empty() && (std::isalpha(static_cast<unsigned char>(rest[0])) ||
                                 rest[0] == '_' || static_cast<unsigned char>(rest[0]) >= 0x80)) {
      const size_t end = xml.find('>', i);
      if ((end == std::string_view::npos || xml[end - 1] != '/') && ++depth > kMaxNesting) return i;
    }
  }
  return std::string_view::npos;
}

}  // namespace

std::string OneLine(std::string text) {
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < ' ' || c == '\x7f') c = ' ';
  }
  if (text.size() > 300) text = text.substr(0, 300) + "...";
  return text;
}

std::string Attribute(const tinyxml2::XMLElement& element, const char* name) {
  const char* value = element.Attribute(name);
  return value ? OneLine(value) : std::string();
}

void ParseXml(std::string_view xml, const char* format, tinyxml2::XMLDocument* document) {
  if (xml.size() > kMaxBytes) {
    throw RobotError(fmt::format("{} has {} bytes, more than {}: no robot's file needs as many",
                                 format, xml.size(), kMaxBytes));
  }
  if (const size_t nul = xml.find('\0'); nul != std::string_view::npos) {
    throw RobotError(
        fmt::format("{} line {} has a NUL byte: is it a text file?", format, LineAt(xml, nul)));
  }
  if (const size_t at = TooDeep(xml); at != std::string_view::npos) {
    throw RobotError(
        fmt::format("{} line {} nests elements more than {} deep: is an element not closed?",
                    format, LineAt(xml, at), kMaxNesting));
  }
  document->Parse(xml.data(), xml.size());
  if (document->Error()) {
    throw RobotError(fmt::format("{} line {}: not XML ({}): correct the text there", format,
                                 document->ErrorLineNum(), OneLine(document->ErrorStr())));
  }
}

}  // namespace poise::robot
