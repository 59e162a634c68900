#include "tools/robot_import/feet_import.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "fmt/format.h"
#include "tools/robot_import/robot_fields.h"
#include "tools/robot_import/sole_finder.h"

namespace poise {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using robot::LinkTree;

// A sole is taken to have this share of the leg's length from hip to sole where nothing shows it:
// G1 has 0.26, Talos 0.26, TOCABI 0.35, the paper's robot 0.36. Its width over its length is 0.35,
// 0.62, 0.57, 0.5.
constexpr double kSoleOfLeg = 0.28, kWidthOfSole = 0.45;
constexpr double kRectangle = 5e-4;  // m: a polygon that differs by less is one
constexpr double kSameSole = 0.01;   // m: soles whose sizes differ by more are no mirror images
// Common sensors have these errors where the file has none: the paper's robot's.
constexpr double kForceNoise = 1, kMomentNoise = 0.05;  // N, N·m

class FeetImport {
 public:
  FeetImport(const ImportOptions& options, const MakerFile& maker, const LinkTree& tree,
             const std::vector<Isometry3d>& poses, const Anatomy& anatomy, BodyShapes* shapes,
             RobotImport* result)
      : options_(options),
        maker_(maker),
        tree_(tree),
        poses_(poses),
        anatomy_(anatomy),
        shapes_(shapes),
        result_(result) {}

  void Run() {
    std::array<FootSole, 2> soles = {SoleOf(0), SoleOf(1)};
    TellRound(soles);
    Compare(&soles);
    for (size_t f = 0; f < 2; ++f) {
      FootSole& sole = soles[f];
      const Leg& leg = anatomy_.leg[f];
      if (options_.sole) {
        SetRectangle((*options_.sole)[0], (*options_.sole)[1], &sole.found);
        sole.from = "as told";
        sole.sureness = Sureness::kSure;
      }
      Foot* const foot = result_->robot.add_foot();
      foot->set_name(f == 0 ? "right" : "left");
      WriteSole(leg.body, options_.foot[f].empty() ? sole.link : options_.foot[f], sole.found,
                foot);
      if (sole.sureness == Sureness::kGuess) foot->set_guessed(true);
      Say(fmt::format("{} sole", foot->name()), SoleValue(*foot), sole.from, sole.sureness);
      const auto [sensor, why] = ForceSensor(leg);
      foot->set_force_sensor(sensor);
      Say(fmt::format("{} force sensor", foot->name()), sensor ? "yes" : "none", why,
          sensor ? Sureness::kLikely : Sureness::kGuess);
    }
    result_->robot.set_force_noise(kForceNoise);
    result_->robot.set_moment_noise(kMomentNoise);
  }

 private:
  struct FootSole {
    FoundSole found;
    std::string from, link;  ///< a link that is named for it, or none
    Sureness sureness = Sureness::kSure;
    bool round = false;  ///< shapes that collide are there, and touch a plane in no area
  };

  void Say(std::string what, std::string value, std::string from, Sureness sureness) {
    result_->findings.push_back({std::move(what), std::move(value), std::move(from), sureness});
  }

  FootSole SoleOf(size_t f) {
    const Leg& leg = anatomy_.leg[f];
    const Matrix3d in_body = poses_[static_cast<size_t>(leg.body)].linear().transpose();
    const Vector3d down = in_body * -Vector3d::UnitZ(), forward = in_body * Vector3d::UnitX();
    shapes_->Forget();
    FootSole sole;
    const std::vector<FootShape> colliding = shapes_->Of(tree_, leg.body, true);
    sole.found = FindSole(colliding, down, forward);
    sole.from = "collision shapes";
    if (!sole.found.polygon.empty()) return sole;
    sole.round = !colliding.empty();
    sole.found = FindSole(shapes_->Of(tree_, leg.body, false), down, forward);
    sole.from = "visual shapes";
    sole.sureness = Sureness::kLikely;
    if (!sole.found.polygon.empty()) return sole;
    sole.link = SoleFrame(leg.body);
    sole.from = "share of the leg's length";
    sole.sureness = Sureness::kGuess;
    if (!shapes_->missing().empty()) TellMissing(*shapes_->missing().begin());
    sole.found = GuessedSole(leg, sole.link, down, forward);
    return sole;
  }

