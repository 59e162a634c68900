// `poise shell`: what a shell and man need to know of the command line, made of its own option
// tables.
#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include "components/framework/build_info.h"
#include "fmt/format.h"
#include "tools/cli/command_line.h"
#include "tools/commands/commands.h"
#include "tools/scenario/catalog.h"

namespace poise {
namespace {

std::vector<const CLI::App*> CommandsOf(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App* each) { return !each->get_name().empty(); });
}

/// "-f", "--flag" of an option that has such names.
std::vector<std::string> FlagsOf(const CLI::Option& option) {
  std::vector<std::string> flags;
  for (const std::string& name : option.get_snames()) flags.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) flags.push_back("--" + name);
  return flags;
}

/// The options that --help shows.
std::vector<const CLI::Option*> OptionsOf(const CLI::App& app) {
  return app.get_options([](const CLI::Option* each) { return !each->get_group().empty(); });
}

bool TakesValue(const CLI::Option& option) { return option.get_items_expected_max() > 0; }

/// What a value or positional is a name of, "scenarios"; empty: a file, or nothing known.
std::string KindOf(const CLI::Option& option) {
  const std::string& name = option.get_single_name();
  for (const char* kind : {"scenario", "robot", "sweep", "graph"}) {
    if (name == kind) return std::string(kind) + "s";
  }
  return {};
}

/// Calls visit(path, app) for `app` ("") and all commands below it ("log export").
void ForEachCommand(const CLI::App& app, const std::string& path,
                    const std::function<void(const std::string&, const CLI::App&)>& visit) {
  visit(path, app);
  for (const CLI::App* command : CommandsOf(app)) {
    ForEachCommand(*command, path + (path.empty() ? "" : " ") + command->get_name(), visit);
  }
}

/// Text for man, which reads nothing of it as a request or an escape.
std::string Roff(const std::string& text) {
  std::string result;
  bool begin = true;
  for (const char c : text) {
    if (begin && (c == '.' || c == '\'')) result += "\\&";
    begin = c == '\n';
    if (c == '\\') {
      result += "\\e";
    } else if (c == '-') {
      result += "\\-";
    } else {
      result += c;
    }
  }
  return result;
}

/// Text in a shell's single quotes.
std::string Quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : text) {
    if (c == '\'') {
      result += "'\\''";
    } else {
      result += c == '\n' ? ' ' : c;
    }
  }
  return result + "'";
}

/// One line, for a menu.
std::string Short(const std::string& text) {
  std::string line = text.substr(0, text.find_first_of("\n;"));
  constexpr size_t kMost = 90;
  if (line.size() > kMost) line = line.substr(0, line.rfind(' ', kMost)) + " ...";
  return line;
}

void AppendOptions(const CLI::App& app, std::string* text) {
  for (const CLI::Option* option : OptionsOf(app)) {
    const std::vector<std::string> flags = FlagsOf(*option);
    std::string head;
    for (const std::string& flag : flags) {
      head += fmt::format("{}\\fB{}\\fR", head.empty() ? "" : ", ", Roff(flag));
    }
    if (flags.empty()) head = fmt::format("\\fI{}\\fR", Roff(option->get_single_name()));
    if (!flags.empty() && TakesValue(*option)) {
      const std::string type = option->get_type_name();
      head += fmt::format(" \\fI{}\\fR", Roff(type.empty() ? "VALUE" : type));
    }
    *text += fmt::format(".TP\n{}\n{}\n", head, Roff(option->get_description()));
  }
}

