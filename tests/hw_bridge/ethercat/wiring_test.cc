// How slaves are wired and which they are: junctions, swapped cables, identification, drives with
// other objects, and slaves that are no drives.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "hw_bridge/ethercat/topology.h"
#include "tests/hw_bridge/ethercat/chain_fixture.h"

namespace poise::ethercat {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

std::string Slave(int position) { return "slave " + std::to_string(position); }

/// DL status with communication on the given ports (bits 9, 11, 13, 15).
uint16_t Open(std::initializer_list<int> ports) {
  int status = 1;
  for (const int port : ports) status |= 1 << (9 + 2 * port) | 1 << (4 + port);
  return static_cast<uint16_t>(status);
}

TEST(Topology, DelaysAreHalfTheRoundTripsDifference) {
  // Three slaves in a line, cables of 100 and 250 ns, seen by clocks that differ at will; the first
  // wraps around between its two ports.
  const uint32_t a = 0xFFFFFF00, b = 1000, c = 7;
  const std::vector<SlavePorts> slaves = {
      {.dl_status = Open({0, 1}), .has_times = true, .times = {a, a + 700, 0, 0}},
      {.dl_status = Open({0, 1}), .has_times = true, .times = {b, b + 500, 0, 0}},
      {.dl_status = Open({0}), .has_times = true, .times = {c, 0, 0, 0}}};
  const auto places = FindTopology(slaves, Slave);
  EXPECT_EQ(places[1].delay, 100);
  EXPECT_EQ(places[2].delay, 350);
  EXPECT_EQ(places[2].parent, 1);
}

// A junction of three branches, from the paths alone: cables of 40 and 60 ns (port 3, two slaves),
// 100 ns (port 1) and 200 ns (port 2), the slaves' own forwarding included. The frame takes port 3
// first: it is back there after 2 (40 + 60) = 200, at port 1 after 200 + 200, at port 2 after
// 400 + 400 ns.
TEST(Topology, DelaysBehindAJunctionAddTheBranchesBefore) {
  const uint32_t t = 5000;
  const std::vector<SlavePorts> slaves = {
      {.dl_status = Open({0, 1, 2, 3}), .has_times = true, .times = {t, t + 400, t + 800, t + 200}},
      {.dl_status = Open({0, 1}), .has_times = true, .times = {9, 9 + 120, 0, 0}},
      {.dl_status = Open({0}), .has_times = true, .times = {3, 0, 0, 0}},
      {.dl_status = Open({0}), .has_times = true, .times = {77, 0, 0, 0}},
      {.dl_status = Open({0}), .has_times = true, .times = {1, 0, 0, 0}}};
  const auto places = FindTopology(slaves, Slave);
  EXPECT_EQ(places[1].delay, 40);
  EXPECT_EQ(places[2].delay, 100);
  EXPECT_EQ(places[3].delay, 200 + 100);
  EXPECT_EQ(places[4].delay, 400 + 200);
  EXPECT_EQ(places[3].parent, 0);
  EXPECT_EQ(places[3].parent_port, 1);
  EXPECT_EQ(places[4].parent_port, 2);
}

TEST(Topology, NamesWhatCannotBe) {
  const auto error = [](const std::vector<SlavePorts>& slaves) {
    return ErrorOf([&] { FindTopology(slaves, Slave); });
  };
  // The last slave, whose only plug is in OUT.
  EXPECT_THAT(error({{.dl_status = Open({0, 1})}, {.dl_status = Open({1})}}),
              AllOf(HasSubstr("the slave behind slave 0:"), HasSubstr("IN and OUT are swapped")));
  // One in the middle: port 1 had the frame first.
  EXPECT_THAT(error({{.dl_status = Open({0, 1}), .has_times = true, .times = {10, 50, 0, 0}},
                     {.dl_status = Open({0}), .has_times = true, .times = {30, 0, 0, 0}},
                     {.dl_status = Open({0, 1}), .has_times = true, .times = {40, 20, 0, 0}}}),
              AllOf(HasSubstr("the slave behind slave 0:"), HasSubstr("swapped")));
  // The same without clocks: its place in the chain does not fit its ports.
  EXPECT_THAT(
      error({{.dl_status = Open({0, 1})}, {.dl_status = Open({0})}, {.dl_status = Open({0, 1})}}),
      AllOf(HasSubstr("slave 2"), HasSubstr("no slave before it has an open port")));
  EXPECT_THAT(error({{.dl_status = Open({0, 1, 2})}, {.dl_status = Open({0})}}),
              AllOf(HasSubstr("slave 0"), HasSubstr("port 2 is open, but no slave answers")));
}

// In the emulation a frame's way is walked; what the master writes must be that way's time.
TEST(EthercatWiring, MeasuresDelaysBehindAJunction) {
  Bench bench(6);
  bench.chain_config.set_hop(900);
  // 0 has a branch of 1 and 2 at port 3, of 3 at port 1 and of 4 and 5 at port 2.
  const std::pair<uint32_t, uint32_t> places[] = {{0, 3}, {1, 1}, {0, 1}, {0, 2}, {4, 1}};
  for (int i = 1; i < 6; ++i) {
    bench.chain_config.mutable_drive(i)->set_behind(places[i - 1].first);
    bench.chain_config.mutable_drive(i)->set_port(places[i - 1].second);
    bench.chain_config.mutable_drive(i)->set_clock_start(12345 * i);
  }
  bench.Start();
  const int64_t expected[] = {0, 1, 2, 4 + 1, 6 + 1, 6 + 2};  // hops
  for (size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(bench.master->slave(i).Read<int32_t>(reg::kDcDelay), 900 * expected[i]) << i;
    EXPECT_LT(std::abs(bench.chain->slave(i).esc().SystemTime() -
                       bench.chain->slave(0).esc().SystemTime()),
              10);
  }
}

TEST(EthercatWiring, RefusesADriveWhoseCablesAreSwapped) {
  for (const int swapped : {1, 3}) {  // in the middle, at the end
    for (const bool clocks : {true, false}) {
      Bench bench(4);
      bench.chain_config.mutable_drive(swapped)->set_swapped(true);
      for (EmulatedDriveConfig& drive : *bench.chain_config.mutable_drive()) {
        drive.set_has_clock(clocks);
      }
      bench.master_config.set_distributed_clocks(clocks);
      bench.Build();
      const std::string error = ErrorOf([&] { bench.master->Start(); });
      EXPECT_THAT(error, HasSubstr("swapped")) << swapped << clocks;
      for (const TestLoad& load : bench.loads) EXPECT_EQ(load.torque_, 0);
      // It answers after those behind it; named is its place on the cable.
      if (clocks) {
        EXPECT_THAT(error, HasSubstr("the slave behind slave " + std::to_string(swapped - 1)));
      }
    }
  }
}

TEST(EthercatWiring, NamesTheSixthOfTwelveWhoseCablesAreSwapped) {
  for (const int swapped : {0, 5}) {
    Bench bench(12);
    bench.chain_config.set_hop(700);
    bench.chain_config.mutable_drive(swapped)->set_swapped(true);
    bench.Build();
    const std::string error = ErrorOf([&] { bench.master->Start(); });
    EXPECT_THAT(error, HasSubstr(swapped == 0 ? "the first slave: frames enter it at port 1"
                                              : "the slave behind slave 4"));
  }
}

TEST(EthercatWiring, ReadsADrivesNameFromItsEeprom) {
  Bench bench(2);
  bench.chain_config.mutable_drive(1)->set_device_name("X1");
  bench.Start();
  EXPECT_EQ(bench.master->slave(0).ReadName(), "Poise emulated servo drive");
  EXPECT_EQ(bench.master->slave(1).ReadName(), "X1");
}

TEST(EthercatWiring, FindsDrivesByTheirIdentification) {
  Bench bench(3);
  for (int i = 0; i < 3; ++i) {
    bench.master_config.mutable_drive(i)->set_identification(static_cast<uint32_t>(10 + i));
    // In the chain they are the other way round.
    bench.chain_config.mutable_drive(i)->set_identification(static_cast<uint32_t>(12 - i));
  }
  bench.Start();
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(bench.master->position(i), 2 - static_cast<int>(i));
    EXPECT_EQ(bench.master->slave(i).ReadIdentity().serial, 102 - i);
  }
  bench.loads[2].position_ = 1;
  bench.Cycle();
  bench.Cycle();
  EXPECT_NE(bench.master->inputs(0).position, 0);
  EXPECT_EQ(bench.master->inputs(2).position, 0);
}

