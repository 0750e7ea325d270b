#pragma once

// Constants that are compared without motion, before anything else: gravity, masses, joints, couplings. Each
// side is read into one form, in which a constant that its file does not state is absent.

#include <array>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "harness/base/check_record.h"
#include "harness/base/worst.h"
#include "harness/descriptions/compiled_inertias.h"
#include "harness/descriptions/robot_description.h"

namespace dexcheck {

/// Two readers of decimal numbers form at most short sums and products of them.
inline constexpr double kConstantRounding = 64.0 * std::numeric_limits<double>::epsilon();

/// One number in which two files, or a model and an engine, differ.
struct ConstantFinding {
  std::string check;  ///< Name of the check, such as "link_mass".
  std::string where;  ///< Part of the robot, such as "link r_forearm".
  double model = 0.0;
  double engine = 0.0;
  Location location;
  /// Which of the numbers that the check compares there: of a vector, a range, a 3x3 tensor; -1 of a term.
  int entry = 0;
  std::string effect{};   ///< Its effect on the motion, when one of the two leaves it out.
  double scale = 0.0;     ///< Size that the difference is relative to; 0: the larger of the two numbers.
  double units = 0.0;     ///< Difference relative to the printed precision; infinite between exact numbers.
  bool is_cause = false;  ///< A constant, or a term of geometry or bodies, from which the other terms follow.
  /// Relative precision of a number that agrees within it, where that is too coarse for a verdict; else 0.
  double too_loose = 0.0;
};

/// Returns a check's quantity in words, "centre of mass" of "link_com"; the check's name where it has none.
std::string NameQuantity(const std::string& check);
/// Returns the component of a vector, tensor or range that a number is: "Ixx" of entry 0 of "link_inertia";
/// empty where the quantity is one number.
std::string NameComponent(const ConstantFinding& finding);
/// Returns the unit of a number, "kg"; empty where it is not known.
/// @param model whose locations it has; without one, a unit that depends on the joint's type is not known.
std::string UnitOf(const ConstantFinding& finding, const RobotModel* model);

/// Something that the MJCF sets and the analytic model has no number for, and that is no disagreement: it
/// belongs to the plant of a run, which overrides it or whose checks judge it.
struct ConstantNote {
  std::string kind;  ///< A kind of ListEngineFields, such as "contact_pair".
  std::string text;  ///< With the element's name and all its numbers.
};

struct ConstantChecks {
  std::vector<CheckRecord> records;
  std::vector<ConstantFinding> findings;  ///< Every disagreement, in the file's order.
  std::vector<ConstantNote> notes;
  std::vector<std::string> not_compared;  ///< Parts that only one of the two has, a line each.

  /// The check of that name, a new one when there is none.
  CheckRecord* Define(const std::string& check);
  /// Adds a disagreement, and its error to its check.
  void Add(ConstantFinding finding);
};

/// Compares two descriptions: gravity, mass of each link; damping, dry friction, armature, range and coupling
/// of each joint. Damping, friction or armature that one of them alone states is a finding, with its effect
/// on the motion. Locations are those of `a`.
/// @param a, b as CompleteEachOther left them.
ConstantChecks CheckConstants(const RobotDescription& a, const RobotDescription& b);

/// Compares the limits of the motors of joints, and the radii of wheels, where both descriptions state them.
/// Wheels are the last links of joints without limits, with a round shape about the joint's axis, on a base
/// that moves.
/// @param a, b with joints of the same names.
void CheckMotorsAndWheels(const RobotDescription& a, const RobotDescription& b, ConstantChecks* constants);

/// Compares the volumes of the links' shapes where both descriptions have them, on which no term depends.
/// @return one line on those that differ.
std::vector<std::string> CompareShapes(const RobotDescription& a, const RobotDescription& b);

/// Compares what no term depends on: velocity limits where both files state them, and mass and centre of mass
/// of a base that does not move, with all that is welded to it.
/// @return a line on each that differs in the first three digits.
std::vector<std::string> CompareWithoutEffect(const RobotDescription& a, const RobotDescription& b);

/// Judges checks by a relative tolerance where that is wider than their bound.
void JudgeByTolerance(double tolerance, std::vector<CheckRecord>* records);
/// Judges a result by a tolerance; its findings are then those that exceed it.
void JudgeByTolerance(double tolerance, ConstantChecks* constants);

// Numbers of a model against another description's or the engine's, one check after the other.

inline Location AtLink(int link) { return {Location::Kind::kLink, link, -1}; }
inline Location AtJoint(int joint) { return {Location::Kind::kJoint, joint, -1}; }

class ConstantComparison {
 public:
  ConstantComparison(const RobotModel& model, ConstantChecks* result) : model_(model), result_(*result) {}

