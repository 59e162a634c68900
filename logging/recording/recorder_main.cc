#include <sys/prctl.h>

#include <csignal>

#include "components/framework/configuration/configuration.h"
#include "components/framework/modules.h"
#include "components/framework/runners/program_options.h"
#include "components/framework/say_error.h"
#include "fmt/format.h"
#include "logging/recording/recorder.h"

namespace {

volatile std::sig_atomic_t stop_asked = 0;

void OnSignal(int) { stop_asked = 1; }

}  // namespace

int main(int argc, char** argv) {
  struct sigaction action {};
  action.sa_handler = OnSignal;
  action.sa_flags = SA_RESTART;
  sigaction(SIGTERM, &action, nullptr);
  sigaction(SIGINT, &action, nullptr);
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  std::signal(SIGXFSZ, SIG_IGN);  // a file that grows too large is an error that is told

  std::string run_file;
  std::string scenario_file;
  int socket_fd = -1;
  poise::logging::RecorderOptions options;
  options.stop = &stop_asked;
  const std::optional<int> code = poise::ParseProgram(
      argc, argv, "recorder",
      "Records a Poise run as an LCM event log. Usually started by `poise run`.",
      {{"--run", &run_file, "the run: protobuf text of poise.RunSpec", true},
       {"--log", &options.log_path, "event log to write", true},
       {"--report", &options.report_path, "counters at the end, as JSON"},
       {"--scenario", &scenario_file, "scenario text to keep in the log"},
       {"--socket", &socket_fd, "descriptor of the run's socket; default: it is asked for"},
       {"--mirror,!--no-mirror", &options.mirror, "send everything to the run's public URL"}});
  if (code) return *code;
  try {
    poise::LoadModules();  // their messages
    poise::RunSpec spec;
    poise::ReadTextProto(run_file, &spec);
    if (!scenario_file.empty()) options.scenario = poise::ReadFile(scenario_file);
    const poise::RunSocket socket =
        socket_fd < 0 ? poise::RunSocket::Ask(spec) : poise::RunSocket(spec, socket_fd);
    poise::logging::Record(spec, socket, options);
    return 0;
  } catch (const poise::ConfigError& error) {
    poise::SayError(fmt::format("recorder: {}", error.what()));
    return 2;
  } catch (const std::exception& error) {
    poise::SayError(fmt::format("recorder: {}", error.what()));
    return 1;
  }
}
