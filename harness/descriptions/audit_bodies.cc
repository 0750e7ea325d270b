// Bodies: are they possible, do they fit their geometry, are left and right equal?

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>

#include "controller/common/linear_algebra.h"
#include "controller/common/text.h"
#include "controller/dynamics/torque_regressor.h"
#include "controller/model/rigid_body.h"
#include "harness/descriptions/audit.h"
#include "harness/descriptions/compiled_inertias.h"

namespace dexcheck {
namespace {

/// Four digits: what a person reads.
std::string Format(double value) { return fmt::format("{:.4g}", value); }
std::string Format(const Vector3d& v) { return fmt::format("[{:.4g}, {:.4g}, {:.4g}]", v[0], v[1], v[2]); }

class BodyAudit {
 public:
  BodyAudit(const RobotDescription& robot, std::vector<AuditFinding>* findings)
      : robot_(robot), findings_(*findings) {
    for (const Joint& joint : robot.spec.joints)
      reach_ += joint.X_PB.translation().norm() + std::abs(joint.mdh.a) + std::abs(joint.mdh.d);
  }

  void Run() {
    for (const DescribedPart& part : robot_.parts) AuditPart(part);
  }

 private:
  void Add(AuditLevel level, const std::string& check, const DescribedPart& part, const std::string& text) {
    findings_.push_back({level, check, "link " + part.name, part.line, text, {}, part.joint});
  }

  void AuditPart(const DescribedPart& part) {
    const MassProperties& body = part.body;
    if (part.largest_angle > 2.0 * kPi)
      Add(AuditLevel::kSuspicious, "offset", part,
          "is turned by " + Format(part.largest_angle) + " rad: as if angles were in degrees");
    if (!part.states_inertial) {
      if (!part.shapes.empty() && part.joint >= 0) {
        Add(AuditLevel::kNote, "inertial", part, "has geometry but no inertial: taken as massless");
      }
      return;
    }
    if (!AuditInertia(part) || body.mass <= 0.0) return;
    AuditSize(part);
    // Far beyond all joints: centres of mass in mm or cm.
    constexpr double kFar = 3.0, kLink = 1.0;  // m, of a link without further joints
    if (body.com.norm() > kFar * (reach_ + kLink))
      Add(AuditLevel::kSuspicious, "com", part,
          "has its centre of mass " + Format(body.com.norm()) +
              " m from its frame, beyond the robot's reach of " + Format(reach_) +
              " m: as if it were in mm or cm");
    if (!part.shapes.empty()) AuditGeometry(part);
  }

  /// @return whether anything more can be said.
  bool AuditInertia(const DescribedPart& part) {
    const MassProperties& body = part.body;
    if (!std::isfinite(body.mass) || !body.inertia.allFinite() || !body.com.allFinite()) {
      Add(AuditLevel::kImpossible, "inertia", part, "has an inertial that is not finite");
      return false;
    }
    if (body.mass < 0.0) {
      Add(AuditLevel::kImpossible, "mass", part, "has a negative mass, " + Format(body.mass) + " kg");
      return false;
    }
    const Vector3d moments = CalcMoments(body.inertia);
    if (body.mass == 0.0) {
      if (!body.inertia.isZero(0.0)) {
        Add(AuditLevel::kImpossible, "inertia", part,
            "has inertia " + Format(moments) + " kg m^2 without mass");
      }
      return false;
    }
    if (body.inertia.isZero(0.0)) {
      Add(AuditLevel::kSuspicious, "inertia", part,
          "has " + Format(body.mass) + " kg without inertia: a point mass");
      return false;
    }
    const std::string problem = FindPhysicalInconsistency(body);
    if (!problem.empty()) {
      std::string text = "has principal moments " + Format(moments) + " kg m^2";
      if (moments[0] < 0.0) {
        text += ", one of them negative";
      } else {
        text += ": the largest exceeds the sum of the others by " +
                Format(100.0 * (moments[2] / (moments[0] + moments[1]) - 1.0)) + " %";
      }
      Add(AuditLevel::kImpossible, "inertia", part,
          text + " (least eigenvalue of the pseudo-inertia " +
              Format(CalcSymmetricEigenvalues(CalcPseudoInertia(TorqueRegressor::Pack(body)))[0]) + ")");
      return false;
    }
    return true;
  }

