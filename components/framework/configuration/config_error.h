// What is wrong with a configuration, for whoever knows its file.
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

namespace poise {

/// A configuration that cannot be used. what() is one line: "file:line: field: problem; what to
/// do".
class ConfigError : public std::runtime_error {
 public:
  explicit ConfigError(const std::string& line) : std::runtime_error(line) {}
  /// For a value that parses but cannot work. `field` is the dotted path inside the component's own
  /// configuration ("phase[2].duration"); whoever knows the file turns it into file and line
  /// (LocateField).
  ConfigError(std::string_view field, std::string_view problem)
      : std::runtime_error(std::string(field).append(": ").append(problem)),
        field_(field),
        problem_(problem) {}
  const std::string& field() const { return field_; }
  const std::string& problem() const { return problem_; }

 private:
  std::string field_;
  std::string problem_;
};

}  // namespace poise
