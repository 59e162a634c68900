// Text and bytes from a bus or a log, fit to be shown.
#pragma once

#include <string>
#include <string_view>

namespace poise::logging {

/// All but printable ASCII as escape sequences (\n, \x1b), backslashes doubled and quotes as
/// `quote`: what a message or a log says must not drive the terminal.
std::string Printable(std::string_view text, std::string_view quote = "\\\"");

/// Text as it is when it is UTF-8 without control characters, else as Printable, quotes kept.
std::string ForTerminal(std::string_view text);
/// ForTerminal of each line by itself.
std::string LinesForTerminal(std::string_view text);

/// `text` as a cell of a CSV file (RFC 4180): in quotes where it must be.
std::string CsvCell(std::string_view text);

/// Bytes as text, padded with = to whole groups of four (RFC 4648, 4).
std::string Base64(std::string_view bytes);

bool IsUtf8(std::string_view text);
/// True for UTF-8 without control characters.
bool IsPlainUtf8(std::string_view text);

}  // namespace poise::logging
