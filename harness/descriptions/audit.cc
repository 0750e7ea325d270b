#include "harness/descriptions/audit.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "controller/common/linear_algebra.h"
#include "controller/common/text.h"
#include "controller/dynamics/model_terms.h"
#include "controller/model/rigid_body.h"
#include "harness/descriptions/alike_names.h"
#include "harness/descriptions/compiled_inertias.h"
#include "harness/descriptions/random_states.h"

namespace dexcheck {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kLongest = 10.0;  // m, of an offset or a slide

/// The body in whose place a file's would not stand out: a uniform solid sphere of its mass and the density
/// of water, at its centre of mass.
MassProperties MakePlausibleBody(const MassProperties& body) {
  constexpr double kDensityOfWater = 1000.0;  // kg/m^3
  constexpr double kLeastMass = 1e-3;         // kg, of a part that has none
  MassProperties plausible = body;
  if (!(plausible.mass > 0.0) || !std::isfinite(plausible.mass)) plausible.mass = kLeastMass;
  if (!plausible.com.allFinite()) plausible.com.setZero();
  const double radius = std::cbrt(3.0 * plausible.mass / (4.0 * std::numbers::pi * kDensityOfWater));
  plausible.inertia = CalcUniformInertia(SolidSphere{radius}, plausible.mass);
  return plausible;
}

/// The whole bodies that joints move, some of which no body can have.
struct Bodies {
  RobotSpec spec;                ///< With plausible bodies in the place of impossible ones.
  std::vector<Matrix3d> excess;  ///< By link, base first: inertia that the file has beyond those.
};

Bodies MakePossible(const RobotSpec& spec) {
  Bodies bodies{spec, {}};
  const auto repair = [&](MassProperties* body) {
    Matrix3d excess = Matrix3d::Zero();
    if (!FindPhysicalInconsistency(*body).empty()) {
      const MassProperties plausible = MakePlausibleBody(*body);
      excess = body->inertia - plausible.inertia;
      *body = plausible;
    }
    bodies.excess.push_back(excess);
  };
  repair(&bodies.spec.base.body);
  for (Joint& joint : bodies.spec.joints) repair(&joint.body);
  return bodies;
}

/// Median over random states of the condition number of M.
double CalcCondition(const RobotSpec& spec) {
  Bodies bodies = MakePossible(spec);
  // M is linear in the inertias: those that no body can have are added by the Jacobians of their links.
  std::vector<std::pair<int, Matrix3d>> added;
  bodies.spec.frames.clear();
  for (size_t link = 0; link < bodies.excess.size(); ++link) {
    if (bodies.excess[link].isZero(0.0)) continue;
    added.emplace_back(static_cast<int>(bodies.spec.frames.size()), bodies.excess[link]);
    bodies.spec.frames.push_back(
        {"link" + std::to_string(link), static_cast<int>(link) - 1, Pose::Identity(), {}});
  }
  const RobotModel model(bodies.spec);
  ModelTerms terms(model);
  const int n = model.num_velocities();
  if (n == 0) return 1.0;
  constexpr int kStates = 21;
  StateSource source(model, {}, 1);
  VectorXd q = VectorXd::Zero(model.num_positions());
  const VectorXd at_rest = VectorXd::Zero(n);
  Matrix6Xd J(6, n);
  Matrix6Xd J_dot(6, n);
  // Coupled joints are one coordinate.
  const MatrixXd T = CalcCouplingMap(model);
  std::vector<double> conditions;
  for (int state = 0; state < kStates; ++state) {
    source.DrawPositions(&q);
    terms.SetState(q, at_rest);
    terms.CalcDynamics();
    MatrixXd M = terms.M();
    for (const auto& [frame, excess] : added) {
      terms.CalcFrameJacobian(frame, J, J_dot);
      M += J.bottomRows<3>().transpose() * excess * J.bottomRows<3>();
    }
    const VectorXd eigenvalues = CalcSymmetricEigenvalues(T.transpose() * M * T);
    const double least = eigenvalues.minCoeff();
    const double largest = eigenvalues.maxCoeff();
    // Below rounding of the largest, an eigenvalue is zero.
    const bool is_singular =
        least <= largest * static_cast<double>(n) * std::numeric_limits<double>::epsilon();
    conditions.push_back(is_singular ? kInfinity : largest / least);
  }
  return Median(std::move(conditions));
}

class JointAudit {
 public:
  JointAudit(const RobotDescription& robot, std::vector<AuditFinding>* findings)
      : robot_(robot), spec_(robot.spec), findings_(*findings) {}

