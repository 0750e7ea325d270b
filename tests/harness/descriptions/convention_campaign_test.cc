// How many faults of conventions and units are named: each of ListConventionFaults, and those of several
// links at once, on one link and on all, on URDFs. A fault is written into the file's text by other code than
// that which finds it. A sample is tried on robots from the tests, or on robots of yours with
//   DEXCHECK_CAMPAIGN="a.urdf b.urdf" build/release/tests/descriptions_test
//   --gtest_filter='ConventionCampaign.*'
// and every fault of every robot with DEXCHECK_CAMPAIGN_SAMPLE=1.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <set>
#include <sstream>

#include "controller/common/errors.h"
#include "harness/checks/file_causes.h"
#include "harness/corrections/read_printed.h"
#include "tests/common/files.h"
#include "tests/common/legged_robots.h"
#include "tests/common/random_robot.h"
#include "tests/common/stated_urdf.h"
#include "tests/common/urdf_text.h"
#include "tests/harness/descriptions/panda_urdf.h"

namespace dexcheck::testing::convention_campaign_test {
namespace {

struct Robot {
  std::string name;
  std::string urdf;
};

bool IsVisible(const StatedLink& a, const StatedLink& b) {
  constexpr double kVisible = 1e-3;
  const auto differ = [](double x, double y) { return std::abs(x - y) > kVisible * std::abs(y); };
  return differ(a.body.mass, b.body.mass) || (a.body.com - b.body.com).norm() > kVisible ||
         (a.body.inertia - b.body.inertia).norm() > kVisible * b.body.inertia.trace() ||
         (a.X_PL.matrix() - b.X_PL.matrix()).norm() > kVisible || (a.axis - b.axis).norm() > kVisible ||
         differ(a.lower, b.lower) || differ(a.upper, b.upper) || differ(a.damping, b.damping) ||
         differ(a.armature, b.armature);
}

bool Concerns(const ConventionFault& fault, const UrdfPart& part) {
  if (fault.of == FaultOf::kBody) return part.has_body && part.stated.body.mass > 0.0;
  if (fault.ids[0] == "zero.offset" && part.slides) return false;
  if (fault.of == FaultOf::kJoint) return part.moves;
  return part.moves && part.has_limit;
}

/// The fault at the links of these numbers, or at all. @return how many show it.
int Spoil(const ConventionFault& fault, const std::set<size_t>& links, StatedUrdf* urdf) {
  int visible = 0;
  for (size_t i = 0; i < urdf->parts.size(); ++i) {
    UrdfPart& part = urdf->parts[i];
    if (!Concerns(fault, part) || (!links.empty() && !links.contains(i))) continue;
    const StatedLink before = part.stated;
    fault.make(&part.stated);
    visible += IsVisible(part.stated, before) ? 1 : 0;
  }
  return visible;
}

/// Joints' armatures, which stand in no URDF.
double DrawArmature(const std::string& joint) { return 0.01 + 1e-4 * static_cast<double>(joint.back() % 17); }

PrintedRobot ReadUrdf(const std::string& text, const std::string& source) {
  return ReadPrintedRobot(DescriptionFile(source, text, {}));
}

void StateArmatures(const StatedUrdf& urdf, PrintedRobot* robot) {
  for (PrintedLink& link : robot->links) {
    for (const UrdfPart& part : urdf.parts) {
      if (part.moves && part.joint == link.joint.name)
        link.joint.scalars[static_cast<size_t>(JointScalar::kArmature)] =
            PrintedScalar{part.stated.armature, 1e-9};
    }
  }
}

/// Whether a fault is about what an id of the injector names: "com.mm", "exchange.mass".
bool IsAbout(const FileFault& fault, const std::string& id) {
  using enum SiteKind;
  const std::string quantity = id.substr(0, id.find('.'));
  if (quantity == "exchange") {
    const std::string what = id.substr(id.find('.') + 1);
    const bool is_exchange =
        fault.kind == CorrectionKind::kExchanged || fault.kind == CorrectionKind::kOfOther;
    if (!is_exchange) return false;
    return what == "joint"  ? fault.of == kName
           : what == "mass" ? fault.of == kMass
           : what == "com"  ? fault.of == kCom || fault.whole
                            : IsOfBody(fault.of);
  }
  const std::map<std::string, std::vector<SiteKind>> sites = {
      {"mass", {kMass}},         {"com", {kCom}},           {"inertia", {kInertia}},
      {"origin", {kPosition}},   {"rotation", {kRotation}}, {"place", {kPosition, kRotation}},
      {"axis", {kAxis}},         {"range", {kRange}},       {"damping", {kDamping}},
      {"armature", {kArmature}}, {"zero", {kRotation}},     {"base", {kRotation}},
      {"gravity", {kGravity}}};
  const std::vector<SiteKind>& of = sites.at(quantity);
  if (std::ranges::find(of, fault.of) != of.end()) return true;
  return fault.whole && IsOfBody(fault.of) == IsOfBody(of[0]);
}

std::string CompleteText(const std::string& text) {
  StatedUrdf urdf(text);
  for (size_t i = 0; i < urdf.parts.size(); ++i) {
    if (urdf.parts[i].moves && urdf.parts[i].stated.damping == 0.0)
      urdf.parts[i].stated.damping = 0.1 + 0.01 * static_cast<double>(i);
  }
  return urdf.Write();
}

class Campaign {
 public:
  struct Count {
    int named = 0, in_class = 0, not_named = 0, wrong = 0;
  };

