// `poise limit`: the largest survivable value of a field, for each point of a grid.

#include "fmt/format.h"
#include "tools/charts/sweep_output.h"
#include "tools/commands/commands.h"
#include "tools/sweep/sweep_session.h"

namespace poise {
namespace {

int RunLimit(const SweepOptions& given) {
  const SessionOptions& options = given.session;
  const SweepDefinition definition(given.arguments, /*limit=*/true);
  const Limit& limit = definition.sweep().limit();
  const auto [first, end] = SelectedRuns(options, definition.points().size());
  SweepSession session(definition, kKindLimit, options);
  fmt::print("{}: the largest {} of {} to {} at {} point{}{}, {} runs at a time; {}\n",
             definition.name(), NameOf(limit), limit.min(), limit.max(), end - first,
             end - first == 1 ? "" : "s",
             session.found() > 0 ? fmt::format(", {} runs done before", session.found()) : "",
             options.jobs, session.folder().string());
  const bool complete = RunLimits(PointRange(first, end), &session);
  if (!complete) {
    fmt::print(stderr, "poise: interrupted after {} runs; --resume --out {} goes on\n",
               session.rows().size(), session.folder().string());
    return kExitFailed;
  }
  return Deliver(session.folder(), session.header(), session.rows()) ? kExitOk : kExitFailed;
}

}  // namespace

void AddLimitCommand(CLI::App* app, Command* command) {
  const auto [limit, options] = AddCommand<SweepOptions>(
      app, command, "limit",
      "find the largest survivable value of a field, for each point of a grid", RunLimit);
  AddSweepOptions(limit, options);
  Limit* const given = &options->arguments.limit.emplace();
  const auto number = [app = limit, given](const char* flag, void (Limit::*set)(double),
                                           const char* text) {
    app->add_option_function<double>(
        flag, [given, set](double v) { (given->*set)(v); }, text);
  };
  const auto word = [app = limit, given](const char* flag, const char* text, auto set) {
    app->add_option_function<std::string>(
        flag, [given, set](const std::string& v) { set(given, v); }, text);
  };
  word("--field", "the scenario's field whose limit is sought; replaces the file's",
       [](Limit* l, const std::string& v) { l->set_field(v); });
  word("--name", "its name, for --expression",
       [](Limit* l, const std::string& v) { l->set_name(v); });
  word("--unit", "its unit, for tables", [](Limit* l, const std::string& v) { l->set_unit(v); });
  number("--min", &Limit::set_min, "smallest value tried");
  number("--max", &Limit::set_max, "largest value tried");
  number("--tolerance", &Limit::set_tolerance,
         "at which a boundary is known well enough; default: 1/200 of max - min");
  limit->add_option_function<int>(
      "--samples", [given](int v) { given->set_samples(v); },
      "values from min to max that are tried before bisection; default: 9");
  limit->footer(
      "Survival need not be monotone: first --samples values are tried, then the lowest boundary "
      "at which survival ends is bisected, and the highest one if something above it survived. "
      "limits.csv has for each point: the limit (the largest value below which all that was tried "
      "survived), fails_at, largest_survived, monotone; for a scenario with one push, also its "
      "impulse and, with the share reached, what a linear inverted pendulum stands of it and what "
      "one step catches: docs/reference/sweeps.md has the formulas.\n"
      "poise sweep merge joins the folders of --range or --part. Exit code: as poise sweep.\n"
      "Example: poise limit push_double_support --field 'sim.push[0].peak' --min 150 --max 350");
}

}  // namespace poise
