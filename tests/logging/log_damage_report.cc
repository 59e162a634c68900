// Damages a log many times and prints what Poise's reader and liblcm's recover of it.
#include <CLI/CLI.hpp>
#include <filesystem>

#include "fmt/format.h"
#include "tests/logging/damage_trial.h"
#include "tests/logging/small_log.h"

int main(int argc, char** argv) {
  using namespace poise::logging;
  CLI::App app{
      "Damages a log at random, many times, and prints the records that Poise's reader and "
      "liblcm's "
      "recover of it. Exit code 1 when Poise's misses an undamaged one.",
      "log_damage_report"};
  std::string log;
  int trials = 1000;
  size_t bytes = 1000;
  unsigned seed = 1;
  app.add_option("log", log, "log of a run; default: a made one of 20,002 events");
  app.add_option("--trials", trials, "of each kind")->check(CLI::Range(1, 1'000'000));
  app.add_option("--bytes", bytes, "overwritten a trial")->check(CLI::Range(1, 1'000'000));
  app.add_option("--seed", seed, "of the damage")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  try {
    const TemporaryFolder folder;
    const std::string path = folder.path("log");
    if (log.empty()) WriteRawLog(path, SmallLog(10'000));
    const std::string whole = ReadBytes(log.empty() ? path : log);
    if (whole.empty()) throw std::runtime_error(log + ": cannot be read, or is empty");
    std::mt19937 random(seed);
    fmt::print("{:<22} {:>7} {:>12} {:>12} {:>12} {:>15}\n", "damage", "trials", "undamaged",
               "by poise", "by liblcm", "liblcm crashes");
    bool all = true;
    for (const bool cut : {true, false}) {
      DamageTrial sum;
      int crashes = 0;
      for (int i = 0; i < trials; ++i) {
        const DamageTrial trial = TryDamage(
            whole, cut ? CutAnywhere(whole, &random) : Overwrite(whole, bytes, &random), path);
        sum.undamaged += trial.undamaged;
        sum.by_poise += trial.by_poise;
        sum.by_liblcm += trial.by_liblcm;
        crashes += trial.liblcm_crashed ? 1 : 0;
      }
      fmt::print("{:<22} {:>7} {:>12} {:>12} {:>12} {:>15}\n",
                 cut ? std::string("cut anywhere") : fmt::format("{} bytes overwritten", bytes),
                 trials, sum.undamaged, sum.by_poise, sum.by_liblcm, crashes);
      all = all && sum.by_poise == sum.undamaged;
    }
    return all ? 0 : 1;
  } catch (const std::exception& error) {
    fmt::print(stderr, "log_damage_report: {}\n", error.what());
    return 1;
  }
}
