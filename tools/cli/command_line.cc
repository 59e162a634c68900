#include "tools/cli/command_line.h"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <set>
#include <system_error>
#include <vector>

#include "components/framework/configuration/suggest.h"
#include "components/framework/configuration/text_pattern.h"
#include "fmt/format.h"
#include "tools/cli/output_style.h"
#include "tools/cli/text_table.h"

namespace poise {
namespace {

constexpr int kDescription = 30;  // column of the descriptions, as CLI11 lays them out

/// The command that the line names, as far as it could be read.
const CLI::App& Named(const CLI::App& app) {
  const std::vector<CLI::App*> parsed = app.get_subcommands();
  return parsed.empty() ? app : Named(*parsed.back());
}

/// "poise log info".
std::string FullName(const CLI::App& app) {
  const CLI::App* const parent = app.get_parent();
  return parent == nullptr ? app.get_name()
                           : fmt::format("{} {}", FullName(*parent), app.get_name());
}

std::vector<const CLI::App*> Subcommands(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App*) { return true; });
}

std::vector<std::string> Flags(const CLI::App& app) {
  std::vector<std::string> flags;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) flags.push_back(fmt::format("--{}", name));
  }
  return flags;
}

/// The commands below `app` that know `flag`.
void FindFlag(const CLI::App& app, const std::string& flag, std::vector<std::string>* found) {
  for (const CLI::App* command : Subcommands(app)) {
    const std::vector<std::string> flags = Flags(*command);
    if (std::find(flags.begin(), flags.end(), flag) != flags.end()) {
      found->push_back(FullName(*command));
    }
    FindFlag(*command, flag, found);
  }
}

/// Whether `app` takes what is called so without a flag.
bool TakesBare(const CLI::App& app, const std::string& name) {
  return std::ranges::any_of(app.get_options(), [&](const CLI::Option* option) {
    return option->get_positional() && option->get_name() == name;
  });
}

std::string UnknownFlag(const CLI::App& root, const CLI::App& command,
                        const std::string& argument) {
  const std::string flag = argument.substr(0, argument.find('='));
  std::string text = fmt::format("has no flag {}", flag);
  const std::vector<std::string> near = Nearest(flag, Flags(command));
  std::vector<std::string> others;
  FindFlag(root, flag, &others);
  if (flag.starts_with("--") && TakesBare(command, flag.substr(2))) {
    text += fmt::format("; it takes that without a flag: {} {}", FullName(command), flag.substr(2));
  } else if (!near.empty()) {
    text += fmt::format("; did you mean {}?", Joined(near, " or "));
  } else if (!others.empty()) {
    text += fmt::format("; it is one of {}", Joined(others, ", "));
  }
  return text;
}

/// CLI11 names a checked value by its type and its check, "INT:INT in [1 - 9]": the check says
/// both.
std::string WithoutDoubledTypes(const std::string& text) {
  const std::string single =
      WithReplaced(text, R"(\b(?:INT|FLOAT|TEXT|PART):((?:INT in|FLOAT in|DIR\b|\{)))", "$1");
  // A flag that switches off is written there with what it sets.
  const std::string plain = WithReplaced(single, R"((--[\w-]+)\{false\})", "$1");
  // A list of choices may be longer than a line, which breaks where a space is.
  return WithReplaced(plain, R"(,(?=[\w,-]*\}))", ", ");
}

/// "--inline, --hosted".
std::string FlagNames(const std::set<CLI::Option*>& options) {
  std::vector<std::string> names;
  for (const CLI::Option* option : options) names.push_back(option->get_name());
  std::ranges::sort(names);
  return Joined(names, ", ");
}

/// An option's meaning first, then what it goes with.
class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_option_name(const CLI::Option* option, bool positional) const override {
    return WithoutDoubledTypes(CLI::Formatter::make_option_name(option, positional));
  }
  std::string make_option_opts(const CLI::Option* option) const override {
    const std::string text = CLI::Formatter::make_option_opts(option);
    return WithoutDoubledTypes(
        text.substr(0, std::min(text.find(" Needs:"), text.find(" Excludes:"))));
  }
  std::string make_option_desc(const CLI::Option* option) const override {
    std::string text = option->get_description();
    if (!option->get_needs().empty()) {
      text += fmt::format(" (goes with {})", FlagNames(option->get_needs()));
    }
    if (!option->get_excludes().empty()) {
      text += fmt::format(" (not with {})", FlagNames(option->get_excludes()));
    }
    return text;
  }
};