  /// Compares relative to the larger of the two, or to `scale` where zero is a proper value.
  void Compare(const std::string& check, const Location& where, double model, double engine,
               double scale = 0.0) {
    CheckRecord* const record = result_.Define(check);
    entry_ = check == last_check_ && where == last_location_ ? entry_ + 1 : 0;
    last_check_ = check;
    last_location_ = where;
    const double size = Worst(std::abs(model), std::abs(engine), scale);
    const double error = record->Compare(model, engine, size > 0.0 ? size : 1.0, where, -1);
    if (error > kConstantRounding) {
      result_.findings.push_back({check, DescribeWhere(where), model, engine, where, entry_, {}, size});
    }
  }
  [[nodiscard]] std::string DescribeWhere(const Location& where) const {
    return Describe(where, model_, model_.num_base_velocities());
  }
  [[nodiscard]] const Joint& JointOf(int joint) const { return model_.joint(joint); }

 protected:
  const RobotModel& model_;
  ConstantChecks& result_;

 private:
  std::string last_check_;
  Location last_location_;
  int entry_ = 0;
};

/// The constants of a mechanism that one side states, joints in the order of the model that both are
/// compared in.
struct StatedConstants {
  struct OfJoint {
    std::vector<std::optional<double>> numbers;  ///< By ListDescribedConstants.
    std::optional<std::array<double, 2>> range;
    std::optional<JointCoupling> coupling;
    std::optional<StatedForces> forces = {};  ///< Limits of the joint's motors.
    double wheel_radius = 0.0;                ///< Radius of the wheel that the joint turns, m; 0 without one.
  };
  std::string file;
  std::optional<Vector3d> gravity;
  std::vector<double> masses;  ///< The base with all that is welded to it, then each joint's link.
  std::vector<OfJoint> joints;

  /// Takes out what two files need not share, of kIgnorable.
  void LeaveOut(const std::vector<std::string>& ignore);
};

/// Reads a model, whose joints are in their own order, as if its file stated all.
StatedConstants ReadStated(const RobotModel& model);
/// Reads a description. @param reference whose joints of the same names have the order.
StatedConstants ReadStated(const RobotDescription& robot, const RobotSpec& reference);

/// Compares what two sides state.
class MechanismComparison : public ConstantComparison {
 public:
  MechanismComparison(const RobotModel& model, StatedConstants a, StatedConstants b, ConstantChecks* result)
      : ConstantComparison(model, result), a_(std::move(a)), b_(std::move(b)) {}

  /// Compares gravity, masses, constants and ranges that both state.
  void CompareShared();
  /// Adds constants that act on the motion and that one of the two alone states, each with its effect.
  void AddOneSided();
  /// @param by_engine the second is an engine's model, whose own couplings are noted and no finding.
  void CompareCouplings(bool by_engine);
  void CompareMotorsAndWheels();

 private:
  StatedConstants a_, b_;
};

// Mass centres and inertias of two descriptions, number by number, as their files print them.

/// Compares the centre of mass (check "link_com": x, y, z, m) and the inertia about it (check "link_inertia":
/// xx, yy, zz, xy, xz, yz, kg m^2) of each link that has mass in both descriptions. All numbers are expressed
/// in the link's own frame of `a`. Centres are relative to their distance from the link's origin or to the
/// link's radius of gyration, whichever is larger; inertias are relative to the largest moment. Locations are
/// those of `a`.
/// @param X_ab frames of `b` in those of `a`; none: the two files have the same.
ConstantChecks CompareBodies(const RobotDescription& a, const RobotDescription& b,
                             const std::vector<Pose>& X_ab = {});

/// Names what the compiler changed: in a note, at findings of masses, and by findings of inertias where the
/// other description has what the text states.
/// @param robots both descriptions, with joints of the same names. @param side of the MJCF: 0 or 1.
void NameCompiledChanges(const std::vector<CompiledChange>& changes,
                         const std::array<const RobotDescription*, 2>& robots, size_t side,
                         ConstantChecks* constants, std::vector<std::string>* notes);

}  // namespace dexcheck