TEST(EthercatWiring, ComparesAnIdentificationOrAnAliasAtItsPlace) {
  Bench wrong(2);
  wrong.master_config.mutable_drive(1)->set_identification(5);
  wrong.chain_config.mutable_drive(1)->set_identification(6);
  wrong.Build();
  EXPECT_THAT(ErrorOf([&] { wrong.master->Start(); }),
              AllOf(HasSubstr("joint_1"), HasSubstr("identification is 6")));
  Bench none(2);
  none.master_config.mutable_drive(1)->set_identification(5);
  none.Build();
  EXPECT_THAT(ErrorOf([&] { none.master->Start(); }), HasSubstr("not given"));
  Bench alias(2);
  alias.master_config.mutable_drive(0)->set_alias(9);
  alias.chain_config.mutable_drive(0)->set_alias(9);
  alias.Start();
  EXPECT_EQ(alias.Cycle().working_counter, 6);
}

void Map(google::protobuf::RepeatedPtrField<MappedObject>* list,
         std::initializer_list<std::array<uint32_t, 4>> objects) {
  for (const auto& [index, subindex, bits, pdo] : objects) {
    MappedObject& object = *list->Add();
    object.set_index(index);
    object.set_subindex(subindex);
    object.set_bits(bits);
    if (pdo != 0) object.set_pdo(pdo);
  }
}