/// The manual page of `app` with all its commands, in man's own language. `version` stands below.
std::string ManPage(const CLI::App& app, const std::string& version) {
  const std::string& name = app.get_name();
  std::string title = name;
  std::ranges::transform(title, title.begin(), [](char c) {
    return static_cast<char>(c >= 'a' && c <= 'z' ? c - 32 : c);
  });
  std::string text = fmt::format(
      ".TH {} 1 \"\" \"{}\" \"User Commands\"\n.SH NAME\n{} \\- {}\n.SH SYNOPSIS\n.B {}\n"
      "\\fICOMMAND\\fR [\\fIOPTIONS\\fR]\n.SH OPTIONS\n",
      title, Roff(version), name, Roff(app.get_description()), name);
  AppendOptions(app, &text);
  text += ".SH COMMANDS\n";
  for (const CLI::App* command : CommandsOf(app)) {
    ForEachCommand(
        *command, command->get_name(), [&](const std::string& path, const CLI::App& each) {
          text += fmt::format(".SS {} {}\n{}\n", name, Roff(path), Roff(each.get_description()));
          AppendOptions(each, &text);
          if (!each.get_footer().empty()) {
            text += fmt::format(".PP\n{}\n", Roff(each.get_footer()));
          }
        });
  }
  text +=
      ".SH EXIT STATUS\n0: good. 1: a check or the run failed. 2: wrong usage or configuration. 3, "
      "in real time: nothing failed but that processes were lost and replaced or the machine was "
      "late.\n"
      ".SH ENVIRONMENT\n"
      ".TP\n.B POISE_PATH\nFolders with modules, programs, scenarios and robots of one's own, "
      "parted "
      "by colons.\n"
      ".TP\n.B POISE_RUNS_DIR\nWhere runs without \\-\\-out go. Without it: runs/ in the current "
      "folder, or where that cannot be written, poise/runs in XDG_STATE_HOME (~/.local/state).\n"
      ".TP\n.B POISE_DEPLOY_DIR\nPoise's own files, in place of share/poise.\n";
  return text;
}

/// Completion of commands, flags, values of flags that take one of a few, names of scenarios and
/// robots (asked for with `poise shell names KIND`), and files; so the two below.
std::string BashCompletion(const CLI::App& app) {
  std::string cases, kinds;
  ForEachCommand(app, "", [&](const std::string& path, const CLI::App& each) {
    std::vector<std::string> words;
    for (const CLI::App* command : CommandsOf(each)) words.push_back(command->get_name());
    for (const CLI::Option* option : OptionsOf(each)) {
      const std::vector<std::string> flags = FlagsOf(*option);
      words.insert(words.end(), flags.begin(), flags.end());
      const std::string kind = KindOf(*option);
      if (kind.empty()) continue;
      for (const std::string& flag : flags) {
        kinds += fmt::format("    '{}|{}') kind={} ;;\n", path, flag, kind);
      }
      if (flags.empty()) kinds += fmt::format("    '{}|') kind={} ;;\n", path, kind);
    }
    cases += fmt::format("    '{}') words='{}' ;;\n", path, fmt::join(words, " "));
  });
  return fmt::format(R"sh(# bash completion of poise, written by `poise shell bash`.
_poise_words() {{
  case "$1" in
{}    *) return 1 ;;
  esac
}}
_poise_kind() {{
  kind=
  case "$1|$2" in
{}  esac
}}
_poise() {{
  local current=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD-1]}} path= words= kind= word i
  for ((i = 1; i < COMP_CWORD; ++i)); do
    word="${{path:+$path }}${{COMP_WORDS[i]}}"
    _poise_words "$word" && path=$word
  done
  _poise_words "$path"
  case "$before" in
    -*) _poise_kind "$path" "$before" ;;
  esac
  [ -n "$kind" ] || [[ "$current" == -* ]] || _poise_kind "$path" ""
  [ -z "$kind" ] || words+=" $(poise shell names "$kind" 2>/dev/null)"
  mapfile -t COMPREPLY < <(compgen -W "$words" -- "$current")
  [ ${{#COMPREPLY[@]}} -gt 0 ] || mapfile -t COMPREPLY < <(compgen -f -- "$current")
}}
complete -o filenames -F _poise poise
)sh",
                     cases, kinds);
}

