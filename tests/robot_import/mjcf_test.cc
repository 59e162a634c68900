// MJCF as files are written: classes, ranges, armature, sites, keyframes, equalities, newer
// attributes.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "components/robot/robot_model.h"
#include "components/robot_files/mjcf_source.h"

namespace poise::robot {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr char kText[] = R"(<mujoco model="arm">
  <compiler angle="degree" meshdir="m" eulerseq="zyx"/>
  <option timestep="0.002" newattribute="1"/>
  <default>
    <joint armature="0.1" damping="2"/>
    <default class="big">
      <joint range="-90 45" actuatorfrcrange="-80 70" frictionloss="0.3"/>
      <default class="bigger"><joint armature="0.2"/></default>
    </default>
    <default class="visual"><geom type="mesh" contype="0" conaffinity="0" mass="0"/></default>
  </default>
  <asset><mesh name="part" file="part.stl" scale="0.001 0.001 0.001"/></asset>
  <worldbody>
    <light pos="0 0 3"/>
    <geom name="floor" type="plane" size="0 0 0.05"/>
    <body name="base" pos="0 0 1" quat="0.70710678118654757 0 0 0.70710678118654757">
      <freejoint/>
      <inertial pos="0 0 0.1" mass="5" fullinertia="0.3 0.2 0.1 0.01 0.02 0.03"/>
      <geom class="visual" mesh="part" pos="0.1 0 0"/>
      <site name="imu" pos="0 0.1 0" euler="90 0 0"/>
      <body name="upper" pos="0 0 0.5" childclass="big">
        <inertial pos="0 0 0" mass="2" diaginertia="0.03 0.02 0.01" quat="0.70710678118654757 0.70710678118654757 0 0"/>
        <joint name="elbow" axis="0 1 0" pos="0 0 0.2" ref="30"/>
        <body name="fore" pos="0 0 0.7">
          <joint name="wrist" class="bigger" axis="1 0 0"/>
          <geom type="box" size="0.1 0.2 0.3" mass="3"/>
          <body name="finger"><joint name="slide" type="slide" axis="0 0 1" range="0 0.1"/>
            <geom type="sphere" size="0.1" mass="0.5"/></body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor joint="elbow" gear="10" ctrlrange="-5 5"/>
    <position joint="wrist" kp="100" dampratio="1" forcerange="-20 20"/>
  </actuator>
  <equality><joint joint1="slide" joint2="wrist" polycoef="0.01 0.5 0 0 0"/></equality>
  <sensor><gyro site="imu" noise="0.01"/></sensor>
  <keyframe><key name="home" qpos="0 0 1 1 0 0 0 0.1 0.2 0.05"/></keyframe>
</mujoco>)";

TEST(Mjcf, IsReadAsItIsMeant) {
  std::vector<std::string> warnings;
  MjcfDocument d = ReadMjcf(kText, &warnings);
  EXPECT_EQ(d.source.name, "arm");
  EXPECT_EQ(d.source.root, "base");
  // fullinertia: ixx iyy izz ixy ixz iyz.
  const MassProperties& base = d.source.FindLink("base")->mass;
  Eigen::Matrix3d expected;
  expected << 0.3, 0.01, 0.02, 0.01, 0.2, 0.03, 0.02, 0.03, 0.1;
  EXPECT_EQ(base.mass, 5);
  EXPECT_TRUE(base.inertia.isApprox(expected, 1e-15));
  // A quarter turn about x swaps y and z; the link's frame lies in its joint, 0.2 above the body's.
  const MassProperties& upper = d.source.FindLink("upper")->mass;
  EXPECT_TRUE(upper.inertia.isApprox(
      Eigen::Matrix3d(Eigen::Vector3d(0.03, 0.01, 0.02).asDiagonal()), 1e-12));
  EXPECT_TRUE(upper.com.isApprox(Eigen::Vector3d(0, 0, -0.2)));
  // A solid box of 0.2 x 0.4 x 0.6 m.
  const MassProperties& fore = d.source.FindLink("fore")->mass;
  EXPECT_NEAR(fore.inertia(0, 0), 3.0 / 12 * (0.16 + 0.36), 1e-9);
  EXPECT_EQ(d.from_shapes, (std::set<std::string>{"finger", "fore"}));

  const SourceJoint& elbow = *d.source.FindJoint("elbow");
  EXPECT_EQ(elbow.kind, JointKind::kRevolute);
  EXPECT_NEAR(elbow.lower, -M_PI / 2, 1e-12);
  EXPECT_NEAR(elbow.upper, M_PI / 4, 1e-12);
  EXPECT_EQ(elbow.armature, 0.1);
  EXPECT_EQ(elbow.damping, 2);
  EXPECT_EQ(elbow.friction, 0.3);
  EXPECT_EQ(elbow.effort, 50);  // the motor's, below the joint's 80
  EXPECT_TRUE(elbow.origin.translation().isApprox(Eigen::Vector3d(0, 0, 0.7)));
  // The file's posture is that of 30 degrees.
  const Eigen::Matrix3d at_reference =
      elbow.origin.linear() *
      Eigen::AngleAxisd(M_PI / 6, Eigen::Vector3d::UnitY()).toRotationMatrix();
  EXPECT_TRUE(at_reference.isIdentity(1e-12));
  const SourceJoint& wrist = *d.source.FindJoint("wrist");
  EXPECT_EQ(wrist.armature, 0.2);
  EXPECT_EQ(wrist.effort, 20);
  EXPECT_TRUE(wrist.origin.translation().isApprox(Eigen::Vector3d(0, 0, 0.5)));
  const SourceJoint& slide = *d.source.FindJoint("slide");
  EXPECT_EQ(slide.kind, JointKind::kPrismatic);
  ASSERT_TRUE(slide.mimic);
  EXPECT_EQ(slide.mimic->joint, "wrist");
  EXPECT_EQ(slide.mimic->multiplier, 0.5);
  EXPECT_EQ(slide.mimic->offset, 0.01);

  EXPECT_NEAR(d.source.FindJoint("imu_fixed")->origin.translation().y(), 0.1, 1e-15);
  ASSERT_EQ(d.sensors.size(), 1u);
  EXPECT_EQ(d.sensors[0].noise, 0.01);
  ASSERT_EQ(d.keys.size(), 1u);
  EXPECT_EQ(d.keys[0].joint.at("wrist"), 0.2);
  EXPECT_EQ(d.actuated, (std::set<std::string>{"elbow", "wrist"}));
  ASSERT_EQ(d.shapes.size(), 3u);
  EXPECT_EQ(d.shapes[0].mesh, "part.stl");
  EXPECT_FALSE(d.shapes[0].collides);
  EXPECT_NEAR(d.root_orientation.toRotationMatrix()(1, 0), 1, 1e-12);
}

