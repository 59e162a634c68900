#include "tools/cli/output_style.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <utility>

#include "tools/cli/output_place.h"

namespace poise {
namespace {

constexpr int kDefaultColumns = 80;
constexpr int kFewestColumns = 20;

constexpr std::pair<std::string_view, std::string_view> kPlain[] = {
    {"─", "-"},     {"–", "-"},     {"−", "-"},     {"—", "-"},      {"·", "*"},     {"×", "x"},
    {"≥", ">="},    {"≤", "<="},    {"…", "..."},   {"→", "->"},     {"←", "<-"},    {"±", "+-"},
    {"°", "deg"},   {"²", "^2"},    {"³", "^3"},    {"⁻", "^-"},     {"¹", "1"},     {"½", "1/2"},
    {"µ", "u"},     {"μ", "mu"},    {"√", "sqrt"},  {"∞", "inf"},    {"η", "eta"},   {"ξ", "xi"},
    {"ω", "omega"}, {"π", "pi"},    {"τ", "tau"},   {"φ", "phi"},    {"α", "alpha"}, {"γ", "gamma"},
    {"σ", "sigma"}, {"Γ", "Gamma"}, {"Δ", "Delta"}, {"Λ", "Lambda"}, {"Σ", "Sigma"}, {"Φ", "Phi"},
    {"’", "'"},     {"“", "\""},    {"”", "\""},
};

std::string_view Variable(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? std::string_view() : std::string_view(value);
}

/// The locale of characters is UTF-8; whether it is installed does not matter to the terminal.
bool Utf8Locale() {
  for (const char* name : {"LC_ALL", "LC_CTYPE", "LANG"}) {
    std::string value(Variable(name));
    if (value.empty()) continue;
    std::transform(value.begin(), value.end(), value.begin(),
                   [](unsigned char c) { return std::tolower(c); });
    return value.find("utf-8") != std::string::npos || value.find("utf8") != std::string::npos;
  }
  return false;
}

int Columns(bool terminal) {
  winsize window{};
  if (terminal && ioctl(STDOUT_FILENO, TIOCGWINSZ, &window) == 0 && window.ws_col > 0) {
    return std::max<int>(window.ws_col, kFewestColumns);
  }
  const int columns = std::atoi(std::string(Variable("COLUMNS")).c_str());
  return columns >= kFewestColumns && columns <= 10000 ? columns : kDefaultColumns;
}

bool Continues(char c) { return (static_cast<unsigned char>(c) & 0xC0) == 0x80; }

/// Bytes of the UTF-8 character that begins with `c`.
size_t Length(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return byte < 0xC0 ? 1 : byte < 0xE0 ? 2 : byte < 0xF0 ? 3 : 4;
}

/// End of the escape sequence at `at`, or `at` when there is none.
size_t EndOfEscape(std::string_view text, size_t at) {
  if (text.substr(at, 2) != "\x1b[") return at;
  const size_t end = text.find('m', at);
  return end == std::string_view::npos ? at : end + 1;
}

bool keep_unicode = false;

/// A stream that writes to a file descriptor in plain characters.
struct PlainStream {
  int fd;
  std::string rest;  // begin of a character whose end has not been written yet
};

ssize_t WritePlain(void* cookie, const char* data, size_t size) {
  auto* const stream = static_cast<PlainStream*>(cookie);
  std::string text = std::exchange(stream->rest, {}) + std::string(data, size);
  size_t begin = text.size();  // of the last character
  while (begin > 0 && text.size() - begin < 4 && Continues(text[begin - 1])) --begin;
  if (begin > 0 && begin + Length(text[begin - 1]) - 1 > text.size()) {
    stream->rest = text.substr(begin - 1);
    text.resize(begin - 1);
  }
  const std::string plain = keep_unicode ? text : PlainText(text);
  return WriteAll(stream->fd, plain) ? static_cast<ssize_t>(size) : 0;
}

FILE* OpenPlain(PlainStream* stream, int mode) {
  FILE* const file = fopencookie(stream, "w", {nullptr, WritePlain, nullptr, nullptr});
  if (file != nullptr) setvbuf(file, nullptr, mode, BUFSIZ);
  return file;
}

}  // namespace

const OutputStyle& ScreenStyle() {
  static const OutputStyle style = [] {
    const bool terminal = isatty(STDOUT_FILENO) != 0;
    const std::string_view type = Variable("TERM");
    return OutputStyle{Columns(terminal),
                       terminal && Variable("NO_COLOR").empty() && !type.empty() && type != "dumb",
                       Utf8Locale()};
  }();
  return style;
}

std::string Toned(std::string_view text, Tone tone) {
  constexpr std::array<std::string_view, 4> kCodes = {"", "1", "32", "31;1"};
  const std::string_view code = kCodes[static_cast<size_t>(tone)];
  if (!ScreenStyle().colour || code.empty() || text.empty()) return std::string(text);
  std::string toned = "\x1b[";
  toned.append(code).append("m").append(text).append("\x1b[0m");
  return toned;
}

std::string WithoutTones(std::string_view text) {
  std::string plain;
  for (size_t i = 0; i < text.size();) {
    const size_t end = EndOfEscape(text, i);
    if (end == i) plain += text[i++];
    i = std::max(end, i);
  }
  return plain;
}

int DisplayWidth(std::string_view text) {
  const std::string plain = ScreenStyle().unicode ? std::string(text) : PlainText(text);
  int width = 0;
  for (size_t i = 0; i < plain.size();) {
    const size_t end = EndOfEscape(plain, i);
    if (end == i && !Continues(plain[i])) ++width;
    i = std::max(end, i + 1);
  }
  return width;
}

std::string Wrapped(std::string_view text, int width, int indent) {
  std::string wrapped;
  while (true) {
    const size_t line_end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, line_end);
    int column = 0;
    for (bool first = true; !line.empty(); first = false) {
      const size_t begin = line.find_first_not_of(' ');
      if (begin == std::string_view::npos) break;
      const size_t end = std::min(line.find(' ', begin), line.size());
      const std::string_view word = line.substr(begin, end - begin);
      line.remove_prefix(end);
      auto gap = static_cast<int>(begin);
      const int word_width = DisplayWidth(word);
      if (!first && column + gap + word_width > width) {
        wrapped += '\n';
        column = 0;
        gap = indent;
      }
      wrapped.append(static_cast<size_t>(gap), ' ').append(word);
      column += gap + word_width;
    }
    if (line_end == text.size()) return wrapped;
    wrapped += '\n';
    text.remove_prefix(line_end + 1);
  }
}

std::string PlainText(std::string_view text) {
  std::string plain;
  for (size_t i = 0; i < text.size();) {
    const auto replaced =
        static_cast<unsigned char>(text[i]) < 0x80
            ? std::end(kPlain)
            : std::find_if(std::begin(kPlain), std::end(kPlain), [&](const auto& pair) {
                return text.substr(i).starts_with(pair.first);
              });
    if (replaced == std::end(kPlain)) {
      plain += text[i++];
    } else {
      plain += replaced->second;
      i += replaced->first.size();
    }
  }
  return plain;
}

void KeepUnicode() { keep_unicode = true; }

void UsePlainStreams() {
  static PlainStream out{STDOUT_FILENO, {}};
  static PlainStream error{STDERR_FILENO, {}};
  if (ScreenStyle().unicode) return;
  FILE* const plain_out = OpenPlain(&out, isatty(STDOUT_FILENO) != 0 ? _IOLBF : _IOFBF);
  FILE* const plain_error = OpenPlain(&error, _IONBF);
  if (plain_out != nullptr) stdout = plain_out;
  if (plain_error != nullptr) stderr = plain_error;
}

}  // namespace poise
