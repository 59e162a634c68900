#include <filesystem>
#include <nlohmann/json.hpp>

#include "components/framework/configuration/configuration.h"
#include "components/robot_files/robot_files.h"
#include "fmt/format.h"
#include "tools/cli/command_line.h"
#include "tools/cli/output_style.h"
#include "tools/cli/text_table.h"
#include "tools/commands/commands.h"
#include "tools/report/html_report.h"
#include "tools/report/run_screen.h"
#include "tools/robot/robot_check.h"
#include "tools/scenario/catalog.h"

namespace poise {
namespace {

namespace fs = std::filesystem;

struct CheckOptions {
  std::string robot, page;
  std::vector<std::string> meshes;
  bool json = false;
};

int CheckOneRobot(const CheckOptions& options) {
  const RobotCheck check = CheckRobot(FindFile("robots", options.robot, fs::current_path()));
  if (options.json) {
    KeepUnicode();
    fmt::print("{}\n", RobotCheckJson(check).dump(2));
  } else {
    fmt::print("{}", FormatRobotCheck(check, ScreenStyle().columns));
  }
  if (!options.page.empty()) {
    const RobotDrawing drawing =
        DrawRobot(check.model, ReadFile(check.maker_file),
                  {check.maker_file, "", {options.meshes.begin(), options.meshes.end()}});
    WriteRobotPage(options.page, check, drawing);
    if (options.json) return check.ok() ? kExitOk : kExitFailed;
    fmt::print("\nThe robot in 3D: {}\n", FileAddress(options.page));
    if (const std::string instead = WhatIsDrawnInstead(drawing); !instead.empty()) {
      fmt::print("{}", ScreenLines(0, "{}", instead + " --meshes FOLDER says where they lie."));
    }
  }
  return check.ok() ? kExitOk : kExitFailed;
}

int ListRobots() {
  std::vector<TableRow> rows{{"robot", "joints", "mass", "soles"}};
  for (const std::string& name : ListNames("robots")) {
    try {
      const robot::RobotModel model = robot::LoadRobotFiles(InstalledFile("robots", name).string());
      const bool rectangles = model.feet()[0].rectangular() && model.feet()[1].rectangular();
      rows.push_back({name, std::to_string(model.num_joints()),
                      FormatNumber(model.total_mass(), "kg"),
                      rectangles ? "rectangles" : "polygons"});
    } catch (const robot::RobotError& error) {
      rows.push_back({name, "", "", TableCell(error.what(), Tone::kBad)});
    }
  }
  fmt::print("{}", FormatColumns(rows));
  return kExitOk;  // a maker's file that is not here is no failure of a list
}

}  // namespace

void AddRobotCommand(CLI::App* app, Command* command) {
  CLI::App* const robot = AddGroup(app, "robot", "bring a robot of your own, and look at robots");
  AddRobotImport(robot, command);
  const auto [check, options] = AddCommand<CheckOptions>(
      robot, command, "check",
      "what a robot is and can do, and what is wrong with its files; takes seconds", CheckOneRobot);
  check
      ->add_option("robot", options->robot,
                   "a name (poise robot list), a robot's folder or its .pbtxt file")
      ->required();
  check->add_flag("--json", options->json, "everything in SI units, for programs");
  check->add_option("--page", options->page, "write the robot in 3D to this file")
      ->type_name("FILE");
  AddList(check, "--meshes", &options->meshes,
          "folder of the maker's meshes, for the page; may be repeated; default: beside "
          "the maker's file and above it")
      ->check(CLI::ExistingDirectory);
  check->footer("Example: poise robot check heron/heron --page heron.html");
  CLI::App* const list =
      AddCommand(robot, command, "list", "the robots that there are", ListRobots);
  SetExample(list, "poise robot list");
}

}  // namespace poise