// As maxon's: two PDOs a direction, neither 6072 nor 6061 in them, ratings elsewhere and in µN·m.
TEST(EthercatWiring, RunsADriveWhosePdosLackMaxTorqueAndMode) {
  Bench bench(1);
  DriveProfile& profile = *bench.master_config.mutable_profile();
  profile.clear_rx();
  profile.clear_tx();
  profile.set_fixed_mapping(true);
  profile.set_rated_torque_unit(0.001);
  Map(profile.mutable_rx(), {{0x6040, 0, 16, 0x1600}, {0x6071, 0, 16, 0x1601}});
  Map(profile.mutable_tx(),
      {{0x6041, 0, 16, 0x1A00}, {0x6064, 0, 32, 0x1A00}, {0x6077, 0, 16, 0x1A01}});
  EmulatedDriveConfig& drive = *bench.chain_config.mutable_drive(0);
  *drive.mutable_fixed_rx() = profile.rx();
  *drive.mutable_fixed_tx() = profile.tx();
  drive.set_torque_unit(1000);
  bench.master_config.mutable_drive(0)->set_max_torque(1200);
  bench.Start();
  EXPECT_EQ(bench.chain->slave(0).objects().Find({0x6072, 0})->value, 1200U);
  bench.SetTorque(2000, 0);
  bench.Drive(DriveGoal::kEnabled, 20);
  EXPECT_NEAR(bench.loads[0].torque_, 1.2 * 1.5, 1e-9);  // 6072 of the start holds it

  // A drive that has no 6072 at all holds itself.
  Bench without(1);
  without.master_config = bench.master_config;
  without.chain_config = bench.chain_config;
  without.chain_config.mutable_drive(0)->add_lacks(0x6072);
  testing::internal::CaptureStderr();
  without.Start();
  EXPECT_THAT(testing::internal::GetCapturedStderr(),
              AllOf(HasSubstr("warning: slave 0"), HasSubstr("has no object 6072")));
  without.SetTorque(3000, 0);
  without.Drive(DriveGoal::kEnabled, 20);
  EXPECT_NEAR(without.loads[0].torque_, 2 * 1.5, 1e-9);
}

