#include <netinet/in.h>
#include <poll.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>

#include "components/framework/build_info.h"
#include "components/framework/bus/udp_bus.h"
#include "components/framework/configuration/configuration.h"
#include "components/framework/run.h"
#include "fmt/format.h"
#include "tools/cli/command_line.h"
#include "tools/cli/output_style.h"
#include "tools/commands/commands.h"
#include "tools/run/run_dir.h"
#include "tools/scenario/library_versions.h"
#include "tools/scenario/run_setup.h"

namespace poise {
namespace {

enum class Level { kGood, kNote, kBad };

/// A line of the doctor: what, what was found, what to do about it.
struct Finding {
  Level level = Level::kGood;
  std::string what;
  std::string found;
  std::string advice;
};

Finding CheckMulticast(const RunSpec& spec) {
  Finding finding{Level::kGood, "multicast", "", ""};
  try {
    BusReceiver receiver(ServiceUrl(spec));
    BusSender sender(ServiceUrl(spec));
    const uint8_t byte = 1;
    if (!sender.Send("DOCTOR", &byte, 1)) throw BusError("sending failed");
    pollfd fd{receiver.fd(), POLLIN, 0};
    BusReceiver::Packet packet;
    bool received = false;
    for (int i = 0; i < 20 && !received; ++i) {
      poll(&fd, 1, 50);
      while (receiver.Receive(&packet)) received = received || packet.channel == "DOCTOR";
    }
    if (!received) throw BusError("a message sent was not received");
    finding.found = fmt::format("a message to {} came back", ServiceUrl(spec));
  } catch (const std::exception& error) {
    finding.level = Level::kBad;
    finding.found = error.what();
    finding.advice = "ip link set lo up; ip route add 224.0.0.0/4 dev lo (as root)";
  }
  return finding;
}

Finding CheckPorts(RunSpec* spec) {
  try {
    const RunSource source = ChoosePorts(Scenario(), spec);
    return {Level::kGood, "ports", fmt::format("a free block at {}", spec->first_port()), ""};
  } catch (const std::exception& error) {
    return {Level::kBad, "ports", error.what(), "see what holds them: ss -ulpn"};
  }
}

Finding CheckBuffers() {
  long bytes = 0;
  std::ifstream("/proc/sys/net/core/rmem_max") >> bytes;
  if (bytes >= 2 << 20) {
    return {Level::kGood, "socket buffers", fmt::format("rmem_max {} bytes", bytes), ""};
  }
  return {Level::kNote, "socket buffers", fmt::format("rmem_max {} bytes", bytes),
          "lost messages are asked for again, at a cost; fewer with: "
          "sysctl -w net.core.rmem_max=4194304"};
}

Finding CheckScheduler() {
  // A child tries it: this process keeps its scheduling.
  const pid_t child = fork();
  if (child == 0) {
    sched_param parameter{};
    parameter.sched_priority = 50;
    _exit(sched_setscheduler(0, SCHED_FIFO, &parameter) == 0 ? 0 : 1);
  }
  int status = 0;
  waitpid(child, &status, 0);
  if (child > 0 && WIFEXITED(status) && WEXITSTATUS(status) == 0) {
    return {Level::kGood, "SCHED_FIFO", "granted", ""};
  }
  return {Level::kNote, "SCHED_FIFO", "not granted",
          "needed for real time only: rtprio in /etc/security/limits.conf, or CAP_SYS_NICE"};
}

Finding CheckMemoryLock() {
  rlimit limit{};
  getrlimit(RLIMIT_MEMLOCK, &limit);
  if (geteuid() == 0 || limit.rlim_cur == RLIM_INFINITY) {
    return {Level::kGood, "locked memory", "unlimited", ""};
  }
  return {Level::kNote, "locked memory", fmt::format("{} KB", limit.rlim_cur / 1024),
          "needed for real time only: memlock in /etc/security/limits.conf"};
}

Finding CheckKernel() {
  int realtime = 0;
  std::ifstream("/sys/kernel/realtime") >> realtime;
  const unsigned cores = std::thread::hardware_concurrency();
  if (realtime == 1) {
    return {Level::kGood, "kernel", fmt::format("PREEMPT_RT, {} cores", cores), ""};
  }
  return {Level::kNote, "kernel", fmt::format("not PREEMPT_RT, {} cores", cores),
          "good for simulation; for real time: apt-get install linux-image-rt-amd64"};
}

Finding CheckTool(const char* tool, const char* use, const char* package) {
  const char* const path = std::getenv("PATH");
  std::istringstream folders(path != nullptr ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    const std::string file = folder + "/" + tool;
    if (access(file.c_str(), X_OK) == 0) return {Level::kGood, tool, file, ""};
  }
  return {Level::kNote, tool, fmt::format("not found ({})", use),
          fmt::format("apt-get install {}", package)};
}

Finding CheckFile(const char* file, const char* use, const char* package) {
  const std::string name = std::filesystem::path(file).filename().string();
  if (access(file, R_OK) == 0) return {Level::kGood, name, file, ""};
  return {Level::kNote, name, fmt::format("not found ({})", use),
          fmt::format("apt-get install {}", package)};
}

Finding CheckDisk() {
  std::error_code error;
  const auto space = std::filesystem::space(RunsDir().parent_path(), error);
  if (error) return {Level::kNote, "disk", error.message(), "choose another folder with --out"};
  const double gigabytes = static_cast<double>(space.available) * 1e-9;
  const std::string found = fmt::format("{:.1f} GB for runs", gigabytes);
  if (gigabytes >= 1) return {Level::kGood, "disk", found, ""};
  return {Level::kNote, "disk", found, "a run logs about 3 MB per simulated second"};
}

int Doctor() {
  RunSpec spec;
  spec.set_run_id(getpid());
  std::vector<Finding> findings;
  findings.push_back({Level::kGood, "versions",
                      fmt::format("poise {}, {}", PoiseVersion(), LibraryVersions().front()), ""});
  findings.push_back(CheckPorts(&spec));
  if (spec.first_port() > 0) findings.push_back(CheckMulticast(spec));
  findings.push_back(CheckBuffers());
  findings.push_back(CheckDisk());
  findings.push_back(CheckTool("lcm-logger", "to log elsewhere", "liblcm-bin"));
  findings.push_back(CheckTool("java", "for deploy/spy, which installs it", "default-jre"));
  findings.push_back(CheckFile("/usr/share/java/jchart2d.jar", "for deploy/spy, which installs it",
                               "libjchart2d-java"));
  findings.push_back(CheckScheduler());
  findings.push_back(CheckMemoryLock());
  findings.push_back(CheckKernel());
  bool bad = false;
  for (const Finding& finding : findings) {
    const char* const mark = finding.level == Level::kGood   ? "ok  "
                             : finding.level == Level::kNote ? "note"
                                                             : "BAD ";
    fmt::print("{}", ScreenLines(22, "{}  {:<15} {}{}{}", mark, finding.what, finding.found,
                                 finding.advice.empty() ? "" : "; ", finding.advice));
    bad = bad || finding.level == Level::kBad;
  }
  return bad ? kExitFailed : kExitOk;
}

}  // namespace

void AddDoctorCommand(CLI::App* app, Command* command) {
  CLI::App* const doctor = AddCommand(
      app, command, "doctor", "check network and privileges of this machine, with advice", Doctor);
  SetExample(doctor, "poise doctor");
}

}  // namespace poise
