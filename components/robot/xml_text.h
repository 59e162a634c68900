// XML of unknown origin: checked for what its parsers cannot bear, then parsed.
#pragma once

#include <string>
#include <string_view>

namespace tinyxml2 {
class XMLDocument;
class XMLElement;
}  // namespace tinyxml2

namespace poise::robot {

/// Parses into `document`. `format` ("URDF") begins each error. Throws RobotError: too large, NUL
/// bytes, nested too deep, no XML.
void ParseXml(std::string_view xml, const char* format, tinyxml2::XMLDocument* document);

/// One line of printable text, whatever a file put into a name or a library into a message.
std::string OneLine(std::string text);

/// OneLine of an attribute; empty without it.
std::string Attribute(const tinyxml2::XMLElement& element, const char* name);

}  // namespace poise::robot
