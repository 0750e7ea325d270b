// How many conventions are named on robots such as people publish: a fault of ListConventionFaults is written
// into a URDF's text at one link or at all, by code that shares nothing with the search. All faults are tried
// with DEXCHECK_CONVENTION_SAMPLE=1, and printed with DEXCHECK_DRAWN_SHOW=1.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <set>

#include "harness/corrections/corrections.h"
#include "harness/corrections/read_printed.h"
#include "tests/common/legged_robots.h"
#include "tests/common/stated_urdf.h"

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
         differ(a.lower, b.lower) || differ(a.upper, b.upper) || differ(a.damping, b.damping);
}

bool Concerns(const ConventionFault& fault, const UrdfPart& part) {
  if (part.parent < 0) return false;
  if (fault.of == FaultOf::kBody) return part.has_body && part.stated.body.mass > 0.0;
  if (fault.ids[0] == "zero.offset" && part.slides) return false;
  if (fault.of == FaultOf::kJoint) return part.moves;
  return part.moves && part.has_limit && !fault.ids[0].starts_with("armature");
}

struct Count {
  int named = 0, in_class = 0, not_named = 0, wrong = 0;
};

/// Judges what was found: all ids must be named, first or as rivals, and no other convention.
void Judge(const FileCorrections& found, const std::vector<std::string>& ids, const std::string& what,
           Count* count) {
  std::set<std::string> named;
  bool is_class = false, is_wrong = false;
  for (const CorrectionItem& item : found.items) {
    // A rotation that is lost is one of principal axes, or not.
    const auto find = [&](const CorrectionItem& one) {
      const auto is_same = [&](const std::string& id) {
        return id == one.id || (id == "inertia.frame_missing" && one.id == "inertia.no_axes");
      };
      return std::ranges::find_if(ids, is_same);
    };
    if (const auto made = find(item); made != ids.end()) {
      named.insert(*made);
      continue;
    }
    const auto rival =
        std::ranges::find_if(item.rivals, [&](const CorrectionItem& r) { return find(r) != ids.end(); });
    if (rival != item.rivals.end()) {
      named.insert(*find(*rival));
      is_class = true;
    } else if (item.id.starts_with("number.")) {
      is_class = true;
    } else {
      is_wrong = true;
    }
  }
  const bool has_all = named.size() == ids.size();
  ++(is_wrong ? count->wrong : !has_all ? count->not_named : is_class ? count->in_class : count->named);
  if ((has_all && !is_wrong) || std::getenv("DEXCHECK_DRAWN_SHOW") == nullptr) return;
  fmt::print("{} {} [{}]\n", is_wrong ? "WRONG" : "NONE", what, fmt::join(ids, ", "));
  for (const CorrectionItem& item : found.items) {
    fmt::print("    {:.0f} {}: {}\n", item.bits, item.id, DescribeItem(item, found.of_second));
    for (const CorrectionItem& rival : item.rivals) fmt::print("        or {}\n", rival.id);
  }
}

/// The fault at the links from `first` on, or at one of them. @return ids that show; empty when none does.
std::vector<std::string> Spoil(const ConventionFault& fault, bool all, StatedUrdf* urdf) {
  const size_t n = urdf->parts.size();
  size_t visible = 0;
  bool moves_com = false;
  for (size_t k = 0; k < n && (all || visible == 0); ++k) {
    UrdfPart& part = urdf->parts[(n / 2 + k) % n];
    const StatedLink before = part.stated;
    if (!Concerns(fault, part)) continue;
    fault.make(&part.stated);
    if (!IsVisible(part.stated, before)) {
      part.stated = before;
      continue;
    }
    ++visible;
    moves_com = moves_com || part.stated.body.com != before.body.com;
  }
  if (visible < (all ? 2U : 1U)) return {};
  std::vector<std::string> ids = fault.ids;
  if (ids.size() > 1 && !moves_com)
    std::erase_if(ids, [](const std::string& id) { return id.starts_with("com."); });
  return ids;
}

TEST(CorrectionConventions, AreNamedOnRobotsThatPeoplePublish) {
  const char* const asked = std::getenv("DEXCHECK_CONVENTION_SAMPLE");
  const size_t sample = asked == nullptr ? 3 : std::max<size_t>(1, std::strtoul(asked, nullptr, 10));
  const Robot robots[] = {{"welder", WriteArm(kWelder)},
                          {"desk", WriteArm(kDesk)},
                          {"quadruped", WriteLeggedUrdf("quadruped", ListQuadruped())},
                          {"humanoid", WriteLeggedUrdf("humanoid", ListHumanoid())}};
  Count count;
  size_t number = 0;
  for (const Robot& robot : robots) {
    const DescriptionFile right("right.urdf", StatedUrdf(robot.urdf).Write(), {});
    for (const ConventionFault& fault : ListConventionFaults()) {
      for (const bool all : {false, true}) {
        if (number++ % sample != 0) continue;
        StatedUrdf urdf(robot.urdf);
        const std::vector<std::string> ids = Spoil(fault, all, &urdf);
        if (ids.empty()) continue;
        const PrintedRobot wrong = ReadPrintedUrdf(urdf.Write(), "wrong.urdf");
        Judge(FindCorrections(wrong, ReadPrintedRobot(right)), ids,
              robot.name + (all ? " all: " : " one: ") + fault.name, &count);
      }
    }
  }
  const int tried = count.named + count.in_class + count.not_named + count.wrong;
  fmt::print("conventions: {} tried, {} named, {} class, {} not named, {} wrong\n", tried, count.named,
             count.in_class, count.not_named, count.wrong);
  EXPECT_GT(tried, 150);
  EXPECT_GE(count.named + count.in_class, 0.97 * tried);
  EXPECT_LE(count.wrong, 0.02 * tried);
}

}  // namespace
}  // namespace dexcheck::testing::conventions_test
