// How many faults of conventions and units are named: each of ListConventionFaults, and those of several
// links at once, on one link and on all, on URDFs. A fault is written into the file's text by other code than
// that which finds it. A sample is tried on robots from the tests and such as people publish, or on yours
// with
//   DEXCHECK_CAMPAIGN="a.urdf b.urdf" build/release/tests/corrections_test
//   --gtest_filter='ConventionCampaign.*'
// and every fault of every robot with DEXCHECK_CAMPAIGN_SAMPLE=1.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <set>
#include <sstream>

#include "controller/common/errors.h"
#include "harness/corrections/corrections.h"
#include "harness/corrections/read_printed.h"
#include "tests/common/files.h"
#include "tests/common/legged_robots.h"
#include "tests/common/random_robot.h"
#include "tests/common/stated_urdf.h"
#include "tests/common/urdf_text.h"
#include "tests/harness/descriptions/panda_urdf.h"

namespace dexcheck::testing::conventions_test {
namespace {

struct Robot {
  std::string name;
  std::string urdf;
};

/// A link of an arm as its maker publishes it, and the joint before it.
struct ArmLink {
  const char* xyz;
  const char* rpy;
  const char* axis;
  const char* com;
  const char* com_rpy;
  double mass;
  const char* inertia;
};

/// An arm of six joints with frames after Denavit and Hartenberg, all axes z, and generic tensors.
constexpr ArmLink kWelder[] = {
    {"0 0 0.1625", "0 0 0", "0 0 1", "0.003 -0.0256 0.0019", "0 0 0", 3.761,
     "ixx='0.01046' iyy='0.00911' izz='0.00879' ixy='0.00021' ixz='-0.00013' iyz='0.00058'"},
    {"0.02 0 0.03", "1.570796327 0 0", "0 0 1", "-0.2125 0.004 0.11336", "0 0 0", 8.058,
     "ixx='0.0219' iyy='0.1513' izz='0.1509' ixy='-0.0013' ixz='0.0097' iyz='0.0008'"},
    {"-0.425 0 0", "0 0 0", "0 0 1", "-0.2422 -0.006 0.0265", "0 0 0", 2.846,
     "ixx='0.00641' iyy='0.0381' izz='0.0375' ixy='0.0004' ixz='0.0022' iyz='-0.0003'"},
    {"-0.3922 0 0.1333", "0 0 0", "0 0 1", "0.002 -0.0018 0.01634", "0 0 0", 1.37,
     "ixx='0.00272' iyy='0.00243' izz='0.00201' ixy='0.00011' ixz='0.00009' iyz='-0.00007'"},
    {"0 -0.0997 0.001", "1.570796327 0 0", "0 0 1", "-0.001 0.0018 0.01634", "0 0 0", 1.3,
     "ixx='0.00251' iyy='0.00229' izz='0.00194' ixy='-0.00008' ixz='0.00012' iyz='0.00006'"},
    {"0.002 0.0996 0", "1.570796327 3.141592653 3.141592653", "0 0 1", "0.0004 0.0007 -0.001159", "0 0 0",
     0.365, "ixx='0.00032' iyy='0.00029' izz='0.00041' ixy='0.00002' ixz='-0.00001' iyz='0.00003'"}};

/// A desk arm out of a CAD program: frames turned anyhow, axes x, y and z, inertial frames turned too.
constexpr ArmLink kDesk[] = {
    {"0.0388353 -0.0000089 0.0624", "3.14159 0.41238 -2.7416", "0 0 1", "-0.0307604 -0.0016628 -0.0252713",
     "0.2 -0.31 0.5", 0.100006,
     "ixx='0.000083759' iyy='0.000081044' izz='0.000023901' ixy='0.000007553' ixz='-0.000001164' "
     "iyz='0.000001549'"},
    {"-0.0303992 -0.0182778 -0.0542", "-1.5708 -1.31 0.3", "0 1 0", "-0.0898471 -0.0083823 0.0184089",
     "0 0 0", 0.103,
     "ixx='0.000040834' iyy='0.000147318' izz='0.000142487' ixy='-0.000013162' ixz='0.000008153' "
     "iyz='0.000001123'"},
    {"-0.11257 -0.028 0.0021", "0.21 0.13 1.5708", "1 0 0", "-0.0980701 0.0032422 0.0182831", "0.4 0.7 -0.2",
     0.104,
     "ixx='0.000028701' iyy='0.000124317' izz='0.000122287' ixy='0.000014762' ixz='0.000003163' "
     "iyz='-0.000002115'"},
    {"-0.1349 0.0052 0.0031", "0.4 -0.3 -1.5708", "0 0 1", "-0.0013324 -0.0331641 0.0176314", "0 0 0", 0.079,
     "ixx='0.000035682' iyy='0.000023539' izz='0.000025411' ixy='0.000001719' ixz='0.000004162' "
     "iyz='0.000003257'"},
    {"0.0021 -0.0611 0.0181", "1.5708 0.0486795 3.1", "0 1 0", "0.0034202 0.0021042 -0.0213161", "0 0 0",
     0.087,
     "ixx='0.000027508' iyy='0.000043365' izz='0.000034510' ixy='-0.000002813' ixz='0.000001918' "
     "iyz='0.000005142'"}};

template <size_t N>
std::string WriteArm(const ArmLink (&links)[N]) {
  std::string text = "<robot name='arm'><link name='base'/>";
  for (size_t k = 0; k < N; ++k) {
    const ArmLink& l = links[k];
    text += fmt::format(
        "<link name='link{0}'><inertial><origin xyz='{1}' rpy='{2}'/><mass value='{3}'/><inertia "
        "{4}/></inertial></link><joint name='joint{0}' type='revolute'><parent link='{5}'/><child "
        "link='link{0}'/><origin xyz='{6}' rpy='{7}'/><axis xyz='{8}'/><limit lower='-{9}' upper='2.1' "
        "effort='50' velocity='3'/><dynamics damping='{10}'/></joint>",
        k + 1, l.com, l.com_rpy, l.mass, l.inertia, k == 0 ? "base" : "link" + std::to_string(k), l.xyz,
        l.rpy, l.axis, 1.5 + 0.1 * static_cast<double>(k), 0.1 + 0.03 * static_cast<double>(k));
  }
  return text + "</robot>";
}

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

/// Whether an item has the id that the injector gave the fault, or is about other numbers of its quantity.
/// How a base is mounted is a rotation.
bool Fits(const CorrectionItem& item, const std::string& id) {
  if (id.starts_with("base.") && item.fault.of == SiteKind::kRotation) return true;
  return item.id == id || item.id == "number." + id.substr(0, id.find('.')) ||
         (id == "inertia.frame_missing" && item.id == "inertia.no_axes");
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
      return FindCorrections(wrong, right);
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
        return FindCorrections(wrong, right);
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
      return FindCorrections(ReadUrdf(urdf.Write(), "wrong.urdf"), ReadUrdf(robot.urdf, "right.urdf"));
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

  /// Lists the visible ids of a fault of several quantities: no unit changes a centre of mass at the origin.
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
          [&] { return FindCorrections(ReadUrdf(wrong, "wrong.urdf"), ReadUrdf(right, "right.urdf")); });
  }