  void Try(const Robot& robot, const ConventionFault& fault, bool all) {
    StatedUrdf urdf(robot.urdf);
    for (UrdfPart& part : urdf.parts) part.stated.armature = part.moves ? DrawArmature(part.joint) : 0.0;
    PrintedRobot right = ReadUrdf(robot.urdf, "right.urdf");
    StateArmatures(urdf, &right);
    std::set<size_t> links;
    if (!all) {
      const size_t first = FindLink(fault, urdf);
      if (first == urdf.parts.size()) return;
      links = {first};
    }
    if (Spoil(fault, links, &urdf) < (all ? 2 : 1)) return;
    Judge(robot.name + (all ? " all: " : " one: "), fault.name, ListVisible(fault, robot, urdf), [&] {
      PrintedRobot wrong = ReadUrdf(urdf.Write(), "wrong.urdf");
      StateArmatures(urdf, &wrong);
      return FindCauses(wrong, right);
    });
  }

  /// Faults of two links, and of the base.
  void TryStructure(const Robot& robot) {
    const StatedUrdf read(robot.urdf);
    std::vector<size_t> moving;
    for (size_t i = 0; i < read.parts.size(); ++i) {
      if (read.parts[i].moves && read.parts[i].has_body) moving.push_back(i);
    }
    const auto exchange = [&](const char* name, const char* id, size_t i, size_t j,
                              void (*swap)(StatedLink*, StatedLink*)) {
      StatedUrdf urdf(robot.urdf);
      swap(&urdf.parts[i].stated, &urdf.parts[j].stated);
      if (!IsVisible(urdf.parts[i].stated, read.parts[i].stated)) return;
      JudgeText(robot, name, id, urdf.Write(), robot.urdf);
    };
    if (moving.size() > 2) {
      const size_t i = moving[1], j = moving[2];
      exchange("links' names exchanged", "exchange.body", i, j, [](StatedLink* a, StatedLink* b) {
        std::swap(a->body, b->body);
        std::swap(a->R_LC, b->R_LC);
      });
      exchange("masses exchanged", "exchange.mass", i, j,
               [](StatedLink* a, StatedLink* b) { std::swap(a->body.mass, b->body.mass); });
      exchange("centres exchanged", "exchange.com", i, j,
               [](StatedLink* a, StatedLink* b) { std::swap(a->body.com, b->body.com); });
      exchange("inertias exchanged", "exchange.inertia", i, j,
               [](StatedLink* a, StatedLink* b) { std::swap(a->body.inertia, b->body.inertia); });
      TryJointNames(robot, read, i, j);
      for (size_t k = 0; k < moving.size(); ++k) {
        for (size_t l = k + 1; l < moving.size(); ++l) {
          if (read.parts[moving[k]].parent != read.parts[moving[l]].parent || k + 1 == l) continue;
          return TryBase(robot), TryJointNames(robot, read, moving[k], moving[l]);
        }
      }
    }
    TryBase(robot);
  }

