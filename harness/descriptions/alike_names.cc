#include "harness/descriptions/alike_names.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <map>

#include "controller/common/text.h"
#include "harness/descriptions/robot_description.h"

namespace dexcheck {

namespace {

using Names = std::vector<std::string>;

Names Reverse(Names names) {
  for (std::string& name : names) std::ranges::reverse(name);
  return names;
}

/// The names without what all of several begin with.
Names DropCommonPrefix(Names names) {
  size_t length = names.size() < 2 ? 0 : names[0].size();
  for (const std::string& name : names) {
    const auto same = std::ranges::mismatch(name, names[0]).in1;
    length = std::min(length, static_cast<size_t>(same - name.begin()));
  }
  for (std::string& name : names) name.erase(0, length);
  return names;
}

/// The names as they are, and without what all begin with, or end with, or both.
std::vector<Names> ListVariants(const Names& names) {
  Names simple;
  for (const std::string& name : names) simple.push_back(SimplifyName(name));
  const Names without_prefix = DropCommonPrefix(simple);
  const auto drop_suffix = [](const Names& some) { return Reverse(DropCommonPrefix(Reverse(some))); };
  return {simple, without_prefix, drop_suffix(simple), drop_suffix(without_prefix)};
}

}  // namespace

std::string SimplifyName(const std::string& name) {
  std::string simple = ToLower(name);
  std::erase_if(simple, [](unsigned char c) { return std::isalnum(c) == 0; });
  return simple;
}

Names ListJointNames(const RobotDescription& robot) {
  Names names;
  for (const Joint& joint : robot.spec.joints) names.push_back(joint.name);
  return names;
}

Names FindAlikeNames(const Names& names, const Names& others) {
  if (names.size() != others.size()) return {};
  for (const Names& own : ListVariants(names)) {
    for (const Names& other : ListVariants(others)) {
      std::map<std::string, std::string> found;
      for (size_t i = 0; i < others.size(); ++i) found.emplace(other[i], others[i]);
      if (found.size() != others.size()) continue;
      Names partners;
      for (const std::string& name : own) {
        const auto partner = found.find(name);
        if (partner == found.end()) break;
        partners.push_back(partner->second);
        found.erase(partner);  // its own
      }
      if (partners.size() == names.size()) return partners;
    }
  }
  return {};
}

Names TakeJointNames(const RobotDescription& other, RobotDescription* robot) {
  const Names names = ListJointNames(*robot);
  const Names others = ListJointNames(other);
  Names partners = FindAlikeNames(names, others);
  const bool is_alike = !partners.empty();
  if (!is_alike) {
    for (const int joint : MatchByStructure(*robot, other))
      partners.push_back(others[static_cast<size_t>(joint)]);
  }
  Names renamed;
  for (size_t i = 0; i < partners.size(); ++i) {
    if (names[i] == partners[i]) continue;
    robot->spec.joints[i].name = partners[i];
    renamed.push_back(Quote(names[i]) + " is " + Quote(partners[i]));
  }
  if (renamed.empty()) return {};
  const std::string source = " in " + other.spec.source;
  if (is_alike) return {"joints by other names: " + JoinNames(renamed) + source};
  // These are for the reader to judge, so all of them are named.
  std::string pairs = "joints by other names, matched by the tree, then by places, axes, masses and ranges: ";
  for (const std::string& pair : renamed) pairs += pair + (&pair == &renamed.back() ? source : ", ");
  return {pairs};
}

namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr size_t kMostChildren = 12;

/// A robot as far as it is matched: its tree, and where axes are in the base with all joints at zero.
struct Tree {
  explicit Tree(const RobotDescription& robot) : spec(&robot.spec), described(&robot.joints) {
    const std::vector<JointInLinkFrames> rows = ListJointsInLinkFrames(robot);
    poses = CalcLinkPoses(Pose::Identity(), rows);
    children.resize(rows.size() + 1);
    for (size_t i = 0; i < rows.size(); ++i) {
      axes.push_back(poses[i + 1].linear() * rows[i].axis);
      children[static_cast<size_t>(rows[i].parent + 1)].push_back(static_cast<int>(i));
      length = std::max(length, poses[i + 1].translation().norm());
      index_of.emplace(spec->joints[i].name, static_cast<int>(i));
    }
  }