std::string ZshCompletion(const CLI::App& app) {
  std::string cases;
  ForEachCommand(app, "", [&](const std::string& path, const CLI::App& each) {
    std::string commands, flags, names;
    for (const CLI::App* command : CommandsOf(each)) {
      commands +=
          fmt::format(" {}", Quoted(command->get_name() + ":" + Short(command->get_description())));
    }
    for (const CLI::Option* option : OptionsOf(each)) {
      for (const std::string& flag : FlagsOf(*option)) {
        flags += fmt::format(" {}", Quoted(flag + ":" + Short(option->get_description())));
      }
      const std::string kind = KindOf(*option);
      if (!kind.empty()) names += " " + kind;
    }
    cases += fmt::format("    '{}') commands=({}) flags=({}) kinds=({}) ;;\n", path, commands,
                         flags, names);
  });
  return fmt::format(R"sh(#compdef poise
# zsh completion of poise, written by `poise shell zsh`.
_poise_table() {{
  case "$1" in
{}    *) return 1 ;;
  esac
}}
_poise() {{
  local -a commands flags kinds names
  local path_so_far= word i kind
  for ((i = 2; i < CURRENT; ++i)); do
    word="${{path_so_far:+$path_so_far }}${{words[i]}}"
    _poise_table "$word" && path_so_far=$word
  done
  _poise_table "$path_so_far"
  if [[ "${{words[CURRENT]}}" == -* ]]; then
    _describe 'option' flags
    return
  fi
  (( ${{#commands}} )) && _describe 'command' commands
  for kind in $kinds; do
    names=(${{(f)"$(poise shell names $kind 2>/dev/null)"}})
    compadd -a names
  done
  _files
}}
_poise "$@"
)sh",
                     cases);
}

std::string FishCompletion(const CLI::App& app) {
  std::string text =
      "# fish completion of poise, written by `poise shell fish`.\n"
      "function __poise_at\n"
      "  set -l words (string match -v -- '-*' (commandline -opc))\n"
      "  set -l given (string join ' ' $words[2..-1])\n"
      "  test \"$given\" = \"$argv[1]\"; or string match -q -- \"$argv[1] *\" \"$given\"\n"
      "end\n";
  ForEachCommand(app, "", [&](const std::string& path, const CLI::App& each) {
    const std::string when = path.empty() && CommandsOf(each).size() > 0
                                 ? "__fish_use_subcommand"
                                 : fmt::format("__poise_at \"{}\"", path);
    for (const CLI::App* command : CommandsOf(each)) {
      text += fmt::format("complete -c poise -f -n {} -a {} -d {}\n", Quoted(when),
                          command->get_name(), Quoted(Short(command->get_description())));
    }
    for (const CLI::Option* option : OptionsOf(each)) {
      const std::string kind = KindOf(*option);
      const std::string names =
          kind.empty() ? "" : fmt::format(" -a '(poise shell names {} 2>/dev/null)'", kind);
      if (FlagsOf(*option).empty()) {
        if (!kind.empty()) text += fmt::format("complete -c poise -n {}{}\n", Quoted(when), names);
        continue;
      }
      text += fmt::format("complete -c poise -n {}", Quoted(when));
      for (const std::string& name : option->get_snames()) text += fmt::format(" -s {}", name);
      for (const std::string& name : option->get_lnames()) text += fmt::format(" -l {}", name);
      if (TakesValue(*option)) text += " -r" + names;
      text += fmt::format(" -d {}\n", Quoted(Short(option->get_description())));
    }
  });
  return text;
}

int PrintNames(const std::string& kind) {
  for (const std::string& name : ListNames(kind)) fmt::print("{}\n", name);
  return kExitOk;
}

}  // namespace

void AddShellCommand(CLI::App* app, Command* command) {
  CLI::App* const shell =
      AddGroup(app, "shell", "print the manual page, or completion for a shell");
  const auto add = [&](const char* name, const char* description, const std::string& example,
                       std::function<std::string(const CLI::App&)> text) {
    const Command print = [app, text = std::move(text)] {
      fmt::print("{}", text(*app));
      return kExitOk;
    };
    SetExample(AddCommand(shell, command, name, description, print),
               fmt::format("poise shell {} {}", name, example));
  };
  add("man", "the manual page", "| man -l -",
      [](const CLI::App& root) { return ManPage(root, fmt::format("poise {}", PoiseVersion())); });
  add("bash", "completion: source <(poise shell bash)", "> poise.bash", BashCompletion);
  add("zsh", "completion, for a folder of $fpath", "> _poise", ZshCompletion);
  add("fish", "completion", "| source", FishCompletion);

  const auto [names, kind] = AddCommand<std::string>(
      shell, command, "names", "what there is of a kind, a line each", PrintNames);
  names->add_option("kind", *kind, "scenarios, robots, graphs, sweeps or drives")
      ->required()
      ->check(CLI::IsMember({"scenarios", "robots", "graphs", "sweeps", "drives"}));
  SetExample(names, "poise shell names scenarios");
}

}  // namespace poise