std::string UnknownCommand(const CLI::App& command, const std::string& name) {
  std::vector<std::string> names;
  for (const CLI::App* each : Subcommands(command)) names.push_back(each->get_name());
  return fmt::format("has no command '{}'; {}", name, Suggest(name, names));
}

}  // namespace

std::shared_ptr<CLI::FormatterBase> MakeHelpFormatter() {
  return std::make_shared<HelpFormatter>();
}

void SetExample(CLI::App* command, const std::string& example) {
  command->footer(
      "Exit code: 0 good, 1 a check or the run failed, 2 wrong usage or configuration.\n"
      "Example: " +
      example);
}

CLI::Option* AddList(CLI::App* command, const char* flag, std::vector<std::string>* to,
                     const char* text, const char* type) {
  return command->add_option(flag, *to, text)->type_name(type)->allow_extra_args(false)->take_all();
}

std::function<std::string(const std::string&)> Within(const char* range, bool (*good)(double)) {
  return [=](const std::string& text) -> std::string {
    char* end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    const bool number = !text.empty() && *end == '\0';
    return number && good(value) ? "" : fmt::format("{}: must be {}", text, range);
  };
}

std::function<std::string(const std::string&)> Whole() {
  return [](const std::string& text) -> std::string {
    uint64_t value = 0;
    const char* const end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, value);
    if (error == std::errc() && stop == end) return "";
    return fmt::format("{}: must be a whole number, 0 or more{}", text,
                       error == std::errc::result_out_of_range ? ", below 2^64" : "");
  };
}

std::string HelpText(const CLI::App& app) {
  const int width = ScreenStyle().columns;
  std::string text;
  const CLI::App& command = Named(app);
  const CLI::App* const parent = command.get_parent();
  const std::string help = command.help(parent == nullptr ? "" : FullName(*parent));
  for (size_t begin = 0; begin < help.size();) {
    const size_t end = std::min(help.find('\n', begin), help.size());
    const std::string line = help.substr(begin, end - begin);
    const bool described = line.starts_with("  ");
    text += Wrapped(line, width, described ? std::min(kDescription, width / 2) : 0) + "\n";
    begin = end + 1;
  }
  return text;
}

bool WantsSubcommand(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App& command = Named(app);
  return dynamic_cast<const CLI::RequiredError*>(&error) != nullptr &&
         command.remaining().empty() && command.get_require_subcommand_min() > 0;
}

std::string UsageProblem(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App& command = Named(app);
  const std::string name = FullName(command);
  const std::vector<std::string> extra = command.remaining();
  const std::string see = fmt::format("see {} --help", name);
  if (extra.empty()) {
    std::string what = error.what();
    const size_t colon = what.find(':');
    // CLI11 says "--out: 1 required TEXT missing".
    if (colon != std::string::npos && dynamic_cast<const CLI::ArgumentMismatch*>(&error)) {
      const bool again = what.find("At Most") != std::string::npos;
      what = fmt::format("{} {}", what.substr(0, colon),
                         again ? "may be given once" : "needs a value");
    }
    // "poise: " stands in front already: what is added is the command, as in "poise: run: ...".
    const size_t space = name.find(' ');
    const std::string command_alone =
        space == std::string::npos ? "" : name.substr(space + 1) + ": ";
    return fmt::format("{}{}; {}", command_alone, what, see);
  }
  std::string problem;
  if (extra.front().starts_with("-") && extra.front().size() > 1) {
    problem = UnknownFlag(app, command, extra.front());
  } else if (!Subcommands(command).empty()) {
    problem = UnknownCommand(command, extra.front());
  } else {
    problem = fmt::format("does not know what to do with '{}'", extra.front());
  }
  return fmt::format("{} {}{} {}", name, problem, problem.ends_with('?') ? " or" : ";", see);
}

}  // namespace poise