  void TryJointNames(const Robot& robot, const StatedUrdf& read, size_t i, size_t j) {
    StatedUrdf urdf(robot.urdf);
    urdf.ExchangeJointNames(read.parts[i].joint, read.parts[j].joint);
    JudgeText(robot, "joints' names exchanged", "exchange.joint", urdf.Write(), robot.urdf);
  }

  void TryBase(const Robot& robot) {
    const struct {
      const char* name;
      const char* id;
      Vector3d axis;
      double angle;
    } turns[] = {{"base upside down about x", "base.half_x", Vector3d::UnitX(), kPi},
                 {"base upside down about y", "base.half_y", Vector3d::UnitY(), kPi},
                 {"base turned half about z", "base.half_z", Vector3d::UnitZ(), kPi},
                 {"base turned a quarter about z", "base.quarter_z", Vector3d::UnitZ(), 0.5 * kPi},
                 {"base mounted on the wall", "base.quarter_y", Vector3d::UnitY(), 0.5 * kPi}};
    for (const auto& turn : turns) {
      StatedUrdf urdf(robot.urdf);
      if (urdf.parts[0].link == "world") return;
      StatedUrdf right(robot.urdf);
      urdf.MountOn("world", Pose(Eigen::AngleAxisd(turn.angle, turn.axis)));
      right.MountOn("world", Pose::Identity());
      JudgeText(robot, turn.name, turn.id, urdf.Write(), right.Write());
    }
    const std::tuple<const char*, const char*, Vector3d> gravities[] = {
        {"gravity upside down", "gravity.sign", {0.0, 0.0, 9.81}},
        {"gravity along y", "gravity.axis", {0.0, -9.81, 0.0}},
        {"gravity missing", "gravity.missing", {0.0, 0.0, 0.0}},
        {"gravity in mm/s^2", "gravity.mm", {0.0, 0.0, -9810.0}}};
    for (const auto& [name, id, gravity] : gravities) {
      Judge(robot.name + ": ", name, {id}, [&, gravity = gravity] {
        PrintedRobot right = ReadUrdf(robot.urdf, "right.urdf");
        right.gravity = Vector3d(0.0, 0.0, -9.81);
        PrintedRobot wrong = right;
        wrong.gravity = gravity;
        return FindCauses(wrong, right);
      });
    }
  }

  /// Two faults of two kinds at once, all links.
  void TryPair(const Robot& robot, const ConventionFault& a, const ConventionFault& b, bool all_of_b) {
    StatedUrdf urdf(robot.urdf);
    if (Spoil(a, {}, &urdf) < 2) return;
    std::set<size_t> links;
    if (!all_of_b) links = {FindLink(b, urdf)};
    if (links.contains(urdf.parts.size())) return;
    if (Spoil(b, links, &urdf) < (all_of_b ? 2 : 1)) return;
    std::vector<std::string> ids = a.ids;
    ids.insert(ids.end(), b.ids.begin(), b.ids.end());
    Judge(robot.name + ": ", "PAIR " + a.name + " + " + b.name + (all_of_b ? "" : " of one"), ids, [&] {
      return FindCauses(ReadUrdf(urdf.Write(), "wrong.urdf"), ReadUrdf(robot.urdf, "right.urdf"));
    });
  }

