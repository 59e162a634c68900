// What ODE alone is told.
#include "sim_ode/ode_world.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "components/framework/configuration/configuration.h"
#include "components/framework/run.h"
#include "sim_ode/sim_ode_type.h"
#include "tests/sim/simulation_fixture.h"

namespace poise {
namespace {

TEST(SpringDamper, IsImplicitEulersOwn) {
  const double k = 18000 / 4.0, d = 300 / 4.0, h = 0.001;
  const Softness softness = SpringDamper(k, d, h);
  // Implicit Euler: f = -k (x + h v') - d v'; ODE: v' + cfm f = -(erp / h) x.
  EXPECT_NEAR(1 / softness.cfm, h * k + d, 1e-9);
  EXPECT_NEAR(softness.erp / h / softness.cfm, k, 1e-9);
}

TEST(OdeConfig, ValuesOutOfRangeAreRefused) {
  const auto field = [](double erp, double cfm) -> std::string {
    OdeConfig config;
    config.set_contact_erp(erp);
    config.set_contact_cfm(cfm);
    try {
      OdeWorlds(config);
    } catch (const ConfigError& error) {
      return error.field();
    }
    return "";
  };
  EXPECT_EQ(field(0.2, 1e-7), "");
  EXPECT_EQ(field(1.5, 1e-7), "contact_erp");
  EXPECT_EQ(field(0, 1e-7), "contact_erp");
  EXPECT_EQ(field(std::numeric_limits<double>::quiet_NaN(), 1e-7), "contact_erp");
  EXPECT_EQ(field(0.2, 0), "contact_cfm");
}

// The ground yields by what its softness says: the robot stands lower by weight times cfm times the
// step over erp, shared by eight points.
TEST(OdeConfig, SoftensTheGround) {
  std::vector<double> height;
  OdeConfig config;
  config.set_contact_cfm(1e-5);
  for (const double erp : {0.2, 0.4}) {
    config.set_contact_erp(erp);
    Simulation simulation(RigidRobot(), StandingConfig(), OdeWorlds(config), kTick, 1);
    const double start = simulation.truth().com.z();
    for (int i = 0; i < 1000; ++i) simulation.Advance();
    const double weight = simulation.model().total_mass() * robot::kGravity;
    const double sink = weight / 8 * 1e-5 * simulation.step() / erp;
    EXPECT_NEAR(start - simulation.truth().com.z(), sink, 0.02 * sink);
  }
}

}  // namespace
}  // namespace poise
