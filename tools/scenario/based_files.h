// A file of a scenario or graph and the files that it is based on.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "components/framework/configuration/configuration.h"
#include "fmt/format.h"
#include "tools/scenario/catalog.h"

namespace poise {

/// A file whose `base` may name another.
template <class Message>
struct BasedFile {
  std::string name;
  std::string text;
  Message fields;  ///< its own alone

  /// As LocateField.
  int Line(std::string_view field) const { return LocateField(text, field, fields); }
  /// Throws ConfigError "file:line: field: problem".
  [[noreturn]] void Fail(std::string_view field, std::string_view problem) const {
    throw ConfigError(fmt::format("{}:{}: {}: {}", name, Line(field), field, problem));
  }
};

/// Reads `file`, its base (FindFile), and so on: the furthest base comes first. Throws ConfigError
/// "file:line: base: problem": no such file, bases that form a loop; and those of `parse`, which is
/// ParseTextProto or ParseScenario.
template <class Message, class Parse>
std::vector<BasedFile<Message>> ReadWithBases(std::filesystem::path file, const std::string& kind,
                                              BaseFiles bases, Parse parse) {
  std::vector<BasedFile<Message>> files;
  while (true) {
    BasedFile<Message>& last =
        *files.insert(files.begin(), {file.string(), ReadFile(file.string()), {}});
    parse(last.text, last.name, &last.fields);
    if (!last.fields.has_base()) return files;
    const std::string& base = last.fields.base();
    try {
      file = FindFile(kind, base, file.parent_path(), bases);
    } catch (const ConfigError& error) {
      last.Fail("base", error.what());
    }
    std::error_code error;
    for (const BasedFile<Message>& earlier : files) {
      if (!std::filesystem::equivalent(earlier.name, file, error)) continue;
      last.Fail("base",
                fmt::format("{} is based on this file itself; bases may not form a loop", base));
    }
  }
}

}  // namespace poise