std::string With(const std::string& from, const std::string& to) {
  std::string text = kText;
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

TEST(Mjcf, OfSeveralCompilersTheLastHolds) {
  const std::string again =
      With("<option", "<compiler angle=\"radian\" autolimits=\"false\"/><option");
  EXPECT_NEAR(ReadMjcf(again, nullptr).source.FindJoint("elbow")->lower, -90, 1e-12);
  EXPECT_NEAR(ReadMjcf(kText, nullptr).source.FindJoint("elbow")->lower, -M_PI / 2, 1e-12);
}

TEST(Mjcf, AMeshTakesItsClassesScale) {
  const std::string text = With("scale=\"0.001 0.001 0.001\"", "class=\"bigger\"");
  const auto scale = [&](const std::string& in_default, const std::string& in_big) {
    std::string scaled = text;
    scaled.insert(scaled.find("<default class=\"big\">"), in_default);
    scaled.insert(scaled.find("<joint range="), in_big);
    return ReadMjcf(scaled, nullptr).shapes[0].size;
  };
  EXPECT_EQ(scale("", ""), Eigen::Vector3d(1, 1, 1));
  EXPECT_EQ(scale("<mesh scale=\"2 3 4\"/>", ""), Eigen::Vector3d(2, 3, 4));
  EXPECT_EQ(scale("<mesh scale=\"2 3 4\"/>", "<mesh scale=\"5 6 7\"/>"), Eigen::Vector3d(5, 6, 7));
}

/// The pose of a link in the root, with all joints at zero.
Eigen::Isometry3d PlaceOf(MjcfDocument* d, const std::string& link) {
  Eigen::Isometry3d place = Eigen::Isometry3d::Identity();
  std::string at = link;
  while (at != d->source.root) {
    const auto joint = std::ranges::find(d->source.joints, at, &SourceJoint::child);
    place = joint->origin * place;
    at = joint->parent;
  }
  return place;
}

TEST(Mjcf, AFrameMovesWhatItHolds) {
  // A quarter turn about z, degrees as <compiler> says, around all of the robot's upper half.
  const std::string begin = "<frame pos=\"0.1 0 0.2\" euler=\"90 0 0\">";
  const std::string whole = kText;
  const size_t at = whole.find("<body name=\"upper\""), site = whole.find("<site name=\"imu\"");
  const size_t end = whole.rfind("</body>", whole.find("</worldbody>"));
  std::string framed = whole;
  framed.insert(end, "</frame>").insert(at, begin);
  framed.insert(framed.find("/>", site) + 2, "</frame>").insert(site, begin);
  MjcfDocument plain = ReadMjcf(whole, nullptr), d = ReadMjcf(framed, nullptr);
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
  frame.translation() = Eigen::Vector3d(0.1, 0, 0.2);
  frame.rotate(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ()));
  for (const char* link : {"imu", "upper", "fore", "finger"}) {
    EXPECT_TRUE(PlaceOf(&d, link).isApprox(frame * PlaceOf(&plain, link), 1e-12)) << link;
  }
  EXPECT_EQ(d.source.FindLink("fore")->mass.mass, 3);
  EXPECT_EQ(d.keys[0].joint.at("wrist"), 0.2);
}