  /// Says why what collides does not tell the soles, though it is there.
  void TellRound(const std::array<FootSole, 2>& soles) {
    const auto round = std::ranges::find_if(soles, &FootSole::round);
    if (round == soles.end() || options_.sole) return;
    result_->defects.push_back(
        {"the feet's collision shapes touch flat ground in no area, as spheres do",
         fmt::format("the soles are of the {}; --sole LENGTH WIDTH says better", round->from)});
  }

  /// Right and left soles are mirror images: where they are of two kinds, the better founded one
  /// serves for both.
  void Compare(std::array<FootSole, 2>* soles) {
    const auto size = [&](size_t f) -> Eigen::Vector2d {
      Eigen::AlignedBox2d box;
      for (const Eigen::Vector2d& p : (*soles)[f].found.polygon) box.extend(p);
      return box.sizes();
    };
    const auto told = [&](size_t f) {
      return fmt::format("{:.3g} x {:.3g} m of {}", size(f).x(), size(f).y(), (*soles)[f].from);
    };
    const bool alike = (*soles)[0].sureness == (*soles)[1].sureness;
    if ((alike && (size(0) - size(1)).cwiseAbs().maxCoeff() < kSameSole) || options_.sole) return;
    const std::string what = fmt::format("the soles differ: right {}, left {}", told(0), told(1));
    if (alike) {
      result_->defects.push_back({what, "kept; --sole LENGTH WIDTH says what both are"});
      return;
    }
    const size_t good = (*soles)[0].sureness < (*soles)[1].sureness ? 0 : 1;
    result_->defects.push_back(
        {what, fmt::format("both that of the {} foot's {}, mirrored; --sole says better",
                           good == 0 ? "right" : "left", (*soles)[good].from)});
    // Across the sagittal plane, each about its foot's own frame.
    const Isometry3d& from = poses_[static_cast<size_t>(anatomy_.leg[good].body)];
    const Isometry3d& to = poses_[static_cast<size_t>(anatomy_.leg[1 - good].body)];
    const Eigen::DiagonalMatrix<double, 3> mirror(1, -1, 1);
    const Isometry3d sole = from * (*soles)[good].found.frame;
    Isometry3d mirrored = Isometry3d::Identity();
    mirrored.linear() = mirror * sole.linear() * mirror;
    mirrored.translation() = to.translation() + mirror * (sole.translation() - from.translation());
    FootSole& other = (*soles)[1 - good];
    other = (*soles)[good];
    other.link.clear();
    other.found.frame = to.inverse() * mirrored;
    std::ranges::reverse(other.found.polygon);
    for (Eigen::Vector2d& p : other.found.polygon) p.y() = -p.y();
    other.from += " of the other foot, mirrored";
    other.sureness = Sureness::kLikely;
  }

  void TellMissing(const std::pair<std::string, std::string>& mesh) {
    if (std::exchange(told_missing_, true) || options_.sole) return;
    result_->defects.push_back(
        {fmt::format("the soles are meshes, and '{}' cannot be read: {}", mesh.first, mesh.second),
         "guess: a share of the leg's length; --meshes FOLDER or --sole LENGTH WIDTH say better"});
  }

  static void SetRectangle(double length, double width, FoundSole* sole) {
    const double x = length / 2, y = width / 2;
    sole->polygon = {{-x, -y}, {x, -y}, {x, y}, {-x, y}};
  }

  /// A link of the foot that is named for its sole.
  std::string SoleFrame(int body) {
    for (const auto& [link, place] : tree_.links) {
      if (place.body == body && Contains(link, "sole")) return link;
    }
    return "";
  }

  FoundSole GuessedSole(const Leg& leg, const std::string& frame, const Vector3d& down,
                        const Vector3d& forward) {
    FoundSole sole;
    sole.frame.linear().col(0) = forward;
    sole.frame.linear().col(1) = -down.cross(forward);
    sole.frame.linear().col(2) = -down;
    Vector3d place = Vector3d::Zero();
    for (const auto& [link, at] : tree_.links) {
      if (at.body != leg.body) continue;
      if (frame.empty() ? at.pose.translation().dot(down) > place.dot(down) : link == frame) {
        place = at.pose.translation();
      }
    }
    sole.frame.translation() = place;
    const auto hip = static_cast<size_t>(tree_.joints[static_cast<size_t>(leg.joints[0])].body);
    const double length =
        kSoleOfLeg *
        (poses_[static_cast<size_t>(leg.body)] * place - poses_[hip].translation()).norm();
    SetRectangle(std::round(length * 1e3) / 1e3, std::round(kWidthOfSole * length * 1e3) / 1e3,
                 &sole);
    return sole;
  }