  /// The uniform ellipsoid that has the body's mass and inertia: half axes a_i^2 = 5 / (2 m) (I_j + I_k -
  /// I_i).
  void AuditSize(const DescribedPart& part) {
    const MassProperties& body = part.body;
    const Vector3d moments = CalcMoments(body.inertia);
    const Vector3d squares = (2.5 / body.mass) * Vector3d(moments[1] + moments[2] - moments[0],
                                                          moments[2] + moments[0] - moments[1],
                                                          moments[0] + moments[1] - moments[2]);
    const Vector3d axes = squares.cwiseMax(0.0).cwiseSqrt();
    constexpr double kThin = 1e-3;  // of the longest axis: a plate or rod, which has no density
    if (axes.minCoeff() < kThin * axes.maxCoeff()) return;
    const double density = body.mass / (4.0 / 3.0 * std::numbers::pi * axes.prod());
    // Foam has 10 kg/m^3 and tungsten 19,300; hollow shells look larger than they are, by less than ten
    // times.
    constexpr double kLightest = 2.0;
    constexpr double kHeaviest = 1e5;
    if (density >= kLightest && density <= kHeaviest) return;
    Add(AuditLevel::kSuspicious, "inertia", part,
        "has the inertia of an ellipsoid with half axes " + Format(axes) + " m, which is " +
            (density < kLightest ? "large" : "small") + " for its " + Format(body.mass) + " kg (" +
            Format(density) + " kg/m^3): " + (density < kLightest ? "too large" : "too small") +
            " by a factor that a wrong unit has?");
  }

  void AuditGeometry(const DescribedPart& part) {
    const MassProperties& body = part.body;
    double volume = 0.0;
    Vector3d low = Vector3d::Constant(std::numeric_limits<double>::infinity());
    Vector3d high = -low;
    bool is_known = true;
    for (const DescribedShape& shape : part.shapes) {
      is_known = is_known && shape.volume > 0.0;
      volume += shape.volume;
      low = low.cwiseMin(shape.low);
      high = high.cwiseMax(shape.high);
    }
    if (!is_known) return;
    const double density = body.mass / volume;
    // Boxes around open structures are mostly air; parts of steel may be drawn smaller than they are.
    constexpr double kLightest = 10.0;
    constexpr double kHeaviest = 25000.0;
    if (density < kLightest || density > kHeaviest) {
      Add(AuditLevel::kSuspicious, "density", part,
          "has " + Format(body.mass) + " kg in a geometry of " + Format(volume) + " m^3: " + Format(density) +
              " kg/m^3");
    }
    const double size = (high - low).norm();
    const double beyond = ((low - body.com).cwiseMax(body.com - high)).maxCoeff();
    constexpr double kMargin = 0.1;  // of the geometry's diagonal
    if (beyond > kMargin * size) {
      Add(AuditLevel::kSuspicious, "com", part,
          "has its centre of mass " + Format(body.com) + " m outside of its geometry, by " + Format(beyond) +
              " m");
    }
    // Between two walls the second moment about the centre is largest with all mass at the walls.
    const Vector3d spread = (body.com - low).cwiseProduct(high - body.com).cwiseMax(0.0);
    Eigen::Index axis = 0;
    (body.inertia.diagonal() - body.mass * (Vector3d::Constant(spread.sum()) - spread)).maxCoeff(&axis);
    const double largest = body.inertia(axis, axis), most = body.mass * (spread.sum() - spread[axis]);
    MassProperties as_of_origin = body;
    as_of_origin.inertia -= CalcPointInertia(body.mass, body.com);
    const bool is_of_origin = FindPhysicalInconsistency(as_of_origin).empty();
    // Covers and cables that the geometry leaves out are far from where one would be about the origin.
    const double allowance = is_of_origin ? 1.05 : 1.5;
    if (largest > allowance * most) {
      Add(AuditLevel::kSuspicious, "inertia", part,
          "has a moment of inertia of " + Format(largest) +
              " kg m^2, more than its mass can have within its geometry, " + Format(most) + " kg m^2" +
              (is_of_origin ? ": as if it were about the link's origin" : ""));
    }
  }

  const RobotDescription& robot_;
  std::vector<AuditFinding>& findings_;
  double reach_ = 0.0;  // m, sum of the joints' offsets
};

/// Words that stand for one side, and the other side's.
constexpr const char* kSides[][2] = {{"left", "right"}, {"l", "r"},   {"fl", "fr"}, {"rl", "rr"},
                                     {"hl", "hr"},      {"bl", "br"}, {"lf", "rf"}, {"lh", "rh"}};

/// The name of the part on the other side, for a part on the left: its first word that says so is replaced.
/// Empty for others. Words end at _ - . : / blanks and where a capital letter follows a small one.
std::string FindMirrorName(const std::string& name) {
  const auto is_letter = [](char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0; };
  const auto is_small = [](char c) { return std::islower(static_cast<unsigned char>(c)) != 0; };
  for (size_t begin = 0; begin < name.size();) {
    if (!is_letter(name[begin])) {
      ++begin;
      continue;
    }
    size_t end = begin + 1;
    while (end < name.size() && is_letter(name[end]) && !(is_small(name[end - 1]) && !is_small(name[end]))) {
      ++end;
    }
    const std::string word = name.substr(begin, end - begin);
    for (const auto& [left, right] : kSides) {
      if (ToLower(word) != left) continue;
      std::string other = right;
      for (size_t i = 0; i < other.size(); ++i) {
        const char model = word[std::min(i, word.size() - 1)];
        if (!is_small(model))
          other[i] = static_cast<char>(std::toupper(static_cast<unsigned char>(other[i])));
      }
      return name.substr(0, begin) + other + name.substr(end);
    }
    begin = end;
  }
  return "";
}

class MirrorAudit {
 public:
  MirrorAudit(const RobotDescription& robot, std::vector<AuditFinding>* findings)
      : robot_(robot), findings_(*findings) {}