TEST(Mjcf, ShapesInAFrameWeighWhatTheyDoWithoutOne) {
  const std::string box = "<geom type=\"box\" size=\"0.1 0.2 0.3\" mass=\"3\"/>";
  MjcfDocument d = ReadMjcf(With(box, "<frame pos=\"0 0 0.1\">" + box + "</frame>"), nullptr);
  double mass = 0;
  for (const SourceLink& link : d.source.links) mass += link.mass.mass;
  EXPECT_NEAR(mass, 5 + 2 + 3 + 0.5, 1e-12);
  // Beside an <inertial> they weigh nothing.
  d = ReadMjcf(With("<joint name=\"elbow\"", "<frame>" + box + "</frame><joint name=\"elbow\""),
               nullptr);
  mass = 0;
  for (const SourceLink& link : d.source.links) mass += link.mass.mass;
  EXPECT_NEAR(mass, 5 + 2 + 3 + 0.5, 1e-12);
}

TEST(Mjcf, AFrameAroundTheRobotTurnsIt) {
  std::string text = kText;
  text.insert(text.rfind("</worldbody>"), "</frame>");
  text.insert(text.find("<body name=\"base\""), "<frame euler=\"90 0 0\">");
  const Eigen::Matrix3d turn = ReadMjcf(text, nullptr).root_orientation.toRotationMatrix();
  EXPECT_NEAR(turn(0, 0), -1, 1e-12);  // the body's own quarter turn and the frame's
}

TEST(Mjcf, ThreeSlidesAndABallAreAFloatingBase) {
  std::vector<std::string> warnings;
  const MjcfDocument d = ReadMjcf(
      With("<freejoint/>",
           "<joint type=\"slide\" axis=\"1 0 0\"/><joint type=\"slide\" axis=\"0 1 0\"/><joint "
           "type=\"slide\" axis=\"0 0 1\"/><joint type=\"ball\"/>"),
      &warnings);
  EXPECT_EQ(d.source.root, "base");
  EXPECT_EQ(d.source.joints.size(), ReadMjcf(kText, nullptr).source.joints.size());
  EXPECT_EQ(d.keys[0].joint.at("wrist"), 0.2);
  EXPECT_THAT(warnings, testing::Not(testing::Contains(HasSubstr("floats here"))));
}

TEST(Mjcf, IsRefusedByLineAndName) {
  const auto problem = [](const std::string& text) -> std::string {
    try {
      ReadMjcf(text, nullptr);
      return "";
    } catch (const RobotError& error) {
      return error.what();
    }
  };
  EXPECT_THAT(problem(With("axis=\"0 1 0\"", "axis=\"0 nan 0\"")),
              HasSubstr("line 23: axis of <joint>"));
  EXPECT_THAT(problem(With("childclass=\"big\"", "childclass=\"huge\"")), HasSubstr("'huge'"));
  EXPECT_THAT(problem(With("<freejoint/>", "<freejoint/><replicate/>")), HasSubstr("<replicate>"));
  EXPECT_THAT(problem(With("<freejoint/>", "<freejoint/><frame><inertial/></frame>")),
              HasSubstr("<inertial> within <frame>"));
  EXPECT_THAT(problem(With("<body name=\"fore\"", "<body name=\"upper\"")), HasSubstr("'upper'"));
  // MuJoCo's own refusals name the file's objects, not those of the text that it was given.
  EXPECT_THAT(problem(With("axis=\"0 1 0\"", "axis=\"0 0 0\"")),
              AllOf(HasSubstr("MuJoCo refuses it"), HasSubstr("'elbow'")));
  EXPECT_THAT(problem(With("size=\"0.1 0.2 0.3\"", "size=\"0 0 0\"")),
              AllOf(HasSubstr("MuJoCo refuses it"), HasSubstr("a geom of body 'fore'")));
  EXPECT_THAT(problem(With("<joint name=\"wrist\"",
                           "<joint name=\"second\" axis=\"0 0 1\"/><joint "
                           "name=\"wrist\"")),
              HasSubstr("two joints, 'second' and 'wrist'"));
  EXPECT_THAT(problem("<mujoco><worldbody/></mujoco>"), HasSubstr("where is the robot"));
  EXPECT_THAT(problem("<mujoco><include file=\"x\"/></mujoco>"), HasSubstr("<include file='x'>"));
  EXPECT_THAT(problem("no xml"), HasSubstr("MJCF"));
}

}  // namespace
}  // namespace poise::robot