  /// The link of the body that has most shapes, or its own.
  std::string FootLink(int body) {
    std::string best = tree_.bodies[static_cast<size_t>(body)].name;
    int most = 0;
    for (const auto& [link, place] : tree_.links) {
      if (place.body != body) continue;
      const auto count =
          static_cast<int>(std::ranges::count_if(maker_.shapes, [&, &name = link](const auto& s) {
            return s.link == name && s.collides;
          }));
      if (count > most) most = count, best = link;
    }
    return best;
  }

  void WriteSole(int body, const std::string& wanted, const FoundSole& sole, Foot* foot) {
    const std::string link = wanted.empty() ? FootLink(body) : wanted;
    foot->set_link(link);
    SetPose(tree_.links.at(link).pose.inverse() * sole.frame, foot->mutable_sole());
    Eigen::AlignedBox2d box;
    for (const Eigen::Vector2d& p : sole.polygon) box.extend(p);
    bool rectangle = true;
    for (const Eigen::Vector2d& p : sole.polygon) {
      rectangle = rectangle && (p.cwiseAbs() - box.sizes() / 2).cwiseAbs().maxCoeff() < kRectangle;
    }
    if (rectangle) {
      foot->set_length(Clean(box.sizes().x()));
      foot->set_width(Clean(box.sizes().y()));
      return;
    }
    for (const Eigen::Vector2d& p : sole.polygon) {
      SoleVertex* const vertex = foot->add_vertex();
      vertex->set_x(Clean(p.x()));
      vertex->set_y(Clean(p.y()));
    }
  }

  static std::string SoleValue(const Foot& foot) {
    if (foot.vertex().empty()) {
      return fmt::format("{:.3g} x {:.3g} m, at {}", foot.length(), foot.width(), foot.link());
    }
    Eigen::AlignedBox2d box;
    for (const SoleVertex& v : foot.vertex()) box.extend(Eigen::Vector2d(v.x(), v.y()));
    return fmt::format("polygon of {} corners within {:.3g} x {:.3g} m, at {}", foot.vertex_size(),
                       box.sizes().x(), box.sizes().y(), foot.link());
  }

  std::pair<bool, std::string> ForceSensor(const Leg& leg) {
    const auto at_foot = [&](const std::string& place) {
      if (const auto link = tree_.links.find(place); link != tree_.links.end()) {
        return link->second.body == leg.body;
      }
      for (const robot::SourceJoint& joint : maker_.source.joints) {
        const auto child = tree_.links.find(joint.child);
        if (joint.name == place && child != tree_.links.end())
          return child->second.body == leg.body;
      }
      return false;
    };
    std::vector<std::string> places;
    std::string kind;
    for (const robot::MjcfSensor& sensor : maker_.sensors) {
      const bool force = Contains(sensor.kind, "force") || sensor.kind == "feedback";
      const bool known = std::ranges::find(places, sensor.site) != places.end();
      if (!force || known || !at_foot(sensor.site)) continue;
      if (kind.empty()) kind = sensor.kind;
      places.push_back(sensor.site);
    }
    if (places.size() == 1) return {true, fmt::format("sensor '{}' at {}", kind, places[0])};
    if (places.size() > 1) {
      return {true, fmt::format("the sum of {} sensors, at {}", places.size(),
                                fmt::join(places, " and "))};
    }
    for (const auto& [link, place] : tree_.links) {
      if (place.body == leg.body && (Contains(link, "ft_sensor") || Contains(link, "force") ||
                                     Contains(link, "_ft_") || Lower(link).ends_with("_ft"))) {
        places.push_back(link);
      }
    }
    if (places.empty()) return {false, "the file shows none"};
    return {true, fmt::format("link {}", fmt::join(places, ", "))};
  }

  const ImportOptions& options_;
  const MakerFile& maker_;
  const LinkTree& tree_;
  const std::vector<Isometry3d>& poses_;
  const Anatomy& anatomy_;
  BodyShapes* shapes_;
  RobotImport* result_;
  bool told_missing_ = false;
};

}  // namespace

void AddFeet(const ImportOptions& options, const MakerFile& maker, const LinkTree& tree,
             const std::vector<Isometry3d>& poses, const Anatomy& anatomy, BodyShapes* shapes,
             RobotImport* result) {
  FeetImport(options, maker, tree, poses, anatomy, shapes, result).Run();
}

}  // namespace poise