  void Run() {
    for (size_t i = 0; i < spec_.joints.size(); ++i) {
      AuditOffset(i);
      AuditRange(i);
      AuditAxis(i);
      AuditDamping(i);
    }
    AuditBodiesAlike();
    AuditLoads();
    AuditNames();
  }

 private:
  AuditFinding& Add(AuditLevel level, const std::string& check, size_t joint, const std::string& text) {
    const int line = robot_.joints[joint].line;
    return findings_.emplace_back(
        AuditFinding{level, check, "joint " + spec_.joints[joint].name, line, text});
  }

  void AuditOffset(size_t i) {
    const Joint& joint = spec_.joints[i];
    const double length = joint.X_PB.translation().norm() + std::abs(joint.mdh.a) + std::abs(joint.mdh.d);
    if (length > kLongest)
      Add(AuditLevel::kSuspicious, "offset", i,
          "stands " + FormatNumber(length, 3) + " m from the joint before it: as if lengths were in mm");
    const double angle = robot_.joints[i].largest_angle;
    if (angle > 2.0 * kPi)
      Add(AuditLevel::kSuspicious, "offset", i,
          "is turned by " + FormatNumber(angle, 4) + " rad: as if angles were in degrees");
  }

  void AuditDamping(size_t i) {
    constexpr double kMost = 1e4;  // N m s/rad or N s/m, far beyond any gear or rail
    if (spec_.joints[i].damping > kMost)
      Add(AuditLevel::kSuspicious, "damping", i,
          "has a damping of " + FormatNumber(spec_.joints[i].damping, 4) + ": nothing would move it");
  }

  /// Placeholders: several links with one mass and one inertia.
  void AuditBodiesAlike() {
    constexpr size_t kFewest = 3;
    const size_t count = spec_.joints.size();
    if (count < kFewest) return;
    const MassProperties& first = spec_.joints.front().body;
    const bool are_alike = first.mass > 0.0 && std::ranges::all_of(spec_.joints, [&](const Joint& one) {
                             return one.body.mass == first.mass &&
                                    CalcMoments(one.body.inertia).isApprox(CalcMoments(first.inertia));
                           });
    if (are_alike)
      Add(AuditLevel::kNote, "mass", 0,
          "and all others move " + FormatNumber(first.mass, 4) +
              " kg with the same inertia: as if nobody had "
              "measured them");
  }

  void AuditRange(size_t i) {
    const Joint& joint = spec_.joints[i];
    if (!robot_.joints[i].states_range) return;
    const std::string range = FormatNumbers(Vector2d(joint.lower, joint.upper));
    const bool is_revolute = joint.type != JointType::kPrismatic;
    const double widest = std::max(std::abs(joint.lower), std::abs(joint.upper));
    constexpr double kMostTurns = 8.0 * kPi;  // four turns either way; 30 degrees are more
    if (joint.lower == joint.upper) {
      Add(AuditLevel::kSuspicious, "range", i, "range " + range + ": the joint cannot move");
    } else if (is_revolute && widest > kMostTurns) {
      Add(AuditLevel::kSuspicious, "range", i, "range " + range + " rad: as if it were in degrees");
    } else if (!is_revolute && widest > kLongest) {
      Add(AuditLevel::kSuspicious, "range", i, "range " + range + " m: as if it were in mm");
    } else if (joint.lower > 0.0 || joint.upper < 0.0) {
      Add(AuditLevel::kNote, "range", i, "range " + range + ": zero is outside");
    }
  }

  void AuditAxis(size_t i) {
    const double length = robot_.joints[i].axis_length;
    constexpr double kUnitVectorAllowance = 1e-4;  // of the digits that people write
    if (std::abs(length - 1.0) <= kUnitVectorAllowance) return;
    Add(AuditLevel::kSuspicious, "axis", i,
        "axis of length " + FormatNumber(length) + ": must be a unit vector");
  }

  /// About an axis through the frame's origin, the one about which it is least, kg m^2.
  static double CalcLeastInertia(const MassProperties& body) {
    const Matrix3d about_origin = body.inertia + CalcPointInertia(body.mass, body.com);
    return CalcMoments(about_origin)[0];
  }