  void Run() {
    std::map<std::string, const DescribedPart*> part_of;
    for (const DescribedPart& part : robot_.parts) part_of.emplace(part.name, &part);
    for (const DescribedPart& left : robot_.parts) {
      const auto right = part_of.find(FindMirrorName(left.name));
      if (right != part_of.end()) ComparePair(left, *right->second);
    }
  }

 private:
  void Add(const DescribedPart& left, const DescribedPart& right, const std::string& text) {
    findings_.push_back({AuditLevel::kSuspicious, "mirror", "link " + right.name, right.line,
                         text + " (against " + left.name + ")"});
  }

  void ComparePair(const DescribedPart& left, const DescribedPart& right) {
    if (left.states_inertial != right.states_inertial) {
      Add(left, right,
          right.states_inertial ? "has an inertial, the other side has none" : "has no inertial");
      return;
    }
    const MassProperties& a = left.body;
    const MassProperties& b = right.body;
    if (!left.states_inertial || !(a.mass > 0.0) || !(b.mass > 0.0)) return;
    constexpr double kSame = 0.01;  // real robots' sides differ by a cable or a rounding
    if (std::abs(a.mass - b.mass) > kSame * std::max(a.mass, b.mass)) {
      Add(left, right, "has " + Format(b.mass) + " kg, the other side " + Format(a.mass) + " kg");
    }
    const Vector3d moments_a = CalcMoments(a.inertia);
    const Vector3d moments_b = CalcMoments(b.inertia);
    const double size = std::max(moments_a.maxCoeff(), moments_b.maxCoeff());
    if ((moments_a - moments_b).cwiseAbs().maxCoeff() > kSame * size) {
      Add(left, right,
          "has principal moments " + Format(moments_b) + " kg m^2, the other side " + Format(moments_a));
      return;
    }
    constexpr double kSamePlace = 1e-3;  // m
    const double length = std::max(a.com.norm(), b.com.norm());
    const double allowance = kSamePlace + kSame * length;
    if (std::abs(a.com.norm() - b.com.norm()) > allowance) {
      Add(left, right,
          "has its centre of mass at " + Format(b.com) + " m, the other side at " + Format(a.com));
      return;
    }
    CompareSigns(left, right, allowance, kSame * size);
  }

  /// A mirror along the link's axes that takes one centre of mass to the other must take the inertia too.
  void CompareSigns(const DescribedPart& left, const DescribedPart& right, double com_allowance,
                    double inertia_allowance) {
    const MassProperties& a = left.body;
    const MassProperties& b = right.body;
    bool com_fits = false;
    for (int signs = 0; signs < 8; ++signs) {
      const Vector3d s((signs & 1) != 0 ? -1.0 : 1.0, (signs & 2) != 0 ? -1.0 : 1.0,
                       (signs & 4) != 0 ? -1.0 : 1.0);
      if ((s.asDiagonal() * a.com - b.com).cwiseAbs().maxCoeff() > com_allowance) continue;
      com_fits = true;
      const Matrix3d mirrored = s.asDiagonal() * a.inertia * s.asDiagonal();
      if ((mirrored - b.inertia).cwiseAbs().maxCoeff() <= inertia_allowance) return;
    }
    if (!com_fits) return;  // its frame is turned: nothing can be said of signs
    Add(left, right,
        "has products of inertia " + Format(Vector3d(b.inertia(0, 1), b.inertia(0, 2), b.inertia(1, 2))) +
            " kg m^2 with signs that no mirror gives the other side's " +
            Format(Vector3d(a.inertia(0, 1), a.inertia(0, 2), a.inertia(1, 2))));
  }

  const RobotDescription& robot_;
  std::vector<AuditFinding>& findings_;
};

}  // namespace

void AuditBodies(const RobotDescription& robot, std::vector<AuditFinding>* findings) {
  BodyAudit(robot, findings).Run();
}

void AuditMirrors(const RobotDescription& robot, std::vector<AuditFinding>* findings) {
  MirrorAudit(robot, findings).Run();
}

}  // namespace dexcheck
