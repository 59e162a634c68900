#include "hw_bridge/ethercat/master.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "components/framework/configuration/field_rules.h"

namespace poise::ethercat {
namespace {

constexpr uint16_t kEventMask = 0x0004;  // AL events in each datagram, as other masters set it

const MasterConfig& Checked(const MasterConfig& config) {
  CheckFields(config, "master.");
  const auto require = [](bool condition, std::string_view problem) {
    if (!condition) throw EthercatError("EtherCAT configuration: {}", problem);
  };
  const auto own_profile = [](const DriveConfig& drive) { return drive.has_profile(); };
  require(config.has_profile() ||
              std::all_of(config.drive().begin(), config.drive().end(), own_profile),
          "profile is missing: which drives are on the bus?");
  require(config.drive_size() > 0, "drive is missing: name each drive of the chain");
  return config;
}

int64_t Milliseconds(uint32_t value) { return int64_t{value} * kMillisecond; }

}  // namespace

Master::Master(Link* link, const MasterConfig& config)
    : config_(Checked(config)),
      image_(config_),
      setup_(&config_, &image_),
      transactions_(link, Milliseconds(config.frame_timeout()),
                    static_cast<int>(config.attempts())),
      timeouts_{.eeprom = Milliseconds(config.eeprom_timeout()),
                .mailbox = Milliseconds(config.mailbox_timeout()),
                .state = Milliseconds(config.state_timeout())},
      outputs_(static_cast<size_t>(config.drive_size())),
      inputs_(static_cast<size_t>(config.drive_size())),
      image_bytes_(image_.size(), 0) {
  PlaceSlaves();
}

/// Places as the configuration counts them: those of the others first, drives on what is left.
void Master::PlaceSlaves() {
  const auto count = static_cast<int>(image_.num_slaves());
  std::vector<bool> taken(static_cast<size_t>(count), false);
  positions_.assign(static_cast<size_t>(count), -1);
  for (int i = 0; i < config_.other_size(); ++i) {
    const OtherSlave& other = config_.other(i);
    if (other.position() >= static_cast<uint32_t>(count) || taken[other.position()]) {
      throw EthercatError(
          "EtherCAT configuration: other \"{}\": position {} is taken or beyond the last of {} "
          "slaves",
          other.name(), other.position(), count);
    }
    taken[other.position()] = true;
    positions_[static_cast<size_t>(config_.drive_size() + i)] = static_cast<int>(other.position());
  }
  for (size_t i = 0, at = 0; i < num_drives(); ++i, ++at) {
    while (taken[at]) ++at;
    positions_[i] = static_cast<int>(at);
  }
  MakeSlaves();
}

void Master::MakeSlaves() {
  slaves_.clear();
  for (size_t i = 0; i < positions_.size(); ++i) {
    slaves_.emplace_back(&transactions_, timeouts_, positions_[i], setup_.slave(i).name);
  }
}

std::optional<int> Master::CountSlaves() {
  std::array<uint8_t, 2> status{};
  const auto counter = transactions_.Execute(Command::kBrd, 0, reg::kAlStatus, status);
  if (!counter) return std::nullopt;
  return *counter;
}

void Master::Start() {
  attendant_.reset();
  operational_ = clocks_.running = false;
  PlaceSlaves();
  CheckCount();
  ResetAndAddress();
  FindWiring();
  FindPositions();
  for (size_t i = 0; i < num_slaves(); ++i) {
    setup_.Check(i, &slaves_[i]);
    setup_.Configure(i, &slaves_[i]);
  }
  clocks_.has_clock.assign(num_slaves(), false);
  if (config_.distributed_clocks()) SetUpDistributedClocks();
  for (SlaveAccess& slave : slaves_) slave.ChangeState(AlState::kSafeOp);
  GoOperational();
}

void Master::CheckCount() {
  const std::optional<int> found = CountSlaves();
  if (!found) {
    throw EthercatError(
        "no frame comes back from the EtherCAT bus; is the cable in, the chain powered, the "
        "emulator running, the address right?");
  }
  if (static_cast<size_t>(*found) == num_slaves()) return;
  const auto missing = std::ranges::find(positions_, *found) - positions_.begin();
  throw EthercatError(
      "the EtherCAT bus has {} slaves, the configuration {} drives{} (the first without a slave: "
      "{}); check cables and power, or the list of drives",
      *found, num_drives(),
      config_.other_size() > 0 ? fmt::format(" and {} others", config_.other_size()) : "",
      missing < std::ssize(positions_) ? setup_.slave(static_cast<size_t>(missing)).name : "none");
}

void Master::ResetAndAddress() {
  // `value` and zeros, `size` bytes in all.
  const auto broadcast = [this](uint16_t address, uint16_t value, size_t size, bool all) {
    std::array<uint8_t, kNumFmmus * kFmmuSize> bytes{};
    Put<uint16_t>(bytes, 0, value);
    const auto counter =
        transactions_.Execute(Command::kBwr, 0, address, std::span(bytes).first(size));
    if (!counter || (all && *counter != num_slaves())) {
      throw EthercatError("writing register 0x{:04X} reached {} of {} slaves", address,
                          counter.value_or(0), num_slaves());
    }
  };
  // A slave that has not yet taken an earlier request refuses this one; AwaitInit repeats it.
  broadcast(reg::kAlControl, static_cast<uint16_t>(AlState::kInit) | kAlError, 2, false);
  // What another master, or this one before it was killed, may have left. Not all slaves have all
  // of it.
  broadcast(reg::kDcActivation, 0, 1, false);
  broadcast(reg::kDlControl, 1, 1, true);
  broadcast(reg::kLoopControl, 0, 1, true);
  broadcast(reg::kAliasControl, 0, 1, true);
  broadcast(reg::kEventMask, kEventMask, 2, false);
  broadcast(reg::kReceiveErrors, 0, 8, false);
  broadcast(reg::kLostLinks, 0, 4, false);
  broadcast(reg::kFmmu, 0, kNumFmmus * kFmmuSize, false);
  broadcast(reg::kSyncManager, 0, kNumSyncManagers * kSyncManagerSize, false);
  broadcast(reg::kEepromConfig, kEepromForce, 1, true);
  broadcast(reg::kEepromConfig, kEepromMaster, 1, true);
  for (SlaveAccess& slave : slaves_) {
    if (!slave.AssignStation())
      slave.Fail("does not take its station address; is the chain whole?");
  }
  for (SlaveAccess& slave : slaves_) slave.AwaitInit();
}

void Master::FindWiring() {
  // Until positions are known, names may be another's: the place in the chain is what counts.
  LatchClocks(&transactions_);
  std::vector<SlavePorts> ports(num_slaves());
  std::vector<std::string> names(num_slaves());
  for (size_t i = 0; i < num_slaves(); ++i) {
    const auto at = static_cast<size_t>(positions_[i]);
    names[at] = slaves_[i].Describe();
    ports[at] = slaves_[i].ReadPorts();
  }
  wiring_ =
      FindTopology(ports, [&names](int position) { return names[static_cast<size_t>(position)]; });
}

void Master::FindPositions() {
  struct Wanted {
    std::optional<uint32_t> number;
    std::string_view what;
  };
  std::vector<Wanted> wanted;
  bool all = true;
  for (size_t i = 0; i < num_slaves(); ++i) {
    const ConfiguredSlave& slave = setup_.slave(i);
    wanted.push_back({slave.identification ? slave.identification : slave.alias,
                      slave.identification ? "identification" : "station alias"});
    all = all && wanted.back().number.has_value();
  }
  const auto read = [this](SlaveAccess& slave, std::string_view what) -> std::optional<uint32_t> {
    if (what == "station alias") return slave.Read<uint16_t>(reg::kStationAlias);
    return slave.ReadIdentification();
  };
  if (!all) {
    for (size_t i = 0; i < num_slaves(); ++i) {
      if (!wanted[i].number) continue;
      const auto found = read(slaves_[i], wanted[i].what);
      if (found == wanted[i].number) continue;
      slaves_[i].Fail(
          "its {} is {}, the configuration says {}; is this the right drive at this place?",
          wanted[i].what, found ? std::to_string(*found) : "not given", *wanted[i].number);
    }
    return;
  }
  // Every slave says who it is: where it is in the chain does not matter.
  std::vector<int> places(num_slaves(), -1);
  for (size_t at = 0; at < num_slaves(); ++at) {
    SlaveAccess here(&transactions_, timeouts_, static_cast<int>(at));
    bool known = false;
    for (size_t i = 0; i < num_slaves() && !known; ++i) {
      if (places[i] >= 0 || read(here, wanted[i].what) != wanted[i].number) continue;
      places[i] = static_cast<int>(at);
      known = true;
    }
    if (known) continue;
    const auto found = read(here, wanted[0].what);
    here.Fail(
        "its {} is {}, which no slave of the configuration has (or one that was found before)",
        wanted[0].what, found ? std::to_string(*found) : "not given");
  }
  positions_ = places;
  MakeSlaves();
}

void Master::SetUpDistributedClocks() {
  std::vector<SlaveAccess*> with_clock;
  std::vector<int32_t> delays;
  clocks_.delays.assign(num_slaves(), 0);
  // In the chain's order: the first that has a clock is the reference.
  for (size_t at = 0; at < num_slaves(); ++at) {
    const auto i = static_cast<size_t>(
        std::find(positions_.begin(), positions_.end(), static_cast<int>(at)) - positions_.begin());
    clocks_.delays[i] = wiring_[at].delay;
    clocks_.has_clock[i] = slaves_[i].HasClock();
    if (!clocks_.has_clock[i]) {
      if (setup_.slave(i).drive == nullptr) continue;
      slaves_[i].Fail("has no 64-bit distributed clock; set distributed_clocks: false");
    }
    if (with_clock.empty()) clocks_.reference = i;
    with_clock.push_back(&slaves_[i]);
    delays.push_back(wiring_[at].delay);
  }
  SetUpClocks(&transactions_, with_clock, delays, Now());
  AwaitClocks();
  for (SlaveAccess* slave : with_clock) {
    StartSync0(slave, config_.cycle());
  }
  clocks_.running = true;
}

void Master::AwaitClocks() {
  const auto compensate = [this] {
    std::array<uint8_t, 8> time{};
    const auto counter = transactions_.Execute(Command::kFrmw, slaves_[clocks_.reference].station(),
                                               reg::kDcSystemTime, time);
    if (!counter) throw EthercatError("distributed clocks: no frame came back");
  };
  for (uint32_t i = 0; i < config_.drift_frames(); ++i) compensate();
  // Static drift is gone; whether the clocks agree, they say themselves.
  const int64_t deadline = Now() + timeouts_.state;
  for (size_t i = 0; i < num_slaves(); ++i) {
    if (!clocks_.has_clock[i] || i == clocks_.reference) continue;
    while (true) {
      const int32_t difference = DcDifference(slaves_[i].Read<uint32_t>(reg::kDcDifference));
      if (std::abs(int64_t{difference}) <= config_.clock_tolerance()) break;
      if (Now() > deadline) {
        slaves_[i].Fail(
            "its clock is still {} ns off the common time (register 0x092C), {} are allowed",
            difference, config_.clock_tolerance());
      }
      for (int frame = 0; frame < 10; ++frame) compensate();
    }
  }
}

CycleResult Master::Pace() {
  Link* link = transactions_.link();
  if (next_cycle_ + int64_t{config_.cycle()} < Now()) next_cycle_ = Now();
  // What is asked of slaves meanwhile is asked within the cycle, after its frame.
  std::array<uint8_t, 1> ignored;
  while (link->Receive(ignored, next_cycle_) != 0) ++transactions_.mutable_counts()->unexpected;
  next_cycle_ += config_.cycle();
  static_cast<void>(Send());
  return Receive(Now() + Milliseconds(config_.frame_timeout()));
}

void Master::GoOperational() {
  std::fill(outputs_.begin(), outputs_.end(), DriveOutputs{});
  operational_ = true;  // from here on there is something to stop
  next_cycle_ = Now();
  const auto pace = [this] { static_cast<void>(Pace()); };
  // Slaves enter OP only once they have outputs.
  pace();
  for (SlaveAccess& slave : slaves_) {
    slave.RequestState(AlState::kOp, pace);
    pace();
  }
  for (SlaveAccess& slave : slaves_) slave.AwaitState(AlState::kOp, pace);
  const int64_t deadline = Now() + timeouts_.state;
  while (true) {
    const CycleResult result = Pace();
    if (result.complete) return;
    if (Now() > deadline) {
      throw EthercatError(
          "the process data's working counter is {} instead of {} although all slaves are in OP",
          result.working_counter, result.expected_working_counter);
    }
  }
}

void Master::Attend(bool lockstep, Attendant::Say say) {
  attendant_ = std::make_unique<Attendant>(&config_, &setup_, clocks_, slaves_, timeouts_, lockstep,
                                           std::move(say));
}

bool Master::Stop() {
  attendant_.reset();
  acyclic_.reset();
  if (operational_) {
    // Zero torque and the drives' way down first: in INIT they would trip on lost process data.
    std::fill(outputs_.begin(), outputs_.end(), DriveOutputs{});
    for (int i = 0; i < 3; ++i) static_cast<void>(Pace());
  }
  operational_ = clocks_.running = false;
  constexpr int64_t kAskAgain = 100 * kMillisecond;
  const int64_t deadline = Now() + timeouts_.state;
  std::array<uint8_t, 2> bytes{};
  int64_t asked = Now() - kAskAgain;
  // A bus from which nothing comes back is not waited for: its watchdogs have acted.
  for (int silent = 0; silent < 2; slaves_[0].Pause()) {
    if (Now() - asked >= kAskAgain) {
      Put<uint16_t>(bytes, 0, static_cast<uint16_t>(AlState::kInit) | kAlError);
      static_cast<void>(transactions_.Execute(Command::kBwr, 0, reg::kAlControl, bytes));
      asked = Now();
    }
    Put<uint16_t>(bytes, 0, 0);
    const auto counter = transactions_.Execute(Command::kBrd, 0, reg::kAlStatus, bytes);
    silent = counter ? 0 : silent + 1;
    // To wait does not bring slaves that are not there.
    if (counter && bytes[0] == static_cast<uint8_t>(AlState::kInit)) {
      return *counter == num_slaves();
    }
    if (Now() > deadline) return false;
  }
  return false;
}

Master::Cyclic Master::CyclicOf(Exchange exchange) const {
  const size_t outputs = image_.outputs_size();
  switch (exchange) {
    case Exchange::kRead:
      return {Command::kLrd, outputs, image_.size() - outputs, image_.expected_read()};
    case Exchange::kWrite:
      return {Command::kLwr, 0, outputs, image_.expected_write()};
    case Exchange::kReadWrite:
      break;
  }
  return {Command::kLrw, 0, image_.size(), image_.expected_read_write()};
}

bool Master::Send(Exchange exchange) {
  FrameCounts& counts = *transactions_.mutable_counts();
  if (awaited_) {
    ++counts.lost;
    trouble_ = true;
  }
  awaited_ = false;
  if (attendant_ && acyclic_) attendant_->slot().Lost();
  acyclic_.reset();
  exchange_ = exchange;
  for (size_t i = 0; i < outputs_.size(); ++i) image_.Put(i, outputs_[i], image_bytes_);
  const size_t outputs = image_.outputs_size();
  // Inputs go out as zero: what comes back nonzero, a slave has put there.
  std::fill(image_bytes_.begin() + static_cast<std::ptrdiff_t>(outputs), image_bytes_.end(),
            uint8_t{0});

  cyclic_index_ = transactions_.NextIndex();
  builder_.Clear();
  const Cyclic cyclic = CyclicOf(exchange);
  builder_.AddLogical(cyclic.command, cyclic_index_, cyclic.address(),
                      std::span<const uint8_t>(image_bytes_).subspan(cyclic.begin, cyclic.size));
  builder_.AddZero(Command::kBrd, cyclic_index_, 0, reg::kAlStatus, 2);
  if (clocks_.running) {
    // The reference puts its time in. Should it not be there, the others are told what it would be.
    std::array<uint8_t, 8> time{};
    if (seen_at_ != 0) {
      Put<int64_t>(time, 0, system_time_ + Now() - seen_at_);
    }
    builder_.Add(Command::kFrmw, cyclic_index_, slaves_[clocks_.reference].station(),
                 reg::kDcSystemTime, time);
  }
  // The attendant's datagram goes with the outputs, whose answer is not waited for within the
  // cycle.
  if (attendant_ && exchange != Exchange::kRead) {
    attendant_->BeginCycle(Now(), trouble_);
    acyclic_ = attendant_->slot().Take();
    if (acyclic_ && !builder_.Add(acyclic_->command, cyclic_index_, acyclic_->adp, acyclic_->ado,
                                  acyclic_->data)) {
      attendant_->slot().Lost();
      acyclic_.reset();
    }
  }
  if (!transactions_.link()->Send(builder_.bytes())) return false;
  ++counts.sent;
  awaited_ = true;
  return true;
}

CycleResult Master::Receive(int64_t deadline) {
  CycleResult result;
  result.expected_working_counter = CyclicOf(exchange_).working_counter;
  FrameCounts& counts = *transactions_.mutable_counts();
  // However many strangers' frames there are, a cycle looks at so many only.
  constexpr int kMostFrames = 64;
  for (int i = 0; awaited_ && i < kMostFrames; ++i) {
    const size_t size = transactions_.link()->Receive(received_, deadline);
    if (size == 0) {
      ++counts.lost;
      awaited_ = false;
      trouble_ = true;
      break;
    }
    const FrameReader reader{std::span(received_).first(size)};
    if (!reader.valid()) {
      ++counts.refused;
    } else if (!Take(reader, &result)) {
      ++counts.unexpected;
    } else {
      ++counts.returned;
      awaited_ = false;
    }
  }
  return result;
}

bool Master::Answers(const Datagram& datagram, Command command, uint16_t ado, size_t size) const {
  return datagram.index == cyclic_index_ && datagram.command == command && datagram.ado == ado &&
         datagram.data.size() == size;
}

bool Master::Take(const FrameReader& frame, CycleResult* result) {
  FrameReader reader = frame;
  const int expected = 2 + (clocks_.running ? 1 : 0) + (acyclic_ ? 1 : 0);
  if (reader.num_datagrams() != expected) return false;
  const Datagram data = *reader.Next();
  const Datagram status = *reader.Next();
  const std::optional<Datagram> clock = clocks_.running ? reader.Next() : std::nullopt;
  const Cyclic cyclic = CyclicOf(exchange_);
  const size_t outputs = image_.outputs_size();
  if (data.index != cyclic_index_ || data.command != cyclic.command ||
      data.logical_address() != cyclic.address() || data.data.size() != cyclic.size ||
      !Answers(status, Command::kBrd, reg::kAlStatus, 2) ||
      (clock && !Answers(*clock, Command::kFrmw, reg::kDcSystemTime, 8))) {
    return false;
  }
  // Outputs come back as they went, or the frame was damaged where no checksum looked.
  if (exchange_ != Exchange::kRead &&
      !std::equal(data.data.begin(), data.data.begin() + static_cast<std::ptrdiff_t>(outputs),
                  image_bytes_.begin())) {
    return false;
  }
  if (acyclic_) {
    const Datagram datagram = *reader.Next();
    if (!Answers(datagram, acyclic_->command, acyclic_->ado, acyclic_->data.size())) return false;
    attendant_->slot().Answer(datagram);
    acyclic_.reset();
  }
  result->returned = true;
  result->working_counter = data.working_counter;
  result->complete = data.working_counter == result->expected_working_counter;
  result->slaves_answering = status.working_counter;
  result->al_status = status.data[0];
  if (clock && clock->working_counter > 0) {
    result->system_time = Get<int64_t>(clock->data, 0);
    system_time_ = *result->system_time;
    seen_at_ = Now();
  }
  if (!result->complete) {
    ++short_working_counters_;
  } else if (exchange_ != Exchange::kWrite) {
    // The image's inputs alone: Get() looks at nothing else.
    const std::span<const uint8_t> inputs = data.data.subspan(outputs - cyclic.begin);
    std::copy(inputs.begin(), inputs.end(),
              image_bytes_.begin() + static_cast<std::ptrdiff_t>(outputs));
    for (size_t i = 0; i < inputs_.size(); ++i) inputs_[i] = image_.Get(i, image_bytes_);
  }
  trouble_ = result->al_status != static_cast<uint8_t>(AlState::kOp) ||
             result->slaves_answering != num_slaves() || !result->complete;
  return true;
}

}  // namespace poise::ethercat