  /// Audits the mass that each joint moves.
  void AuditLoads() {
    const size_t count = spec_.joints.size();
    std::vector<double> mass(count, 0.0);
    std::vector<double> inertia(count, 0.0);
    std::vector<bool> is_end(count, true);
    for (size_t i = count; i-- > 0;) {
      const Joint& joint = spec_.joints[i];
      mass[i] += joint.body.mass;
      inertia[i] += joint.body.inertia.trace() + joint.body.mass * joint.body.com.squaredNorm();
      if (joint.parent < 0) continue;
      const auto parent = static_cast<size_t>(joint.parent);
      is_end[parent] = false;
      mass[parent] += mass[i];
      inertia[parent] += mass[i];  // somewhere beyond: not zero
    }
    for (size_t i = 0; i < count; ++i) {
      const Joint& joint = spec_.joints[i];
      const bool is_ball = joint.type == JointType::kBall;
      if (joint.armature > 0.0) continue;
      const std::string end = is_end[i] ? ", the end of a chain" : "";
      if (mass[i] <= 0.0) {
        Add(AuditLevel::kSuspicious, "load", i, "moves no mass" + end + ": M is singular").body =
            static_cast<int>(i);
        continue;
      }
      if (joint.type == JointType::kPrismatic || !is_end[i]) continue;
      // About the axis, z of frame i: I_zz + m (x^2 + y^2). A ball turns about any axis: the least of all.
      const MassProperties& body = joint.body;
      const double about_axis = is_ball ? CalcLeastInertia(body)
                                        : body.inertia(2, 2) + body.mass * body.com.head<2>().squaredNorm();
      constexpr double kNothing = 1e-12;  // kg m^2: a sphere of 0.1 g with a radius of 0.2 mm
      if (about_axis > kNothing) continue;
      Add(AuditLevel::kSuspicious, "load", i,
          "turns " + FormatNumber(body.mass) + " kg without inertia about " +
              (is_ball ? "one of its axes" : "its axis") + end + ": M is singular or nearly so")
          .body = static_cast<int>(i);
    }
  }

  void AuditNames() {
    std::map<std::string, std::string> links;
    std::map<std::string, std::string> joints;
    const auto check = [&](std::map<std::string, std::string>* known, const std::string& kind,
                           const std::string& name, int line) {
      AuditFinding finding{AuditLevel::kSuspicious, "name", kind + " " + name, line};
      if (name.front() == ' ' || name.back() == ' ') {
        finding.text = "its name begins or ends with a blank";
        findings_.push_back(finding);
      }
      const auto [other, is_new] = known->emplace(SimplifyName(name), name);
      if (is_new || SimplifyName(name).empty()) return;
      finding.text = "its name is that of " + Quote(other->second) + " but for case and punctuation";
      findings_.push_back(finding);
    };
    for (const DescribedPart& part : robot_.parts) check(&links, "link", part.name, part.line);
    for (size_t i = 0; i < spec_.joints.size(); ++i) {
      check(&joints, "joint", spec_.joints[i].name, robot_.joints[i].line);
    }
    for (const std::string& name : robot_.unused) {
      findings_.push_back({AuditLevel::kNote, "name", name, 0, "nothing uses it"});
    }
  }

  const RobotDescription& robot_;
  const RobotSpec& spec_;
  std::vector<AuditFinding>& findings_;
};

/// Condition numbers, with and without each finding about a body.
void AuditCondition(const RobotDescription& robot, AuditResult* result) {
  result->condition = CalcCondition(robot.spec);
  std::map<int, double> without;  // by body
  for (AuditFinding& finding : result->findings) {
    const bool is_moving =
        finding.body >= 0 || (finding.body == -1 && robot.spec.base.type != BaseType::kFixed);
    if (!is_moving || finding.level == AuditLevel::kNote) continue;
    if (!without.contains(finding.body)) {
      RobotSpec spec = robot.spec;
      BodyOf(spec, finding.body) = MakePlausibleBody(BodyOf(spec, finding.body));
      without[finding.body] = CalcCondition(spec);
    }
    finding.condition_without = without[finding.body];
  }
}

}  // namespace

const char* NameOf(AuditLevel level) {
  if (level == AuditLevel::kImpossible) return "impossible";
  return level == AuditLevel::kSuspicious ? "suspicious" : "note";
}

bool AuditResult::IsGood() const {
  return std::ranges::all_of(findings,
                             [](const AuditFinding& finding) { return finding.level == AuditLevel::kNote; });
}

AuditResult AuditRobot(const RobotDescription& robot) {
  AuditResult result;
  AuditBodies(robot, &result.findings);
  AuditMirrors(robot, &result.findings);
  JointAudit(robot, &result.findings).Run();
  AuditCondition(robot, &result);
  std::ranges::stable_sort(result.findings,
                           [](const AuditFinding& a, const AuditFinding& b) { return a.level < b.level; });
  return result;
}

}  // namespace dexcheck