  template <typename Explain>
  void Judge(const std::string& where, const std::string& name, const std::vector<std::string>& ids,
             const Explain& explain) {
    FileCorrections found;
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
    for (const CorrectionItem& item : found.items)
      details_ += fmt::format("\n    {}: {}", item.id, DescribeItem(item));
  }

  enum class Outcome { kNamed, kInClass, kNotNamed, kWrong };

  /// Named when each of the ids is an item's, up to a class when an item has alternatives or is a number.
  /// Wrong when a convention is named that was not injected.
  static Outcome Rate(const FileCorrections& found, const std::vector<std::string>& ids) {
    bool is_class = false;
    std::set<std::string> named;
    for (const CorrectionItem& item : found.items) {
      std::set<std::string> fitting;
      for (const std::string& id : ids) {
        const auto fits = [&](const CorrectionItem& one) { return Fits(one, id); };
        if (fits(item) || std::ranges::any_of(item.rivals, fits)) fitting.insert(id);
      }
      is_class = is_class || IsNumber(item.fault) || !item.rivals.empty();
      if (fitting.empty() && !IsNumber(item.fault)) return Outcome::kWrong;
      named.merge(fitting);
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
  robots.push_back({"welder", WriteArm(kWelder)});
  robots.push_back({"desk", WriteArm(kDesk)});
  robots.push_back({"quadruped", CompleteText(WriteLeggedUrdf("quadruped", ListQuadruped()))});
  robots.push_back({"humanoid", CompleteText(WriteLeggedUrdf("humanoid", ListHumanoid()))});
  return robots;
}

TEST(ConventionCampaign, FaultsAreNamedOrLeftOpen) {
  // One fault in so many is tried, another one for the next robot.
  const char* const asked = std::getenv("DEXCHECK_CAMPAIGN_SAMPLE");
  const size_t sample = asked == nullptr ? 12 : std::max<size_t>(1, std::strtoul(asked, nullptr, 10));
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
  EXPECT_GT(sum.named + sum.in_class, 150);
  EXPECT_GE(sum.named + sum.in_class, 0.95 * (sum.named + sum.in_class + sum.not_named + sum.wrong));
  // The humanoid whose quaternions are all x y z w, or whose zeros are all half a turn off, is given other
  // axes.
  EXPECT_LE(sum.wrong, 0.005 * (sum.named + sum.in_class + sum.not_named + sum.wrong));
}

}  // namespace
}  // namespace dexcheck::testing::conventions_test