  void Print() const {
    Count sum;
    fmt::print("{:<66} {:>5} {:>5} {:>5} {:>5}\n", "fault", "named", "class", "none", "wrong");
    for (const auto& [name, count] : counts_) {
      fmt::print("{:<66} {:>5} {:>5} {:>5} {:>5}\n", name, count.named, count.in_class, count.not_named,
                 count.wrong);
      Add(count, &sum);
    }
    fmt::print("{:<66} {:>5} {:>5} {:>5} {:>5}\n{}\n", "all", sum.named, sum.in_class, sum.not_named,
               sum.wrong, details_);
  }
  [[nodiscard]] Count Sum() const {
    Count sum;
    for (const auto& [name, count] : counts_) Add(count, &sum);
    return sum;
  }
  [[nodiscard]] const std::string& details() const { return details_; }

 private:
  static void Add(const Count& count, Count* sum) {
    sum->named += count.named;
    sum->in_class += count.in_class;
    sum->not_named += count.not_named;
    sum->wrong += count.wrong;
  }

  static bool IsMoved(const StatedUrdf& urdf, size_t part) {
    for (int i = static_cast<int>(part); i >= 0; i = urdf.parts[static_cast<size_t>(i)].parent) {
      if (urdf.parts[static_cast<size_t>(i)].moves) return true;
    }
    return false;
  }

  /// Of a fault of several quantities, those that show: no unit changes a centre of mass at the origin.
  static std::vector<std::string> ListVisible(const ConventionFault& fault, const Robot& robot,
                                              const StatedUrdf& spoilt) {
    std::vector<std::string> ids = fault.ids;
    if (ids.size() < 2) return ids;
    const StatedUrdf right(robot.urdf);
    const auto is_same = [&](size_t i) {
      return right.parts[i].stated.body.com == spoilt.parts[i].stated.body.com;
    };
    bool all_same = true;
    for (size_t i = 0; i < right.parts.size(); ++i) all_same = all_same && (!IsMoved(right, i) || is_same(i));
    if (all_same) std::erase_if(ids, [](const std::string& id) { return id.starts_with("com."); });
    return ids;
  }

  /// A link in the middle that shows the fault.
  static size_t FindLink(const ConventionFault& fault, const StatedUrdf& urdf) {
    const size_t n = urdf.parts.size();
    for (size_t k = 0; k < n; ++k) {
      const size_t i = (n / 2 + k) % n;
      if (!Concerns(fault, urdf.parts[i]) || !urdf.parts[i].moves) continue;
      StatedLink link = urdf.parts[i].stated;
      fault.make(&link);
      if (IsVisible(link, urdf.parts[i].stated)) return i;
    }
    return n;
  }

  void JudgeText(const Robot& robot, const std::string& name, const std::string& id, const std::string& wrong,
                 const std::string& right) {
    Judge(robot.name + ": ", name, {id},
          [&] { return FindCauses(ReadUrdf(wrong, "wrong.urdf"), ReadUrdf(right, "right.urdf")); });
  }

  template <typename Explain>
  void Judge(const std::string& where, const std::string& name, const std::vector<std::string>& ids,
             const Explain& explain) {
    FileCauses found;
    try {
      found = explain();
    } catch (const InputError&) {
      return;  // the reader refuses it: no such body
    }
    Count& count = counts_[name];
    const Outcome outcome = Rate(found, ids);
    int* const counts[] = {&count.named, &count.in_class, &count.not_named, &count.wrong};
    ++*counts[static_cast<size_t>(outcome)];
    if (outcome == Outcome::kNamed) return;
    static constexpr const char* kOutcomes[] = {"", "CLASS", "NONE", "WRONG"};
    details_ += "\n  " + std::string(kOutcomes[static_cast<size_t>(outcome)]) + " " + where + name;
    for (const std::string& line : ListLines(found)) details_ += "\n    " + line;
  }