// The drive texts of deploy/drives, each with a drive that has what the text says and lacks the
// rest.
TEST(EthercatWiring, RunsTheDrivesOfTheDriveTexts) {
  for (const std::string name : {"elmo_gold", "maxon_epos4", "synapticon_somanet"}) {
    Bench bench(2);
    DriveProfile& profile = *bench.master_config.mutable_profile();
    ReadTextProto(std::string(POISE_SOURCE_DIR) + "/deploy/drives/" + name + ".pbtxt", &profile);
    for (DriveConfig& drive : *bench.master_config.mutable_drive()) drive.set_max_torque(1500);
    for (EmulatedDriveConfig& drive : *bench.chain_config.mutable_drive()) {
      drive.set_vendor_id(profile.vendor_id());
      drive.set_product_code(profile.product_code());
      drive.set_torque_unit(name == "maxon_epos4" ? 1000 : 1);
      if (name == "elmo_gold") continue;
      *drive.mutable_fixed_rx() = profile.rx();
      *drive.mutable_fixed_tx() = profile.tx();
      if (name != "maxon_epos4") continue;
      drive.add_lacks(0x6072);
      drive.add_lacks(0x6075);
      profile.set_fixed_mapping(true);  // the emulation's PDOs are
    }
    bench.Build();
    for (size_t i = 0; i < 2; ++i) {
      bench.chain->slave(i).objects().Add({0x3001, 1}, 4, ObjectDictionary::kReadOnly, 15000);
    }
    bench.master->Start();
    bench.SetTorque(2500, 1500);
    bench.Drive(DriveGoal::kEnabled, 20);
    for (size_t i = 0; i < 2; ++i) {
      EXPECT_EQ(bench.State(i), DriveState::kOperationEnabled) << name;
      // maxon's has its own limit, of 2000 here.
      EXPECT_NEAR(bench.loads[i].torque_, name == "maxon_epos4" ? 3.0 : 2.25, 1e-9) << name;
    }
  }
}

TEST(EthercatWiring, SaysThatAFixedMappingIsAnother) {
  Bench bench(1);
  bench.master_config.mutable_profile()->set_fixed_mapping(true);
  bench.Build();
  EXPECT_THAT(ErrorOf([&] { bench.master->Start(); }),
              AllOf(HasSubstr("its own mapping is another"), HasSubstr("poise drives scan")));
}

TEST(EthercatWiring, WritesValuesAtTheStart) {
  Bench bench(2);
  const auto value = [](SdoValue* sdo, uint32_t index, uint32_t subindex, SdoValue::Type type,
                        int64_t number) {
    sdo->set_index(index);
    sdo->set_subindex(subindex);
    sdo->set_type(type);
    sdo->set_value(number);
  };
  value(bench.master_config.mutable_profile()->add_sdo(), 0x60C2, 1, SdoValue::U8, 4);
  value(bench.master_config.add_sdo(), 0x605A, 0, SdoValue::I16, 6);
  value(bench.master_config.mutable_drive(1)->add_sdo(), 0x605A, 0, SdoValue::I16, 5);
  SdoValue& note = *bench.master_config.mutable_drive(1)->add_sdo();
  note.set_index(0x2F00);
  note.set_type(SdoValue::TEXT);
  note.set_text(std::string(200, 'x'));
  bench.Start();
  const auto read = [&](size_t slave, uint16_t index, uint8_t subindex) {
    return bench.chain->slave(slave).objects().Find({index, subindex})->value;
  };
  EXPECT_EQ(read(0, 0x60C2, 1), 4U);
  EXPECT_EQ(read(0, 0x605A, 0), 6U);
  EXPECT_EQ(read(1, 0x605A, 0), 5U);
  EXPECT_EQ(bench.chain->slave(1).objects().Find({0x2F00, 0})->text.size(), 200U);

  Bench bad(1);
  value(bad.master_config.add_sdo(), 0x605A, 0, SdoValue::U8, 256);
  bad.Build();
  EXPECT_THAT(ErrorOf([&] { bad.master->Start(); }), HasSubstr("between 0 and 255"));
  // The drive has no such option; that a negative number is sent as it should be is in the answer.
  Bench negative(1);
  value(negative.master_config.add_sdo(), 0x605A, 0, SdoValue::I16, -1);
  negative.Build();
  EXPECT_THAT(ErrorOf([&] { negative.master->Start(); }), HasSubstr("0x06090030"));
  Bench missing(1);
  value(missing.master_config.add_sdo(), 0x2001, 3, SdoValue::U32, 1);
  missing.Build();
  EXPECT_THAT(ErrorOf([&] { missing.master->Start(); }),
              AllOf(HasSubstr("writing object 2001:03"), HasSubstr("does not exist")));
}

