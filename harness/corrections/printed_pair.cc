#include "harness/corrections/printed_pair.h"

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <utility>

namespace dexcheck {
namespace {

GivenNode MeasureNode(const Node& node, PrintedRobot* robot) {
  return {CalcNodePose(*robot, node), CalcPoseTolerance(node, robot), CalcNodeBody(*robot, node),
          CalcBodyTolerance(node, robot)};
}

std::vector<GivenNode> MeasureNodes(const std::vector<Node>& nodes, PrintedRobot* robot) {
  std::vector<GivenNode> given(nodes.size());
  for (const Node& node : nodes) {
    if (node.link >= 0) given[static_cast<size_t>(node.link)] = MeasureNode(node, robot);
  }
  return given;
}

/// The link that a joint of that name moves; -1 where there is none.
int FindMoved(const PrintedRobot& robot, const std::string& joint) {
  return IndexOf(robot.links, std::pair(true, joint),
                 [](const PrintedLink& link) { return std::pair(Moves(link), link.joint.name); });
}

/// Accuracy of frames that are found from what links carry, m and rad.
constexpr double kFoundFrame = 2e-6;

double CompareVectors(const Vector3d& difference, const Vector3d& open) {
  return (difference.cwiseAbs().array() / open.array()).maxCoeff();
}

}  // namespace

bool Differ(const PrintedScalar& a, const PrintedScalar& b) {
  constexpr double kRounding = 1e-9;
  return !(std::abs(a.value - b.value) <=
           (a.half + b.half) * (1.0 + kRounding) + kRounding * std::abs(b.value));
}

PrintedPair::PrintedPair(PrintedRobot a, PrintedRobot b, MatchBy by) : a_(std::move(a)), b_(std::move(b)) {
  // A URDF does not say how a motor makes its force, and its reductions are no gears of another file.
  if (a_.format == RobotFormat::kUrdf || b_.format == RobotFormat::kUrdf) {
    for (PrintedRobot* const robot : {&a_, &b_}) {
      std::erase_if(robot->constraints, [](const std::string& text) { return text.starts_with(kServo); });
      if (a_.format == b_.format || robot->format != RobotFormat::kUrdf) continue;
      robot->has_motors = false;
      for (PrintedLink& link : robot->links)
        link.joint.scalars[static_cast<size_t>(JointScalar::kGear)].reset();
    }
  }
  match_ = MatchLinks(a_, b_, by);
  nodes_ = ListNodes(a_, match_.b_of_a);
  nodes_b_ = ListNodes(b_, match_.a_of_b);
  for (int i = 0; i < a_.size(); ++i) {
    if (Partner(i) >= 0 && node(i).link >= 0 && node_b(Partner(i)).link >= 0) links_.push_back(i);
  }
  other_ = MeasureNodes(nodes_b_, &b_);
  X_ab_.assign(a_.links.size(), Pose::Identity());
  Measure();
}

void PrintedPair::Measure() {
  given_ = MeasureNodes(nodes_, &a_);
  SetFrames(std::move(X_ab_));
}

void PrintedPair::MeasureOther(int link) {
  const auto j = static_cast<size_t>(Partner(link));
  other_[j] = MeasureNode(nodes_b_[j], &b_);
  SetRight(link);
}

int PrintedPair::Carrier(int link) const {
  const int parent = node(link).parent;
  return parent >= 0 && Partner(parent) >= 0 && Partner(parent) == node_b(Partner(link)).parent ? parent : -1;
}

bool PrintedPair::IsPlaced(int link) const {
  if (Partner(link) < 0) return false;
  const bool is_free =
      a_.link(link).joint.kind == JointKind::kFree && b_.link(Partner(link)).joint.kind == JointKind::kFree;
  if (is_free || Carrier(link) >= 0) return !is_free;
  // A root that is not the other file's stands in the world as what the file has there.
  const auto in_world = [](const PrintedRobot& robot, const Node& node, const std::vector<int>& other) {
    return !robot.floats.value_or(false) && !Moves(robot.link(node.link)) &&
           (node.parent < 0 || (node.parent == 0 && other[0] < 0));
  };
  return in_world(a_, node(link), match_.b_of_a) && in_world(b_, node_b(Partner(link)), match_.a_of_b);
}

void PrintedPair::SetFrames(std::vector<Pose> X_ab) {
  X_ab_ = std::move(X_ab);
  right_.assign(a_.links.size(), {});
  frame_open_.assign(a_.links.size(), {});
  for (const int link : links_) SetRight(link);
}

void PrintedPair::SetRight(int link) {
  const int j = Partner(link);
  const GivenNode& theirs = other(j);
  const PrintedJoint& joint = b_.link(j).joint;
  const Pose& X = X_ab_[static_cast<size_t>(link)];
  const Matrix3d& R = X.linear();
  RightNode& right = right_[static_cast<size_t>(link)];
  PoseTolerance& open = frame_open_[static_cast<size_t>(link)];
  right = {};
  right.is_placed = IsPlaced(link);
  if (right.is_placed) {
    const int carrier = Carrier(link);
    const Pose X_ab_P = carrier < 0 ? Pose::Identity() : X_ab_[static_cast<size_t>(carrier)];
    const PoseTolerance open_P = carrier < 0 ? PoseTolerance{} : frame_open_[static_cast<size_t>(carrier)];
    right.X = X_ab_P * theirs.X * X.inverse();
    right.pose = theirs.pose;
    right.pose.length = X_ab_P.linear().cwiseAbs() * theirs.pose.length + open_P.length;
    right.pose.length.array() += open_P.angle * theirs.X.translation().norm();
    right.pose.angle += open_P.angle;
    if (!X.isApprox(Pose::Identity(), 1e-12)) {
      const GivenNode& ours = given_[static_cast<size_t>(link)];
      open = right.pose;
      open.length += ours.pose.length;
      open.angle += ours.pose.angle;
      if (!right.X.isApprox(ours.X, 1e-9)) {  // it was found from what the link carries
        open.length += ours.body_tolerance.com + R.cwiseAbs() * theirs.body_tolerance.com;
        open.length.array() += kFoundFrame;
        open.angle += kFoundFrame;
      }
      right.pose.length += open.length;
      right.pose.angle += open.angle;
    }
  }
  right.axis = R * joint.axis.normalized();
  right.axis_tolerance = joint.half_axis.sum() / std::max(joint.axis.norm(), 1e-9) + 1e-8 + open.angle;
  right.anchor = X * joint.anchor;
  right.anchor_tolerance = open.length.norm() + open.angle * joint.anchor.norm();
  right.body = ExpressIn(theirs.body, X);
  right.body_tolerance = theirs.body_tolerance;
  if (!R.isIdentity(1e-12)) {
    const Matrix3d turn = R.cwiseAbs();
    right.body_tolerance.com = turn * theirs.body_tolerance.com;
    right.body_tolerance.inertia = turn * theirs.body_tolerance.inertia * turn.transpose();
  }
  right.body_tolerance.com += open.length;
  right.body_tolerance.com.array() += open.angle * theirs.body.com.norm();
  right.body_tolerance.inertia.array() += 2.0 * open.angle * std::abs(theirs.body.inertia.trace());
}

double PrintedPair::CompareNode(SiteKind kind, int link, const GivenNode& now, double* deviation) const {
  const RightNode& right = right_[static_cast<size_t>(link)];
  const MassProperties &body = now.body, &tolerance = now.body_tolerance;
  const auto keep = [&](double distance) {
    if (deviation != nullptr) *deviation = distance;
    return distance;
  };
  const auto compare = [&](const Vector3d& apart, const Vector3d& open) {
    keep(apart.norm());
    return CompareVectors(apart, open);
  };
  switch (kind) {
    case SiteKind::kPosition:
      return compare(now.X.translation() - right.X.translation(), now.pose.length + right.pose.length);
    case SiteKind::kRotation:
      return keep(CalcAngle(now.X.linear().transpose() * right.X.linear())) /
             (now.pose.angle + right.pose.angle);
    case SiteKind::kMass:
      return keep(std::abs(body.mass - right.body.mass)) /
             (tolerance.mass + right.body_tolerance.mass + 1e-15);
    case SiteKind::kCom:
      return compare(body.com - right.body.com, tolerance.com + right.body_tolerance.com);
    case SiteKind::kInertia: {
      keep((body.inertia - right.body.inertia).norm());
      const auto scaled = [&](double scale) {
        return ((scale * body.inertia - right.body.inertia).cwiseAbs().array() /
                (tolerance.inertia + right.body_tolerance.inertia).array())
            .maxCoeff();
      };
      // A mass within its digits' tolerance may have been another one when the inertia was computed from it.
      const bool is_open = body.mass > 0.0 && std::abs(body.mass - right.body.mass) <=
                                                  tolerance.mass + right.body_tolerance.mass;
      return is_open ? std::min(scaled(1.0), scaled(right.body.mass / body.mass)) : scaled(1.0);
    }
    default:
      return keep(0.0);
  }
}

bool PrintedPair::States(const PrintedRobot& robot, JointScalar scalar) {
  return std::ranges::any_of(robot.links, [&](const PrintedLink& link) {
    const auto& number = link.joint.scalars[static_cast<size_t>(scalar)];
    return number && number->value != 0.0;
  });
}

std::optional<PrintedScalar> TakeScalar(const PrintedLink& link, JointScalar scalar, bool has_motors) {
  const std::optional<PrintedScalar>& number = link.joint.scalars[static_cast<size_t>(scalar)];
  const bool is_limit = scalar == JointScalar::kEffort || scalar == JointScalar::kVelocity;
  if (number || is_limit || (scalar == JointScalar::kGear && !has_motors)) return number;
  return PrintedScalar{};
}

bool PrintedPair::IsCoupledAlike(int link) const {
  // q1 = 2 q3 says what q3 = q1 / 2 says.
  const auto is_inverse = [&](int follower, int leader_b) {
    const PrintedMimic& mimic = *a_.link(follower).joint.mimic;
    const int leader = FindMoved(a_, mimic.leader);
    if (leader < 0 || Partner(leader) != leader_b || a_.link(leader).joint.mimic) return false;
    const std::optional<PrintedMimic>& other = b_.link(leader_b).joint.mimic;
    constexpr double kSame = 1e-6;
    return other && FindMoved(b_, other->leader) == Partner(follower) &&
           !b_.link(Partner(follower)).joint.mimic &&
           std::abs(mimic.multiplier.value * other->multiplier.value - 1.0) <= kSame &&
           mimic.offset.value == 0.0 && other->offset.value == 0.0;
  };
  const PrintedJoint& ours = a_.link(link).joint;
  const PrintedJoint& theirs = b_.link(Partner(link)).joint;
  if (ours.mimic && !theirs.mimic) {
    const int leader = FindMoved(a_, ours.mimic->leader);
    return leader >= 0 && Partner(leader) >= 0 && is_inverse(link, Partner(leader));
  }
  if (!ours.mimic && theirs.mimic) {
    const int leader_b = FindMoved(b_, theirs.mimic->leader);
    const int follower = leader_b < 0 ? -1 : match_.a_of_b[static_cast<size_t>(leader_b)];
    return follower >= 0 && a_.link(follower).joint.mimic && is_inverse(follower, Partner(link));
  }
  return false;
}

void PrintedPair::ListJointSites(int link, std::vector<Site>* sites) const {
  const PrintedJoint& ours = a_.link(link).joint;
  const PrintedJoint& theirs = b_.link(Partner(link)).joint;
  const auto add = [&](SiteKind kind) { sites->push_back({kind, link}); };
  if (ours.kind != theirs.kind) add(SiteKind::kType);
  const bool has_axis = HasAxis(a_.link(link)) && HasAxis(b_.link(Partner(link)));
  if (!Moves(a_.link(link)) || (ours.kind != theirs.kind && !has_axis)) return;
  const RightNode& right = right_[static_cast<size_t>(link)];
  const double open = ours.half_axis.sum() / std::max(ours.axis.norm(), 1e-9) + right.axis_tolerance;
  if (has_axis && !((ours.axis.normalized() - right.axis).norm() <= open)) add(SiteKind::kAxis);
  if (ours.kind != theirs.kind) return;
  if (ours.kind != JointKind::kSlide) {
    constexpr double kSame = 2e-6;  // m
    Vector3d apart = ours.anchor - right.anchor;
    const double along = has_axis ? right.axis.dot(apart) : 0.0;  // each point of an axis stands for it
    apart -= along * right.axis;
    if (!(apart.norm() <= kSame + right.anchor_tolerance + std::abs(along) * open +
                              given_[static_cast<size_t>(link)].pose.length.norm()))
      add(SiteKind::kAxisPoint);
  }
  const auto limits = [](const PrintedRobot& robot) {
    return std::ranges::any_of(robot.links, [](const PrintedLink& l) { return l.joint.range.has_value(); });
  };
  if (ours.range && theirs.range) {
    if (Differ((*ours.range)[0], (*theirs.range)[0]) || Differ((*ours.range)[1], (*theirs.range)[1]))
      add(SiteKind::kRange);
  } else if (ours.range.has_value() != theirs.range.has_value() &&
             (AreMjcfs() || (limits(a_) && limits(b_)))) {
    add(SiteKind::kRange);
  }
  ListConstantSites(link, sites);
  if (IsCoupledAlike(link)) return;
  if (ours.mimic.has_value() != theirs.mimic.has_value()) {
    add(SiteKind::kMimic);
  } else if (ours.mimic) {
    const int leader = FindMoved(a_, ours.mimic->leader);
    const int partner = leader < 0 ? -1 : Partner(leader);
    const bool same_leader = partner >= 0 ? b_.link(partner).joint.name == theirs.mimic->leader
                                          : ours.mimic->leader == theirs.mimic->leader;
    if (!same_leader || Differ(ours.mimic->multiplier, theirs.mimic->multiplier) ||
        Differ(ours.mimic->offset, theirs.mimic->offset))
      add(SiteKind::kMimic);
  }
}

void PrintedPair::ListConstantSites(int link, std::vector<Site>* sites) const {
  const PrintedLink& ours = a_.link(link);
  const PrintedLink& theirs = b_.link(Partner(link));
  const auto is_spring = [](const PrintedLink& l) {
    const auto& stiffness = l.joint.scalars[static_cast<size_t>(JointScalar::kStiffness)];
    return stiffness && stiffness->value != 0.0;
  };
  const bool has_motors = a_.has_motors && b_.has_motors;
  // A file without motors is driven by forces at the joints: only the way of a motor counts there.
  const auto turns_back = [](const std::optional<PrintedScalar>& gear) { return gear && gear->value < 0.0; };
  for (size_t k = 0; k < kNumJointScalars; ++k) {
    const auto scalar = static_cast<JointScalar>(k);
    const std::optional<PrintedScalar> x = TakeScalar(ours, scalar, has_motors);
    const std::optional<PrintedScalar> y = TakeScalar(theirs, scalar, has_motors);
    bool differs = x && y && Differ(*x, *y);
    if (scalar == JointScalar::kGear && !(x && y)) differs = turns_back(x) || turns_back(y);
    if (scalar == JointScalar::kSpringAngle) differs = differs && is_spring(ours) && is_spring(theirs);
    if (differs) sites->push_back({ToSite(scalar), link});
  }
}

PrintedMotor PrintedPair::FindRight(PrintedMotor motor) const {
  const PrintedMotor* const other = FindIn(b_.motors, motor.name, &PrintedMotor::name);
  if (other == nullptr) return motor;
  const int link = match_.a_of_b[static_cast<size_t>(other->link)];
  if (link >= 0) motor.link = link;
  if (!motor.servo.empty() && !other->servo.empty()) motor.servo = other->servo;
  return motor;
}

void PrintedPair::ListRobotSites(std::vector<Site>* sites) const {
  for (int i = 0; i < a_.size(); ++i) {
    if (Moves(a_.link(i)) && Partner(i) < 0) sites->push_back({SiteKind::kPresence, i});
  }
  for (int j = 0; j < b_.size(); ++j) {
    if (Moves(b_.link(j)) && match_.a_of_b[static_cast<size_t>(j)] < 0)
      sites->push_back({SiteKind::kPresence, -1 - j});
  }
  if (a_.gravity && b_.gravity && (*a_.gravity - *b_.gravity).cwiseAbs().maxCoeff() > 1e-9)
    sites->push_back({SiteKind::kGravity, 0});
  // Free joints of two MJCFs are compared as those of links.
  if (a_.floats && b_.floats && *a_.floats != *b_.floats && !AreMjcfs())
    sites->push_back({SiteKind::kType, 0});
  if (RenameConstraints(a_) != b_.constraints) sites->push_back({SiteKind::kConstraint, 0});
  const auto is_other = [&](const PrintedMotor& motor) { return FindRight(motor) != motor; };
  if (std::ranges::any_of(a_.motors, is_other)) sites->push_back({SiteKind::kMotor, 0});
}

std::vector<std::string> PrintedPair::RenameConstraints(const PrintedRobot& a) const {
  std::map<std::string, std::string> names;
  for (const int i : links_) {
    if (Moves(a.link(i))) names.emplace(a.link(i).joint.name, b_.link(Partner(i)).joint.name);
    names.emplace(a.link(i).name, b_.link(Partner(i)).name);
  }
  std::vector<std::string> renamed;
  for (const std::string& constraint : a.constraints) {
    std::string& text = renamed.emplace_back();
    for (size_t begin = 0; begin < constraint.size();) {
      const size_t end = std::min(constraint.find_first_of(" :,", begin), constraint.size());
      const std::string word = constraint.substr(begin, end - begin);
      const auto other = names.find(word);
      text += (other == names.end() ? word : other->second) + constraint.substr(end, end < constraint.size());
      begin = end + 1;
    }
  }
  std::ranges::sort(renamed);
  return renamed;
}

std::vector<Site> PrintedPair::ListSites() const {
  std::vector<Site> sites;
  std::set<std::string> names, names_b;
  for (const auto& [robot, all] : {std::pair(&a_, &names), std::pair(&b_, &names_b)}) {
    for (const PrintedLink& link : robot->links)
      all->insert({"joint " + link.joint.name, "link " + link.name});
  }
  const auto compare = [&](SiteKind kind, int link) {
    if (!(CompareNode(kind, link) <= 1.0)) sites.push_back({kind, link});
  };
  for (const int link : links_) {
    const int j = Partner(link);
    if (IsPlaced(link)) {
      compare(SiteKind::kPosition, link);
      compare(SiteKind::kRotation, link);
    }
    if (Carrier(link) >= 0) {
      ListJointSites(link, &sites);
    } else if (!IsPlaced(link) && node(link).parent >= 0 && node_b(j).parent >= 0) {
      sites.push_back({SiteKind::kCarrier, link});
    }
    const PrintedLink& ours = a_.link(link);
    const PrintedLink& theirs = b_.link(j);
    const auto is_exchanged = [&](const std::string& name, const std::string& other) {
      return name != other && names.contains(other) && names_b.contains(name);
    };
    if (Moves(ours) && Moves(theirs)) {
      if (is_exchanged("joint " + ours.joint.name, "joint " + theirs.joint.name))
        sites.push_back({SiteKind::kName, link});
      if (is_exchanged("link " + ours.name, "link " + theirs.name))
        sites.push_back({SiteKind::kLinkName, link});
    }
    // A base that stands still needs no inertial beside a file of another form, whose base is the world.
    const bool is_same_base = link == 0 && j == 0 && a_.format == RobotFormat::kUrdf &&
                              b_.format == RobotFormat::kUrdf && ours.name == theirs.name;
    const bool bears =
        is_same_base || !(link == 0 || j == 0) || (!node(link).parts.empty() && !node_b(j).parts.empty());
    if (!bears || (node(link).parts.empty() && node_b(j).parts.empty())) continue;
    for (const SiteKind kind : kBodyKinds) compare(kind, link);
  }
  ListRobotSites(&sites);
  return sites;
}

}  // namespace dexcheck