  const RobotSpec* spec;
  const std::vector<DescribedJoint>* described;
  std::vector<Pose> poses;                 // of links, the base first
  std::vector<Vector3d> axes;              // by joint
  std::vector<std::vector<int>> children;  // joints that hang on the base, on each joint's link
  std::map<std::string, int> index_of;
  double length = std::numeric_limits<double>::min();  // m
};

/// |x - y| relative to both, from 0 to 1.
double CompareSizes(double x, double y) {
  const double sum = std::abs(x) + std::abs(y);
  return sum > 0.0 ? std::abs(x - y) / sum : 0.0;
}

class StructureMatch {
 public:
  StructureMatch(const RobotDescription& a, const RobotDescription& b)
      : a_(a), b_(b), costs_(MatrixXd::Constant(Count(a), Count(b), kNever)) {}

  std::vector<int> Run() {
    // Children come behind their parents.
    for (Eigen::Index i = costs_.rows() - 1; i >= 0; --i) {
      for (Eigen::Index j = costs_.cols() - 1; j >= 0; --j)
        costs_(i, j) = CalcCost(static_cast<int>(i), static_cast<int>(j));
    }
    std::vector<int> match(static_cast<size_t>(costs_.rows()), -1);
    if (Assign(-1, -1, nullptr) == kNever) return {};
    Take(-1, -1, &match);
    return match;
  }

 private:
  static Eigen::Index Count(const RobotDescription& robot) { return std::ssize(robot.spec.joints); }

  /// How much two joints differ with all that hangs on them.
  [[nodiscard]] double CalcCost(int i, int j) const {
    const Joint& x = a_.spec->joints[static_cast<size_t>(i)];
    const Joint& y = b_.spec->joints[static_cast<size_t>(j)];
    const bool is_other = x.name != y.name && (a_.index_of.contains(y.name) || b_.index_of.contains(x.name));
    if (x.type != y.type || is_other) return kNever;
    return CompareNumbers(static_cast<size_t>(i), static_cast<size_t>(j)) + Assign(i, j, nullptr);
  }

  [[nodiscard]] double CompareNumbers(size_t i, size_t j) const {
    const Joint& x = a_.spec->joints[i];
    const Joint& y = b_.spec->joints[j];
    // Each file chooses freely where a joint's frame is along its axis.
    const Vector3d apart = a_.poses[i + 1].translation() - b_.poses[j + 1].translation();
    double cost = 0.5 * (a_.axes[i] - b_.axes[j]).norm() +
                  apart.cross(a_.axes[i]).norm() / std::max(a_.length, b_.length) +
                  CompareSizes(x.body.mass, y.body.mass);
    if ((*a_.described)[i].states_range && (*b_.described)[j].states_range)
      cost += 0.5 * (CompareSizes(x.lower, y.lower) + CompareSizes(x.upper, y.upper));
    return cost;
  }

  /// The least that the children of two links differ by; `order` gets the child of j for each of i.
  double Assign(int i, int j, std::vector<int>* order) const {
    const std::vector<int>& own = a_.children[static_cast<size_t>(i + 1)];
    const std::vector<int>& other = b_.children[static_cast<size_t>(j + 1)];
    if (own.size() != other.size() || own.size() > kMostChildren) return kNever;
    // Least cost of the first children of i with each set of those of j, and who was last.
    const size_t sets = size_t{1} << own.size();
    std::vector<double> least(sets, kNever);
    std::vector<size_t> last(sets, 0);
    least[0] = 0.0;
    for (size_t set = 1; set < sets; ++set) {
      const int first = own[static_cast<size_t>(__builtin_popcountll(set)) - 1];
      for (size_t k = 0; k < other.size(); ++k) {
        if ((set >> k & 1U) == 0) continue;
        const double cost = least[set ^ (size_t{1} << k)] + costs_(first, other[k]);
        if (cost >= least[set]) continue;
        least[set] = cost;
        last[set] = k;
      }
    }
    if (order != nullptr) {
      order->resize(own.size());
      for (size_t set = sets - 1, n = own.size(); n > 0; set ^= size_t{1} << last[set])
        (*order)[--n] = other[last[set]];
    }
    return least.back();
  }

  void Take(int i, int j, std::vector<int>* match) const {
    if (i >= 0) (*match)[static_cast<size_t>(i)] = j;
    std::vector<int> order;
    Assign(i, j, &order);
    const std::vector<int>& own = a_.children[static_cast<size_t>(i + 1)];
    for (size_t k = 0; k < own.size(); ++k) Take(own[k], order[k], match);
  }

  Tree a_, b_;
  MatrixXd costs_;  // of joint i of a and j of b, with what hangs on them
};

}  // namespace

std::vector<int> MatchByStructure(const RobotDescription& a, const RobotDescription& b) {
  return StructureMatch(a, b).Run();
}

}  // namespace dexcheck
