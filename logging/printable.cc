#include "logging/printable.h"

#include <algorithm>
#include <boost/archive/iterators/base64_from_binary.hpp>
#include <boost/archive/iterators/transform_width.hpp>
#include <nlohmann/json.hpp>

#include "fmt/format.h"

namespace poise::logging {

std::string Printable(std::string_view text, std::string_view quote) {
  std::string escaped;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"') {
      escaped += quote;
    } else if (c == '\\') {
      escaped += "\\\\";
    } else if (c == '\n') {
      escaped += "\\n";
    } else if (byte < 0x20 || byte >= 0x7f) {
      escaped += fmt::format("\\x{:02x}", byte);
    } else {
      escaped += c;
    }
  }
  return escaped;
}

std::string Base64(std::string_view bytes) {
  using boost::archive::iterators::base64_from_binary, boost::archive::iterators::transform_width;
  using Digits = base64_from_binary<transform_width<const char*, 6, 8>>;
  std::string text(Digits(bytes.data()), Digits(bytes.data() + bytes.size()));
  return text.append((3 - bytes.size() % 3) % 3, '=');
}

std::string CsvCell(std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos) return std::string(text);
  std::string quoted = "\"";
  for (const char c : text) quoted.append(c == '"' ? 2 : 1, c);
  return quoted + '"';
}

bool IsUtf8(std::string_view text) {
  try {
    nlohmann::json(text).dump();  // strict: throws for what is no UTF-8
  } catch (const nlohmann::json::type_error&) {
    return false;
  }
  return true;
}

bool IsPlainUtf8(std::string_view text) {
  const auto control = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; };
  if (std::any_of(text.begin(), text.end(), control)) return false;
  // U+0080 to U+009F are control characters as well.
  for (size_t i = 1; i < text.size(); ++i) {
    if (text[i - 1] == '\xc2' && static_cast<unsigned char>(text[i]) < 0xa0) return false;
  }
  return IsUtf8(text);
}

std::string ForTerminal(std::string_view text) {
  return IsPlainUtf8(text) ? std::string(text) : Printable(text, "\"");
}

std::string LinesForTerminal(std::string_view text) {
  std::string lines;
  for (size_t end = text.find('\n'); end != std::string_view::npos; end = text.find('\n')) {
    lines += ForTerminal(text.substr(0, end)) + '\n';
    text.remove_prefix(end + 1);
  }
  return lines + ForTerminal(text);
}

}  // namespace poise::logging
