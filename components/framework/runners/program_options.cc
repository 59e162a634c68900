#include "components/framework/runners/program_options.h"

#include <CLI/CLI.hpp>

#include "components/framework/build_info.h"
#include "components/framework/say_error.h"
#include "fmt/format.h"

namespace poise {
namespace {

CLI::Option* Add(CLI::App* app, const ProgramOption& option) {
  const auto& [flag, to, text, required, needs] = option;
  if (const auto* const string = std::get_if<std::string*>(&to)) {
    return app->add_option(flag, **string, text)->capture_default_str();
  }
  if (const auto* const number = std::get_if<int*>(&to))
    return app->add_option(flag, **number, text);
  if (const auto* const on = std::get_if<bool*>(&to)) return app->add_flag(flag, **on, text);
  const auto act = [act = std::get<std::function<void()>>(to)] {
    act();
    throw CLI::Success();
  };
  return app->add_flag_callback(flag, act, text)->trigger_on_parse();
}

}  // namespace

std::optional<int> ParseProgram(int argc, char** argv, const std::string& name,
                                const std::string& description,
                                const std::vector<ProgramOption>& options) {
  CLI::App app{description, name};
  app.set_version_flag("--version", VersionText(name));
  for (const ProgramOption& option : options) {
    CLI::Option* const added = Add(&app, option)->required(option.required);
    if (option.needs != nullptr) added->needs(app.get_option(option.needs));
  }
  try {
    app.parse(argc, argv);
    return {};
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);
    SayError(fmt::format("{}: {}; see {} --help", name, error.what(), name));
    return 2;
  }
}

}  // namespace poise