  enum class Outcome { kNamed, kInClass, kNotNamed, kWrong };

  /// Named when a cause that is no number is about each of the ids, up to a class when one has alternatives
  /// or is a number. Wrong when a convention is named that was not injected.
  static Outcome Rate(const FileCauses& found, const std::vector<std::string>& ids) {
    bool is_class = false;
    std::set<std::string> named;
    for (const CorrectionItem& item : found.corrections.items) {
      bool fits = false;
      for (const std::string& id : ids) {
        if (!IsAbout(item.fault, id)) continue;
        fits = true;
        named.insert(id);
      }
      is_class = is_class || IsNumber(item.fault) || !item.rivals.empty();
      if (!fits && !IsNumber(item.fault)) return Outcome::kWrong;
    }
    if (named.size() < ids.size()) return Outcome::kNotNamed;
    return is_class ? Outcome::kInClass : Outcome::kNamed;
  }

  std::map<std::string, Count> counts_;
  std::string details_;
};

std::vector<Robot> ListRobots() {
  std::vector<Robot> robots;
  if (const char* const files = std::getenv("DEXCHECK_CAMPAIGN")) {
    std::istringstream names(files);
    for (std::string name; names >> name;)
      robots.push_back({std::filesystem::path(name).stem().string(), CompleteText(ReadText(name))});
    return robots;
  }
  std::mt19937 random(20);
  for (const auto& [joints, branching] : {std::pair(6, 0.0), std::pair(7, 0.0), std::pair(10, 0.4)}) {
    RandomRobotOptions options;
    options.base = BaseType::kFixed;
    options.joints = joints;
    options.branching = branching;
    options.prismatic = 0.0;
    options.offset = 1.0;
    RobotSpec spec = MakeRandomRobot(options, &random);
    robots.push_back({"random" + std::to_string(joints), CompleteText(WriteUrdf(&spec, &random))});
  }
  robots.push_back({"panda", CompleteText(MakePandaUrdf())});
  robots.push_back({"quadruped", CompleteText(WriteLeggedUrdf("quadruped", ListQuadruped()))});
  return robots;
}

TEST(ConventionCampaign, FaultsAreNamedOrLeftOpen) {
  // Of so many faults one, another at the next robot.
  const char* const asked = std::getenv("DEXCHECK_CAMPAIGN_SAMPLE");
  const size_t sample = asked == nullptr ? 4 : std::max<size_t>(1, std::strtoul(asked, nullptr, 10));
  constexpr std::pair<const char*, const char*> kPairs[] = {
      {"joint's rotation in degrees", "mass as if in g"},
      {"mass as if in lb", "inertia with the products' sign turned around"},
      {"inertia as if given about the link's origin", "centre as if in mm"},
      {"joint as if in mm", "joint's rotation turned the other way"},
      {"joint's axis turned around", "centre with y and z exchanged"}};
  Campaign campaign;
  size_t number = 0;
  for (const Robot& robot : ListRobots()) {
    for (const ConventionFault& fault : ListConventionFaults()) {
      for (const bool all : {false, true}) {
        if (number++ % sample == 0) campaign.Try(robot, fault, all);
      }
    }
    campaign.TryStructure(robot);
    for (const auto& [first, second] : kPairs) {
      for (const bool all : {false, true})
        campaign.TryPair(robot, FindConventionFault(first), FindConventionFault(second), all);
    }
    ++number;
  }
  campaign.Print();
  const Campaign::Count sum = campaign.Sum();
  EXPECT_GE(sum.named + sum.in_class, 0.95 * (sum.named + sum.in_class + sum.not_named + sum.wrong));
  // The Panda with its places in mm and its rotations transposed is given other axes.
  EXPECT_LE(sum.wrong, 0.005 * (sum.named + sum.in_class + sum.not_named + sum.wrong));
}

}  // namespace
}  // namespace dexcheck::testing::convention_campaign_test
