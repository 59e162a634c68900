#include <filesystem>

#include "components/framework/configuration/configuration.h"
#include "fmt/format.h"
#include "tools/cli/command_line.h"
#include "tools/cli/lists.h"
#include "tools/cli/output_place.h"
#include "tools/cli/output_style.h"
#include "tools/cli/text_table.h"
#include "tools/commands/commands.h"
#include "tools/robot_import/robot_import.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

struct ImportArguments {
  ImportOptions options;
  std::string to;
  std::vector<double> sole;
  std::vector<std::string> meshes;
  bool force = false;
};

constexpr Tone kTones[] = {Tone::kGood, Tone::kPlain, Tone::kBad};  // by Sureness

/// A robot's folder holds one text: with two nobody could say which --robot FOLDER means.
void CheckOneText(const fs::path& folder, const fs::path& text) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (entry.path().extension() != ".pbtxt" || entry.path().filename() == text.filename())
      continue;
    throw ConfigError(
        fmt::format("--to {}: holds the robot's text {} already; give another folder, or --force "
                    "to have both there",
                    folder.string(), entry.path().filename().string()));
  }
}

/// Puts the maker's file into the folder, untouched.
void CopyFile(const fs::path& from, const fs::path& to) {
  std::error_code error, ignored;
  if (fs::equivalent(from, to, error)) return;
  const bool is_new = !fs::exists(to, ignored);
  fs::copy_file(from, to, fs::copy_options::overwrite_existing, error);
  if (error) {
    if (is_new) fs::remove(to, ignored);
    throw ConfigError(
        fmt::format("{}: cannot be copied to {}: {}", from.string(), to.string(), error.message()));
  }
}

int ImportIt(ImportArguments arguments) {
  ImportOptions& options = arguments.options;
  if (!arguments.sole.empty()) options.sole = {arguments.sole.at(0), arguments.sole.at(1)};
  options.meshes.assign(arguments.meshes.begin(), arguments.meshes.end());
  RobotImport imported;
  try {
    imported = ImportRobot(options);
  } catch (const std::exception& error) {
    const std::string what = error.what();
    const bool named = what.starts_with(options.file.string()) || what.starts_with("--");
    throw ConfigError(named ? what : options.file.string() + ": " + what);
  }
  const std::string& name = imported.robot.name();
  const fs::path folder = arguments.to.empty() ? fs::path(name) : fs::path(arguments.to);
  const fs::path text = folder / (name + ".pbtxt");
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw ConfigError(fmt::format("{}: {}", folder.string(), error.message()));
  CheckFileFree("--to", text, arguments.force);
  if (!arguments.force) CheckOneText(folder, text);
  CopyFile(options.file, folder / options.file.filename());
  WriteFile(text, RobotText(imported));

  std::vector<TableRow> rows = {{"what", "value", "from", "how sure"}};
  for (const Finding& f : imported.findings) {
    rows.push_back({f.what,
                    f.value,
                    f.from,
                    {SurenessName(f.sureness), kTones[static_cast<size_t>(f.sureness)]}});
  }
  fmt::print("{}", FormatColumns(std::move(rows)));
  if (!imported.defects.empty()) {
    rows = {{fmt::format("{} defect{} of the file", imported.defects.size(),
                         imported.defects.size() == 1 ? "" : "s"),
             "what was done"}};
    for (const Defect& d : imported.defects) rows.push_back({d.what, d.done});
    fmt::print("\n{}", FormatColumns(std::move(rows)));
  }
  fmt::print(
      "\n{}: the text; {} lies beside it, untouched\n  to see it stand:  poise run stand --robot "
      "{}\n",
      text.string(), options.file.filename().string(), ShellWord(folder.string()));
  return kExitOk;
}

}  // namespace

void AddRobotImport(CLI::App* robot, Command* command) {
  const auto [app, arguments] = AddCommand<ImportArguments>(
      robot, command, "import",
      "write a folder with a maker's URDF or MJCF file and the text that Poise needs", ImportIt);
  ImportOptions* const options = &arguments->options;
  app->footer(
      "Asks nothing: what the file does not say is guessed, and told with how sure it is. Exit "
      "code: 0 written, 2 the file cannot be used, or the robot cannot balance.\nExample: poise "
      "robot import maker/robot.urdf --to my/robot");
  app->add_option("file", options->file, "URDF (xacro expanded) or MJCF")->required();
  app->add_option("--to", arguments->to,
                  "folder that is written; default: the robot's name in the current folder");
  app->add_option("--name", options->name, "of the robot; default: the file's");
  app->add_option("--srdf", options->srdf,
                  "group states, among them how it stands; default: the .srdf beside the file");
  app->add_option("--stance", options->stance,
                  "keyframe or group state in which it stands; default: one named half_sitting, "
                  "stand or home");
  app->add_option("--right-foot", options->foot[0], "link, in place of the one that is found");
  app->add_option("--left-foot", options->foot[1], "link, in place of the one that is found");
  app->add_option("--sole", arguments->sole, "length and width, m, in place of what shapes show")
      ->expected(2)
      ->type_name("LENGTH WIDTH")
      ->check(Within("in (0, 2] m", [](double m) { return m > 0 && m <= 2; }));
  AddList(app, "--meshes", &arguments->meshes,
          "folder of the maker's meshes; may be repeated; default: beside the file and "
          "above it")
      ->check(CLI::ExistingDirectory);
  app->add_option("--imu", options->imu, "link or site that carries it");
  app->add_option("--body", options->body, "link whose orientation is controlled");
  AddList(app, "--lock", &options->lock, "a joint that is to stand still; may be repeated");
  app->add_flag("--force", arguments->force, "replace a text that is there");
}

}  // namespace poise