// A coupler without mailbox or clock and process data of single bits, a force sensor with two PDOs
// of REAL32, and two drives between them.
TEST(EthercatWiring, RunsSlavesThatAreNoDrives) {
  Bench bench(2);
  OtherSlave& coupler = *bench.master_config.add_other();
  coupler.set_name("coupler");
  coupler.set_position(0);
  DriveProfile& terminals = *coupler.mutable_profile();
  terminals.set_name("terminals");
  terminals.set_vendor_id(2);
  terminals.set_product_code(0x044C2C52);
  Map(terminals.mutable_rx(), {{0x7000, 1, 1, 0x1600}, {0x7010, 1, 1, 0x1601}, {0, 0, 6, 0x1601}});
  Map(terminals.mutable_tx(), {{0x6000, 1, 1, 0x1A00}, {0x6010, 1, 7, 0x1A01}});
  OtherSlave& sensor = *bench.master_config.add_other();
  sensor.set_name("force sensor");
  sensor.set_position(2);
  DriveProfile& forces = *sensor.mutable_profile();
  forces.set_name("six axes");
  forces.set_vendor_id(0x732);
  forces.set_product_code(0x26483052);
  Map(forces.mutable_tx(),
      {{0x6000, 1, 32, 0x1A00}, {0x6000, 2, 32, 0x1A00}, {0x6010, 0, 32, 0x1A01}});

  const EmulatedChainConfig drives = bench.chain_config;
  bench.chain_config.clear_drive();
  const auto add_other = [&](const DriveProfile& profile) -> EmulatedDriveConfig& {
    EmulatedDriveConfig& slave = *bench.chain_config.add_drive();
    slave.set_other(true);
    slave.set_vendor_id(profile.vendor_id());
    slave.set_product_code(profile.product_code());
    *slave.mutable_fixed_rx() = profile.rx();
    *slave.mutable_fixed_tx() = profile.tx();
    return slave;
  };
  EmulatedDriveConfig& first = add_other(terminals);
  first.set_mailbox(false);
  first.set_has_clock(false);
  *bench.chain_config.add_drive() = drives.drive(0);
  add_other(forces);
  *bench.chain_config.add_drive() = drives.drive(1);
  bench.Start();
  EXPECT_EQ(bench.master->position(0), 1);
  EXPECT_EQ(bench.master->position(1), 3);
  for (size_t i = 0; i < 4; ++i) EXPECT_EQ(bench.chain->slave(i).al_state(), AlState::kOp);

  bench.chain->slave(0).objects().Find({0x6010, 1})->value = 0x55;
  bench.chain->slave(2).objects().Find({0x6010, 0})->value = 0xC0490FDB;  // -3.14159 as REAL32
  bench.Cycle();
  const CycleResult result = bench.Cycle();
  EXPECT_TRUE(result.complete);
  EXPECT_EQ(result.working_counter, 3 * 3 + 1);  // three with both, the sensor with inputs only
  const ProcessImage& image = bench.master->image();
  EXPECT_EQ(bench.master->input(*image.FindInput(2, 0x6010, 1)), 0x55U);
  EXPECT_EQ(bench.master->input(*image.FindInput(3, 0x6010, 0)), 0xC0490FDBU);
  EXPECT_FALSE(image.FindInput(3, 0x6010, 9).has_value());
  bench.SetTorque(100, 1000);
  bench.Drive(DriveGoal::kEnabled, 20);
  EXPECT_NEAR(bench.loads[1].torque_, 0.15, 1e-9);
  EXPECT_NEAR(bench.loads[3].torque_, 0.15, 1e-9);
}

}  // namespace
}  // namespace poise::ethercat
