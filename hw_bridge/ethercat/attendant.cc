#include "hw_bridge/ethercat/attendant.h"

#include <fmt/format.h>

#include <chrono>
#include <utility>

#include "hw_bridge/ethercat/distributed_clocks.h"

namespace poise::ethercat {
namespace {

// Two rounds over all slaves are this far apart: errors need only be seen while someone looks on.
constexpr int64_t kRound = 20 * kMillisecond;
constexpr int64_t kLookAgain = 2 * kMillisecond;  // at a slave that is not in OP
constexpr int kAttempts = 3;                      // frames for a datagram

}  // namespace

Attendant::Attendant(const MasterConfig* config, const SlaveSetup* setup, ClockPlan clocks,
                     const std::vector<SlaveAccess>& slaves, const Timeouts& timeouts,
                     bool lockstep, Say say)
    : config_(config),
      setup_(setup),
      clocks_(std::move(clocks)),
      lockstep_(lockstep),
      say_(std::move(say)),
      transactions_(&slot_, timeouts.state, kAttempts),
      complaints_(slaves.size()) {
  for (const SlaveAccess& slave : slaves) {
    slaves_.push_back(slave.Through(&transactions_));
    diagnoses_.emplace_back().al = {.status = static_cast<uint8_t>(AlState::kOp)};
  }
  thread_ = std::thread([this] { Run(); });
}

Attendant::~Attendant() {
  while (!ended_) {
    slot_.Close();
    std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
  thread_.join();
}

void Attendant::BeginCycle(int64_t now, bool trouble) {
  if (trouble) trouble_.store(true, std::memory_order_relaxed);
  slot_.Advance(now);
  if (lockstep_) slot_.Settle();
}

void Attendant::Complain(size_t slave, const std::string& line) {
  if (complaints_[slave] == line) return;  // once, until it is back
  complaints_[slave] = line;
  if (say_) say_(line);
}

void Attendant::Run() {
  std::array<uint8_t, 1> none;
  for (int turn = 0; !slot_.closed(); ++turn) {
    const bool trouble = trouble_.exchange(false);
    for (size_t i = 0; i < slaves_.size() && !slot_.closed(); ++i) {
      // Details can wait while slaves are to be led back.
      LookAt(i, trouble ? -1 : turn);
    }
    const int64_t pause = trouble ? kLookAgain : kRound;
    static_cast<void>(slot_.Receive(none, slot_.Now() + pause));
  }
  slot_.Finish();
  ended_ = true;
}

void Attendant::LookAt(size_t slave, int turn) {
  try {
    if (!NoteState(slave)) {
      Recover(slave);
    } else if (turn >= 0) {
      NoteDetails(slave, turn);
    }
  } catch (const EthercatError& error) {
    if (!slot_.closed()) Complain(slave, error.what());
  }
}

bool Attendant::NoteState(size_t slave) {
  SlaveDiagnosis& shown = diagnoses_[slave];
  std::array<uint8_t, 6> bytes{};
  const auto counter =
      transactions_.Execute(Command::kFprd, slaves_[slave].station(), reg::kAlStatus, bytes, 1);
  shown.online = counter && *counter == 1;
  if (shown.online) shown.al = {.status = bytes[0], .code = Get<uint16_t>(bytes, 4)};
  const bool operational = shown.online && bytes[0] == static_cast<uint8_t>(AlState::kOp);
  if (operational) complaints_[slave].clear();
  return operational;
}

void Attendant::NoteDetails(size_t slave, int turn) {
  SlaveDiagnosis& shown = diagnoses_[slave];
  SlaveAccess& access = slaves_[slave];
  // One of them a round.
  switch (turn % 4) {
    case 0: {
      std::array<uint8_t, 20> errors{};  // 0x0300 to 0x0313
      access.Read(reg::kReceiveErrors, errors);
      int32_t received = 0, lost = 0;
      for (size_t i = 0; i < 8; ++i) received += errors[i];
      for (size_t i = reg::kLostLinks - reg::kReceiveErrors; i < errors.size(); ++i) {
        lost += errors[i];
      }
      shown.receive_errors = received;
      shown.lost_links = lost;
      return;
    }
    case 1:
      if (clocks_.running && clocks_.has_clock[slave]) {
        shown.clock_difference = DcDifference(access.Read<uint32_t>(reg::kDcDifference));
      }
      return;
    case 2:
      access.PollMailbox();
      break;
    default:
      if (setup_->slave(slave).drive == nullptr) return;
      shown.error_code = static_cast<uint16_t>(access.Upload({object::kErrorCode, 0}));
  }
  shown.emergencies = access.emergencies();
  shown.emergency = access.last_emergency().code;
}

void Attendant::Recover(size_t slave) {
  SlaveAccess& access = slaves_[slave];
  SlaveDiagnosis& shown = diagnoses_[slave];
  if (!shown.online) {
    // Its configured address is gone with its power; its place is not.
    const std::optional<uint16_t> station = access.FindStation();
    if (!station) {
      Complain(slave, fmt::format("{}: does not answer; cable or power", access.Describe()));
      return;
    }
    if (*station != 0) return;  // another one's place: the chain is cut before it
    Complain(slave, fmt::format("{}: has started anew; it is led back", access.Describe()));
    Rejoin(slave);
  } else {
    const SlaveAccess::AlStatus status = access.ReadAlStatus();
    Complain(slave, fmt::format("{}: is in {}; it is led back to OP", access.Describe(),
                                SlaveAccess::Text(status)));
    if (status.state == AlState::kSafeOp) {
      RestoreClock(slave);
      access.ChangeState(AlState::kOp);
    } else if (status.state != AlState::kOp || status.error) {
      Rejoin(slave);
    }
  }
  if (!NoteState(slave)) return;
  ++shown.recoveries;
  if (say_) say_(fmt::format("{}: is in OP again", access.Describe()));
}

void Attendant::RestoreClock(size_t slave) {
  if (!clocks_.running || !clocks_.has_clock[slave] || slave == clocks_.reference) return;
  SlaveAccess& access = slaves_[slave];
  const int32_t difference = DcDifference(access.Read<uint32_t>(reg::kDcDifference));
  if (std::abs(int64_t{difference}) <= config_->clock_tolerance()) return;
  StartClock(slave);
}

void Attendant::StartClock(size_t slave) {
  SlaveAccess& access = slaves_[slave];
  access.Write<uint8_t>(reg::kDcActivation, 0);
  // The reference itself takes the time from one that has kept it.
  for (size_t other = 0; other < slaves_.size(); ++other) {
    const size_t from = (clocks_.reference + other) % slaves_.size();
    if (from == slave || !clocks_.has_clock[from]) continue;
    try {
      JoinClock(&transactions_, &slaves_[from], &access,
                clocks_.delays[slave] - clocks_.delays[from]);
      break;
    } catch (const EthercatError& error) {
      Complain(from, error.what());  // it has no time to give; another may
    }
  }
  StartSync0(&access, config_->cycle());
}

void Attendant::Rejoin(size_t slave) {
  SlaveAccess& access = slaves_[slave];
  static_cast<void>(access.AssignStation());
  access.RequestState(AlState::kInit);
  access.AwaitInit();
  constexpr std::array<uint8_t, kNumFmmus * kFmmuSize> kZeros{};
  if (clocks_.has_clock[slave]) access.Write<uint8_t>(reg::kDcActivation, 0);
  for (const auto& [address, size] : {std::pair<uint16_t, size_t>{reg::kFmmu, 2 * kFmmuSize},
                                      {reg::kSyncManager, 4 * kSyncManagerSize}}) {
    access.Write(address, std::span(kZeros).first(size));
  }
  setup_->Check(slave, &access);
  setup_->Configure(slave, &access);
  if (clocks_.running && clocks_.has_clock[slave]) StartClock(slave);
  access.ChangeState(AlState::kSafeOp);
  access.ChangeState(AlState::kOp);
}

}  // namespace poise::ethercat
