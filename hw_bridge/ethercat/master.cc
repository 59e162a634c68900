#include "hw_bridge/ethercat/master.h"

#include <fmt/format.h>

#include <algorithm>

namespace poise::ethercat {
namespace {

constexpr uint16_t kFirstStation = 1001;  // 0 is the address of a slave that has none
constexpr uint32_t kLogicalStart = 0x00010000;
constexpr uint16_t kWatchdogDivider = 2498;  // 100 us
constexpr uint32_t kWatchdogUnitsPerMs = 10;

const MasterConfig& Checked(const MasterConfig& config) {
  const auto require = [](bool condition, std::string_view problem) {
    if (!condition) throw EthercatError(fmt::format("EtherCAT configuration: {}", problem));
  };
  require(config.has_profile(), "profile is missing: which drives are on the bus?");
  require(config.drive_size() > 0, "drive is missing: name each drive of the chain");
  require(config.cycle() >= 100'000 && config.cycle() <= 100'000'000,
          "cycle must be between 100000 and 100000000 ns");
  require(config.watchdog() >= 1 && config.watchdog() <= 6000,
          "watchdog must be between 1 and 6000 ms");
  require(config.attempts() >= 1 && config.attempts() <= 100, "attempts must be 1 to 100");
  require(config.frame_timeout() >= 1 && config.frame_timeout() <= 60'000 &&
              config.eeprom_timeout() >= 1 && config.eeprom_timeout() <= 60'000 &&
              config.mailbox_timeout() >= 1 && config.mailbox_timeout() <= 60'000 &&
              config.state_timeout() >= 1 && config.state_timeout() <= 60'000,
          "timeouts must be between 1 and 60000 ms");
  require(config.drift_frames() <= 100'000, "drift_frames must be at most 100000");
  require(
      static_cast<uint32_t>(std::abs(static_cast<int64_t>(config.sync0_shift()))) < config.cycle(),
      "sync0_shift must be less than a cycle");
  for (const DriveConfig& drive : config.drive()) {
    if (drive.rated_torque() == 0 || drive.rated_current() == 0) {
      throw EthercatError(fmt::format(
          "EtherCAT configuration: drive \"{}\": rated_torque (mN·m) and rated_current (mA) must "
          "be above 0",
          drive.joint()));
    }
  }
  return config;
}

int64_t Milliseconds(uint32_t value) { return int64_t{value} * kMillisecond; }

}  // namespace

Master::Master(Link* link, const MasterConfig& config)
    : config_(Checked(config)),
      image_(config.profile(), config.drive_size()),
      transactions_(link, Milliseconds(config.frame_timeout()),
                    static_cast<int>(config.attempts())),
      timeouts_{.eeprom = Milliseconds(config.eeprom_timeout()),
                .mailbox = Milliseconds(config.mailbox_timeout()),
                .state = Milliseconds(config.state_timeout())},
      identities_(static_cast<size_t>(config.drive_size())),
      outputs_(static_cast<size_t>(config.drive_size())),
      inputs_(static_cast<size_t>(config.drive_size())),
      image_bytes_(image_.size(), 0) {
  for (int i = 0; i < config.drive_size(); ++i) {
    slaves_.emplace_back(&transactions_, timeouts_, i, static_cast<uint16_t>(kFirstStation + i));
    slaves_.back().set_name(config.drive(i).joint());
  }
}

std::optional<int> Master::CountSlaves() {
  std::array<uint8_t, 2> status{};
  const auto counter = transactions_.Execute(Command::kBrd, 0, reg::kAlStatus, status);
  if (!counter) return std::nullopt;
  return *counter;
}

void Master::Start() {
  operational_ = clocks_running_ = false;
  const std::optional<int> found = CountSlaves();
  if (!found) {
    throw EthercatError(
        "no frame comes back from the EtherCAT bus; is the cable in, the chain powered, the "
        "emulator running, the address right?");
  }
  if (static_cast<size_t>(*found) != num_drives()) {
    throw EthercatError(fmt::format(
        "the EtherCAT bus has {} slaves, the configuration {} drives (the first without a slave: "
        "{}); check cables and power, or the list of drives",
        *found, num_drives(),
        static_cast<size_t>(*found) < num_drives() ? config_.drive(*found).joint() : "none"));
  }
  ResetAndAddress();
  for (size_t i = 0; i < num_drives(); ++i) {
    slaves_[i].AwaitState(AlState::kInit, [&] { slaves_[i].Pause(); });
    CheckDrive(i);
    slaves_[i].SetUpMailbox();
    slaves_[i].ChangeState(AlState::kPreOp);
    SetUpProcessData(i);
  }
  if (config_.distributed_clocks()) SetUpDistributedClocks();
  for (SlaveAccess& slave : slaves_) slave.ChangeState(AlState::kSafeOp);
  GoOperational();
}

void Master::ResetAndAddress() {
  const auto broadcast = [this](uint16_t address, size_t size, uint16_t value) {
    std::array<uint8_t, kNumFmmus * kFmmuSize> bytes{};
    Put<uint16_t>(bytes, 0, value);
    const auto counter =
        transactions_.Execute(Command::kBwr, 0, address, std::span(bytes).first(size));
    if (!counter || *counter != num_drives()) {
      throw EthercatError(fmt::format("writing register 0x{:04X} reached {} of {} slaves", address,
                                      counter.value_or(0), num_drives()));
    }
  };
  broadcast(reg::kAlControl, 2, static_cast<uint16_t>(AlState::kInit) | kAlError);
  // Slaves without distributed clocks do not count here.
  std::array<uint8_t, 1> off{};
  static_cast<void>(transactions_.Execute(Command::kBwr, 0, reg::kDcActivation, off));
  broadcast(reg::kFmmu, kNumFmmus * kFmmuSize, 0);
  broadcast(reg::kSyncManager, kNumSyncManagers * kSyncManagerSize, 0);
  for (size_t i = 0; i < num_drives(); ++i) {
    std::array<uint8_t, 2> station{};
    Put<uint16_t>(station, 0, slaves_[i].station());
    const auto counter = transactions_.Execute(
        Command::kApwr, AutoIncrementAddress(static_cast<int>(i)), reg::kStationAddress, station);
    if (!counter || *counter != 1) {
      throw EthercatError(fmt::format("{}: does not take its station address; is the chain whole?",
                                      slaves_[i].Describe()));
    }
  }
}

void Master::CheckDrive(size_t drive) {
  const DriveProfile& profile = config_.profile();
  const DriveConfig& expected = config_.drive(static_cast<int>(drive));
  SlaveAccess& slave = slaves_[drive];
  const Identity identity = slave.ReadIdentity();
  identities_[drive] = identity;
  const auto compare = [&](std::string_view what, uint32_t found, uint32_t wanted) {
    if (found == wanted) return;
    throw EthercatError(fmt::format(
        "{}: its {} is 0x{:08X}, that of \"{}\" 0x{:08X}; is this the right drive at this place?",
        slave.Describe(), what, found, profile.name(), wanted));
  };
  compare("vendor", identity.vendor, profile.vendor_id());
  compare("product code", identity.product, profile.product_code());
  if (profile.has_revision()) compare("revision", identity.revision, profile.revision());
  if (expected.has_serial()) compare("serial number", identity.serial, expected.serial());
}

void Master::SetUpProcessData(size_t drive) {
  SlaveAccess& slave = slaves_[drive];
  const DriveConfig& expected = config_.drive(static_cast<int>(drive));
  const auto rated = [&](std::string_view field, uint16_t index, uint32_t wanted,
                         std::string_view unit) {
    const uint32_t found = slave.Upload({index, 0});
    if (found == wanted) return;
    throw EthercatError(fmt::format(
        "{}: object {:04X} ({}) is {} {}, the configuration says {} {}; every torque would be "
        "wrong by that ratio: set up the drive or the configuration",
        slave.Describe(), index, field, found, unit, wanted, unit));
  };
  rated("rated_torque", object::kRatedTorque, expected.rated_torque(), "mN·m");
  rated("rated_current", object::kRatedCurrent, expected.rated_current(), "mA");
  const uint32_t modes = slave.Upload({object::kSupportedModes, 0});
  if ((modes >> (kModeCyclicTorque - 1) & 1) == 0) {
    throw EthercatError(fmt::format(
        "{}: object {:04X} (supported modes) is 0x{:08X}, without cyclic synchronous torque",
        slave.Describe(), object::kSupportedModes, modes));
  }
  image_.Configure(&slave);

  const std::array<uint16_t, kNumSyncManagers> addresses = slave.ReadSyncManagerAddresses();
  const auto set_up = [&](SyncManager manager, int fmmu, uint8_t control, uint8_t direction,
                          size_t image_offset, size_t size) {
    const uint16_t start = addresses[manager];
    if (start < reg::kRam) {
      throw EthercatError(fmt::format("{}: its EEPROM gives no address for sync manager {}",
                                      slave.Describe(), static_cast<int>(manager)));
    }
    std::array<uint8_t, kSyncManagerSize> sync{};
    Put<uint16_t>(sync, 0, start);
    Put<uint16_t>(sync, 2, static_cast<uint16_t>(size));
    sync[4] = control;
    sync[6] = kSmEnable;
    slave.Write(static_cast<uint16_t>(reg::kSyncManager + manager * kSyncManagerSize), sync);
    std::array<uint8_t, kFmmuSize> map{};
    Put<uint32_t>(map, 0, kLogicalStart + static_cast<uint32_t>(image_offset));
    Put<uint16_t>(map, 4, static_cast<uint16_t>(size));
    map[7] = 7;  // the last bit of the last byte
    Put<uint16_t>(map, 8, start);
    map[11] = direction;
    map[12] = 1;
    slave.Write(static_cast<uint16_t>(reg::kFmmu + fmmu * kFmmuSize), map);
  };
  set_up(kProcessOut, 0, kSmProcessOut, kFmmuWrite, image_.outputs_at(drive),
         image_.outputs_per_drive());
  set_up(kProcessIn, 1, kSmProcessIn, kFmmuRead, image_.inputs_at(drive),
         image_.inputs_per_drive());
  slave.Write<uint16_t>(reg::kWatchdogDivider, kWatchdogDivider);
  slave.Write<uint16_t>(reg::kWatchdogProcessData,
                        static_cast<uint16_t>(config_.watchdog() * kWatchdogUnitsPerMs));
}

void Master::SetUpDistributedClocks() {
  SetUpClocks(&transactions_, slaves_, transactions_.link()->Now());
  for (uint32_t i = 0; i < config_.drift_frames(); ++i) {
    std::array<uint8_t, 8> time{};
    const auto counter =
        transactions_.Execute(Command::kFrmw, slaves_[0].station(), reg::kDcSystemTime, time);
    if (!counter) throw EthercatError("distributed clocks: no frame came back");
  }
  StartSync0(slaves_, config_.cycle(), config_.sync0_shift());
  clocks_running_ = true;
}

void Master::ExchangeOnce() {
  static_cast<void>(Send());
  static_cast<void>(Receive(transactions_.link()->Now() + Milliseconds(config_.frame_timeout())));
  slaves_[0].Pause();
}

void Master::GoOperational() {
  std::fill(outputs_.begin(), outputs_.end(), DriveOutputs{});
  operational_ = true;  // from here on there is something to stop
  const auto exchange = [this] { ExchangeOnce(); };
  // Slaves enter OP only once they have outputs.
  exchange();
  for (SlaveAccess& slave : slaves_) {
    slave.RequestState(AlState::kOp);
    exchange();
  }
  for (SlaveAccess& slave : slaves_) slave.AwaitState(AlState::kOp, exchange);
  const int64_t deadline = transactions_.link()->Now() + timeouts_.state;
  while (true) {
    static_cast<void>(Send());
    const CycleResult result =
        Receive(transactions_.link()->Now() + Milliseconds(config_.frame_timeout()));
    if (result.complete) return;
    if (transactions_.link()->Now() > deadline) {
      throw EthercatError(fmt::format(
          "the process data's working counter is {} instead of {} although all slaves are in OP",
          result.working_counter, result.expected_working_counter));
    }
  }
}

bool Master::Stop() {
  if (operational_) {
    // Zero torque and the drives' way down first: in INIT they would trip on lost process data.
    std::fill(outputs_.begin(), outputs_.end(), DriveOutputs{});
    const int64_t down = transactions_.link()->Now() + 3 * int64_t{config_.cycle()};
    while (transactions_.link()->Now() < down) ExchangeOnce();
  }
  operational_ = clocks_running_ = false;
  const int64_t deadline = transactions_.link()->Now() + timeouts_.state;
  std::array<uint8_t, 2> bytes{};
  // A bus from which nothing comes back is not waited for: its watchdogs have acted.
  for (int silent = 0; silent < 2;) {
    Put<uint16_t>(bytes, 0, static_cast<uint16_t>(AlState::kInit) | kAlError);
    static_cast<void>(transactions_.Execute(Command::kBwr, 0, reg::kAlControl, bytes));
    Put<uint16_t>(bytes, 0, 0);
    const auto counter = transactions_.Execute(Command::kBrd, 0, reg::kAlStatus, bytes);
    silent = counter ? 0 : silent + 1;
    if (counter && *counter == num_drives() && bytes[0] == static_cast<uint8_t>(AlState::kInit)) {
      return true;
    }
    if (transactions_.link()->Now() > deadline) return false;
    slaves_[0].Pause();
  }
  return false;
}

bool Master::Send(Exchange exchange) {
  FrameCounts& counts = *transactions_.mutable_counts();
  if (awaited_) ++counts.lost;
  awaited_ = false;
  exchange_ = exchange;
  for (size_t i = 0; i < outputs_.size(); ++i) image_.Put(i, outputs_[i], image_bytes_);
  const size_t outputs = image_.outputs_size();
  // Inputs go out as zero: what comes back nonzero, a slave has put there.
  std::fill(image_bytes_.begin() + static_cast<std::ptrdiff_t>(outputs), image_bytes_.end(),
            uint8_t{0});

  cyclic_index_ = transactions_.NextIndex();
  builder_.Clear();
  const std::span<const uint8_t> image(image_bytes_);
  switch (exchange) {
    case Exchange::kReadWrite:
      builder_.AddLogical(Command::kLrw, cyclic_index_, kLogicalStart, image);
      break;
    case Exchange::kRead:
      builder_.AddLogical(Command::kLrd, cyclic_index_,
                          kLogicalStart + static_cast<uint32_t>(outputs), image.subspan(outputs));
      break;
    case Exchange::kWrite:
      builder_.AddLogical(Command::kLwr, cyclic_index_, kLogicalStart, image.first(outputs));
      break;
  }
  builder_.AddZero(Command::kBrd, cyclic_index_, 0, reg::kAlStatus, 2);
  if (clocks_running_) {
    builder_.AddZero(Command::kFrmw, cyclic_index_, slaves_[0].station(), reg::kDcSystemTime, 8);
  }
  if (!transactions_.link()->Send(builder_.bytes())) {
    ++counts.send_errors;
    return false;
  }
  ++counts.sent;
  awaited_ = true;
  return true;
}

CycleResult Master::Receive(int64_t deadline) {
  CycleResult result;
  const size_t drives = num_drives();
  result.expected_working_counter =
      static_cast<uint16_t>(exchange_ == Exchange::kReadWrite ? 3 * drives : drives);
  FrameCounts& counts = *transactions_.mutable_counts();
  // However many strangers' frames there are, a cycle looks at so many only.
  constexpr int kMostFrames = 64;
  for (int i = 0; awaited_ && i < kMostFrames; ++i) {
    const size_t size = transactions_.link()->Receive(received_, deadline);
    if (size == 0) {
      ++counts.lost;
      awaited_ = false;
      break;
    }
    const FrameReader reader{std::span(received_).first(size)};
    if (reader.error() != FrameError::kNone) {
      ++counts.refused[static_cast<size_t>(reader.error())];
    } else if (!Take(reader, &result)) {
      ++counts.unexpected;
    } else {
      ++counts.returned;
      awaited_ = false;
    }
  }
  return result;
}

bool Master::Take(const FrameReader& frame, CycleResult* result) {
  FrameReader reader = frame;
  if (reader.num_datagrams() != (clocks_running_ ? 3 : 2)) return false;
  const Datagram data = *reader.Next();
  const Datagram status = *reader.Next();
  const std::optional<Datagram> clock = reader.Next();
  const bool read = exchange_ != Exchange::kWrite;
  const size_t outputs = image_.outputs_size();
  // Where the inputs begin in this datagram.
  const size_t inputs_at = exchange_ == Exchange::kReadWrite ? outputs : 0;
  const size_t size = exchange_ == Exchange::kReadWrite ? image_.size()
                      : read                            ? image_.size() - outputs
                                                        : outputs;
  const Command command = exchange_ == Exchange::kReadWrite ? Command::kLrw
                          : read                            ? Command::kLrd
                                                            : Command::kLwr;
  const uint32_t address =
      kLogicalStart + static_cast<uint32_t>(exchange_ == Exchange::kRead ? outputs : 0);
  if (data.index != cyclic_index_ || data.command != command || data.logical_address() != address ||
      data.data.size() != size || status.index != cyclic_index_ ||
      status.command != Command::kBrd || status.ado != reg::kAlStatus || status.data.size() != 2 ||
      (clock && (clock->index != cyclic_index_ || clock->command != Command::kFrmw ||
                 clock->ado != reg::kDcSystemTime || clock->data.size() != 8))) {
    return false;
  }
  // Outputs come back as they went, or the frame was damaged where no checksum looked.
  if (exchange_ != Exchange::kRead &&
      !std::equal(data.data.begin(), data.data.begin() + static_cast<std::ptrdiff_t>(outputs),
                  image_bytes_.begin())) {
    return false;
  }
  result->returned = true;
  result->working_counter = data.working_counter;
  result->complete = data.working_counter == result->expected_working_counter;
  result->slaves_answering = status.working_counter;
  result->al_status = status.data[0];
  if (clock && clock->working_counter > 0) result->system_time = Get<int64_t>(clock->data, 0);
  if (!result->complete) {
    ++short_working_counters_;
  } else if (read) {
    // The image's inputs alone: Get() looks at nothing else.
    std::copy(data.data.begin() + static_cast<std::ptrdiff_t>(inputs_at), data.data.end(),
              image_bytes_.begin() + static_cast<std::ptrdiff_t>(outputs));
    for (size_t i = 0; i < inputs_.size(); ++i) inputs_[i] = image_.Get(i, image_bytes_);
  }
  return true;
}

}  // namespace poise::ethercat
