#pragma once

// Terms that a program computes at a state, each a whole: what the protocol of programs has.

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "harness/descriptions/dynamics_provider.h"

namespace dexcheck {

/// Terms at one state, in the analytic model's coordinates q', xi of size n. What is not provided is empty.
struct TermResults {
  MatrixXd M;                       ///< M_bar', n x n.
  VectorXd coriolis;                ///< C_bar' xi
  VectorXd gravity;                 ///< Part of F_bar' due to gravity.
  VectorXd bias;                    ///< Their sum, the forces at xi_dot = 0.
  VectorXd friction;                ///< Part of F_bar' due to viscous damping.
  std::optional<double> kinetic;    ///< J
  std::optional<double> potential;  ///< J, above any level that stays the same.

  [[nodiscard]] bool Has(Term term) const { return Find(term).size() > 0; }
  /// Writes a term that it has.
  void Read(Term term, Eigen::Ref<MatrixXd> out) const { out = Find(term); }
  /// The forces, those that are empty too.
  [[nodiscard]] std::array<VectorXd*, 4> forces() { return {&coriolis, &gravity, &bias, &friction}; }
  /// Forms the bias of its parts where it is not provided.
  void AddBias() {
    if (bias.size() == 0 && coriolis.size() > 0 && gravity.size() > 0) bias = coriolis + gravity;
  }

 private:
  [[nodiscard]] Eigen::Map<const MatrixXd> Find(Term term) const;
};

/// A key under which programs and files give numbers: of no dimension, of n numbers, or of n rows of n.
struct ResultKey {
  const char* name;
  int dimensions;
};
inline constexpr ResultKey kResultKeys[] = {{"M", 2},
                                            {"C", 2},
                                            {"c", 1},
                                            {"g", 1},
                                            {"h", 1},
                                            {"friction", 1},
                                            {"kinetic_energy", 0},
                                            {"potential_energy", 0}};

/// Terms from the numbers of kResultKeys: c = C v without numbers of its own, h = c + g.
/// @param v n velocities. @param find the numbers of a key, row by row; none where it has none.
TermResults CollectTerms(const VectorXd& v, const std::function<std::vector<double>(const ResultKey&)>& find);

/// A provider that computes all that it has at once.
class ResultProvider : public DynamicsProvider {
 public:
  /// @param sample number of the state, counted from 0. @param q q'.
  virtual TermResults Evaluate(long sample, const VectorXd& q, const VectorXd& xi) = 0;

  void SetState(const DynamicsState& state) override { result_ = Evaluate(state.sample, state.q, state.xi); }
  [[nodiscard]] bool Has(Term term) const override { return result_.Has(term); }
  void Read(Term term, Eigen::Ref<MatrixXd> out) override { result_.Read(term, out); }
  [[nodiscard]] bool has_own_level() const override { return true; }

 private:
  TermResults result_;
};

/// Terms as functions of q' and xi, in the robot's own order of joints (of a floating base in MuJoCo's
/// convention). Those that are empty are not compared.
struct TermFunctions {
  std::string name = "functions";
  std::function<MatrixXd(const VectorXd& q)> M;                      ///< n x n, armature included.
  std::function<VectorXd(const VectorXd& q, const VectorXd& xi)> c;  ///< C xi
  std::function<VectorXd(const VectorXd& q)> g;                      ///< Forces that hold the robot still.
  std::function<VectorXd(const VectorXd& q, const VectorXd& xi)> h;  ///< c + g
  std::function<VectorXd(const VectorXd& q, const VectorXd& xi)> friction;  ///< Viscous.
};

/// The functions as a provider.
class FunctionProvider : public ResultProvider {
 public:
  FunctionProvider(TermFunctions functions, int size) : functions_(std::move(functions)), size_(size) {}
  [[nodiscard]] const std::string& name() const override { return functions_.name; }
  /// @throws InputError "NAME: TERM: must have n entries, got m".
  TermResults Evaluate(long sample, const VectorXd& q, const VectorXd& xi) override;

 private:
  void CheckSize(const char* term, Eigen::Index rows, Eigen::Index cols, Eigen::Index expected_cols) const;

  TermFunctions functions_;
  int size_;
};

// How libraries write the state of a floating base, and how terms go from one way to the other.

/// A way to write the base's pose and velocity. The default is this project's, which is MuJoCo's.
struct BaseConvention {
  enum class Position {
    kXyzWxyz,  ///< x, y, z, then the quaternion with its scalar first (MuJoCo).
    kXyzXyzw,  ///< x, y, z, then the quaternion with its scalar last (Pinocchio, ROS, Bullet).
    kWxyzXyz,  ///< The quaternion with its scalar first, then x, y, z (Drake, Simbody).
  };
  Position position = Position::kXyzWxyz;
  bool angular_first = false;   ///< The velocity is [angular; linear] (Drake, Simbody, Featherstone).
  bool linear_in_base = false;  ///< The origin's velocity is along the base's axes (Pinocchio).
  bool angular_in_world =
      false;  ///< The angular velocity is along the world's axes (Drake, Simbody, Bullet).

  bool operator==(const BaseConvention&) const = default;
};

/// "x y z qw qx qy qz; linear velocity in world axes, then angular velocity in the base's axes": a
/// convention in words.
std::string Describe(const BaseConvention& convention);

/// All that there are; the default first.
std::vector<BaseConvention> ListBaseConventions();

/// Converts state and terms of a floating base with joints behind it to another convention. The base's
/// entries come first: 7 of q', 6 of xi.
class BaseConversion {
 public:
  explicit BaseConversion(const BaseConvention& convention) : convention_(convention) {}

  /// q' and xi as the convention writes them.
  [[nodiscard]] VectorXd ConvertPositions(const VectorXd& q) const;
  [[nodiscard]] VectorXd ConvertVelocities(const VectorXd& q, const VectorXd& xi) const;

  /// Terms that were given in the convention at this state, in the default one. With xi' = B xi,
  ///   M = B^T M' B,  gravity = B^T gravity',  coriolis = B^T (coriolis' + M' B_dot xi),
  /// where B_dot xi = [-omega x v; 0] when the linear velocity is along the base's axes, and zero otherwise.
  /// A provider that has forces with velocities in them and no M cannot be converted then: they are left
  /// out.
  void Restore(const VectorXd& q, const VectorXd& xi, TermResults* terms) const;
  /// The other way: whole terms of the default convention in this one.
  void Apply(const VectorXd& q, const VectorXd& xi, TermResults* terms) const;

 private:
  [[nodiscard]] Matrix6d CalcB(const VectorXd& q) const;
  /// B_dot xi, of the size of xi.
  [[nodiscard]] VectorXd CalcRate(const VectorXd& q, const VectorXd& xi) const;

  BaseConvention convention_;
};

}  // namespace dexcheck
