// What the standard output can show, and texts that fit it.
#pragma once

#include <string>
#include <string_view>
#include <utility>

#include "fmt/format.h"

namespace poise {

struct OutputStyle {
  int columns = 80;
  bool colour = false;
  bool unicode = true;
};

/// The style of stdout, found once: columns of the terminal, else $COLUMNS, else 80; colour on a
/// terminal unless $NO_COLOR is set or $TERM is dumb; Unicode where the locale is UTF-8.
const OutputStyle& ScreenStyle();

enum class Tone { kPlain, kStrong, kGood, kBad };

/// `text` in the colour of `tone`, where stdout shows colours.
std::string Toned(std::string_view text, Tone tone);

/// `text` as it is without colours, for files.
std::string WithoutTones(std::string_view text);

/// Columns that a UTF-8 text takes on stdout; colours take none.
int DisplayWidth(std::string_view text);

/// Breaks `text` at spaces into lines of at most `width` columns, each but the first after `indent`
/// spaces; a longer word stands alone. Its own line breaks stay. Ends without one.
std::string Wrapped(std::string_view text, int width, int indent = 0);

/// What is formatted, Wrapped to the columns of stdout, with its end.
template <class... Args>
std::string ScreenLines(int indent, fmt::format_string<Args...> format, Args&&... args) {
  const std::string text = fmt::format(format, std::forward<Args>(args)...);
  return Wrapped(text, ScreenStyle().columns, indent) + "\n";
}

/// `text` with the characters that Poise uses in ASCII: "-" for "─", ">=" for "≥". Others stay.
std::string PlainText(std::string_view text);

/// Makes PlainText of what is written to stdout and stderr where the locale cannot show Unicode.
/// Call once, before anything is written.
void UsePlainStreams();
/// What this program prints is for a file: it stays UTF-8 where UsePlainStreams would change it.
void KeepUnicode();

}  // namespace poise
