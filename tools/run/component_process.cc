#include "tools/run/component_process.h"

#include <sys/syscall.h>
#include <unistd.h>

#include <csignal>
#include <fstream>

#include "fmt/format.h"

namespace poise {
namespace {

constexpr int64_t kSecondNs = 1'000'000'000;  // ns
constexpr size_t kMostDeaths = 5;             // within kDeathWindow
constexpr int64_t kDeathWindow = 2 * kSecondNs;
constexpr int64_t kSuccessorPatience = 5 * kSecondNs;  // for a successor

}  // namespace

ComponentProcess::ComponentProcess(std::string name, std::vector<std::string> command,
                                   std::string log_path, bool restart, const RunSocket& socket,
                                   std::vector<std::string> components)
    : name_(std::move(name)),
      command_(std::move(command)),
      log_path_(std::move(log_path)),
      restart_(restart),
      socket_(socket.fd()),
      components_(std::move(components)) {
  if (components_.empty()) components_.push_back(name_);
  command_.insert(command_.end(), {"--socket", std::to_string(socket_)});
  if (restart_) {
    memory_fd_ = StateStore::MakeMemoryFile(name_);
    const std::string path = fmt::format("/proc/{}/fd/{}", getpid(), int{memory_fd_});
    store_ = std::make_unique<StateStore>(path);
    command_.insert(command_.end(), {"--state", path});
  }
  process_ = std::make_unique<ChildProcess>(name_, command_, log_path_, socket_);
  ++started_;
  Watch();
  if (restart_) StartSpare();
}

void ComponentProcess::Watch() {
  // Without this descriptor (an old kernel) a death is only seen later.
  pidfd_ = static_cast<int>(syscall(SYS_pidfd_open, process_->pid(), 0));
}

void ComponentProcess::StartSpare() {
  std::vector<std::string> command = command_;
  command.emplace_back("--standby");
  store_->set_standby(0);
  spare_ = std::make_unique<ChildProcess>(name_, command,
                                          fmt::format("{}.{}", log_path_, ++started_), socket_);
}

bool ComponentProcess::NoteDeath(int64_t now) {
  deaths_.push_back(now);
  while (now - deaths_.front() > kDeathWindow) deaths_.pop_front();
  return deaths_.size() <= kMostDeaths;
}

bool ComponentProcess::Alive(int64_t now) {
  if (restart_ && spare_ != nullptr && spare_->ended()) {
    spare_.reset();
    if (NoteDeath(now)) StartSpare();  // else there is something wrong with it
  }
  if (!process_->ended()) return true;
  if (!restart_ || spare_ == nullptr) return false;
  if (waiting_since_ == 0) {
    waiting_since_ = now;
    if (!NoteDeath(now)) return false;
  }
  if (store_->standby() != spare_->pid()) {
    return now - waiting_since_ < kSuccessorPatience + spare_->processor_time().waited;
  }
  spare_->Signal(SIGUSR2);
  process_ = std::move(spare_);
  ++takeovers_;
  waiting_since_ = 0;
  Watch();
  StartSpare();
  return true;
}

bool ComponentProcess::StandbyReady() const {
  return !restart_ || (spare_ != nullptr && store_->standby() == spare_->pid());
}

int64_t ComponentProcess::ResidentBytes() const {
  int64_t size = 0;
  int64_t resident = 0;
  std::ifstream statm(fmt::format("/proc/{}/statm", process_->pid()));
  statm >> size >> resident;
  return resident * sysconf(_SC_PAGESIZE);
}

void ComponentProcess::StopRestarts() {
  restart_ = false;
  spare_.reset();
}

}  // namespace poise
