#include "harness/descriptions/conventions.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <type_traits>
#include <utility>

namespace dexcheck {
namespace {

struct Factor {
  const char* id;
  double right;  ///< Right is this times what is given.
  const char* words;
};
constexpr double kPound = 0.45359237;
constexpr double kInch = 0.0254;
constexpr double kDegree = kPi / 180.0;
constexpr Factor kLengths[] = {{"mm", 1e-3, "as if in mm"},
                               {"cm", 1e-2, "as if in cm"},
                               {"inch", kInch, "as if in inches"},
                               {"per_1000", 1e3, "divided by 1000"}};
constexpr Factor kMasses[] = {{"g", 1e-3, "as if in g"},
                              {"lb", kPound, "as if in lb"},
                              {"per_1000", 1e3, "divided by 1000"},
                              {"halved", 2.0, "halved"},
                              {"doubled", 0.5, "doubled"}};
constexpr Factor kInertias[] = {{"g_mm2", 1e-9, "as if in g mm^2"},
                                {"g_cm2", 1e-7, "as if in g cm^2"},
                                {"kg_mm2", 1e-6, "as if in kg mm^2"},
                                {"kg_cm2", 1e-4, "as if in kg cm^2"},
                                {"g_m2", 1e-3, "as if in g m^2"},
                                {"lb_in2", kPound* kInch* kInch, "as if in lb in^2"},
                                {"lb_m2", kPound, "as if in lb m^2"},
                                {"per_1e9", 1e9, "divided by 10^9, as if g mm^2 were made of kg m^2"},
                                {"per_1e6", 1e6, "divided by 10^6, as if kg mm^2 were made of kg m^2"},
                                {"per_1000", 1e3, "divided by 1000"},
                                {"halved", 2.0, "halved"},
                                {"doubled", 0.5, "doubled"}};

/// Axis i of what is given is axis right[i] of what is right.
struct Order {
  const char* id;
  std::array<int, 3> right;
  const char* words;
  const char* of_axes;
};
constexpr Order kOrders[] = {
    {"swap_xy", {1, 0, 2}, "with x and y exchanged", "with the axes x and y exchanged"},
    {"swap_xz", {2, 1, 0}, "with x and z exchanged", "with the axes x and z exchanged"},
    {"swap_yz", {0, 2, 1}, "with y and z exchanged", "with the axes y and z exchanged"},
    {"yzx", {1, 2, 0}, "in the order y, z, x", "with the axes in the order y, z, x"},
    {"zxy", {2, 0, 1}, "in the order z, x, y", "with the axes in the order z, x, y"}};

Vector3d UndoOrder(const Order& order, const Vector3d& given) {
  Vector3d right;
  for (size_t i = 0; i < 3; ++i) right[order.right[i]] = given[static_cast<int>(i)];
  return right;
}

/// But for what rotations leave by rounding.
bool IsDiagonal(const Matrix3d& I) {
  constexpr double kRounding = 1e-12;  // of the trace
  const Matrix3d products = I - Matrix3d(I.diagonal().asDiagonal());
  return products.cwiseAbs().maxCoeff() <= kRounding * std::abs(I.trace());
}

/// Principal moments in their order by size along the right one's principal axes.
Matrix3d TurnToAxesOf(const Matrix3d& right, Vector3d moments) {
  std::sort(moments.begin(), moments.end());
  const Eigen::SelfAdjointEigenSolver<Matrix3d> principal(right);
  return principal.eigenvectors() * moments.asDiagonal() * principal.eigenvectors().transpose();
}

/// Six numbers in another order than xx, yy, zz, xy, xz, yz: the place where each belongs.
struct NumberOrder {
  const char* id;
  std::array<size_t, 6> place;
  const char* words;
};
constexpr NumberOrder kNumberOrders[] = {
    {"by_rows", {0, 3, 4, 1, 5, 2}, "with its six numbers in the order xx, xy, xz, yy, yz, zz"},
    {"by_columns", {0, 3, 1, 4, 5, 2}, "with its six numbers in the order xx, xy, yy, xz, yz, zz"},
    {"products_yz_xz_xy", {0, 1, 2, 5, 4, 3}, "with the products in the order yz, xz, xy"},
    {"products_xy_yz_xz", {0, 1, 2, 3, 5, 4}, "with the products in the order xy, yz, xz"},
    {"products_xz_xy_yz", {0, 1, 2, 4, 3, 5}, "with the products in the order xz, xy, yz"}};

Matrix3d UndoOrder(const NumberOrder& order, const Matrix3d& I) {
  const std::array<double, 6> given = {I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2)};
  std::array<double, 6> n{};
  for (size_t i = 0; i < 6; ++i) n[order.place[i]] = given[i];
  return MakeTensor(n);
}

Matrix3d UndoOrder(const Order& order, const Matrix3d& I) {
  Matrix3d right;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j)
      right(order.right[i], order.right[j]) = I(static_cast<int>(i), static_cast<int>(j));
  }
  return right;
}

Vector3d Read(Quantity of, const StatedPart& part) {
  return of == Quantity::kCom ? part.body.com : of == Quantity::kAxis ? part.axis : part.X_PL.translation();
}
void Write(Quantity of, const Vector3d& v, StatedPart* part) {
  if (of == Quantity::kCom) part->body.com = v;
  if (of == Quantity::kAxis) part->axis = v;
  if (of == Quantity::kOrigin) part->X_PL.translation() = v;
}

class TableMaker {
 public:
  std::vector<Convention> MakeConventions() {
    AddConstants();
    AddCentres();
    AddVectors(Quantity::kCom, "com.");
    AddInertias();
    AddPlaces();
    AddVectors(Quantity::kOrigin, "origin.");
    AddVectors(Quantity::kAxis, "axis.");
    AddRotations();
    return std::move(table_);
  }

  std::vector<Convention> MakeMountings() {
    static constexpr const char* kTurns[] = {"a quarter", "half", "a quarter"};
    for (int axis = 0; axis < 3; ++axis) {
      for (int quarters = 1; quarters < 4; ++quarters) {
        const std::string name = std::string(quarters == 2 ? "base.half_" : "base.quarter_") + "xyz"[axis];
        const std::string words = std::string("turned ") + kTurns[quarters - 1] + " about " + "xyz"[axis];
        Add(name, Quantity::kRotation, words, [axis, quarters](StatedPart& p, const StatedPart&) {
          p.X_PL.linear() =
              (p.X_PL.linear() * Eigen::AngleAxisd(-0.5 * kPi * quarters, Vector3d::Unit(axis))).eval();
        });
      }
    }
    AddVectors(Quantity::kOrigin, "base.origin_");
    for (Convention convention : ListConventions()) {
      const bool is_turn = convention.of == Quantity::kRotation || convention.of == Quantity::kPlace;
      if (!is_turn && convention.id != "origin.missing") continue;
      convention.id = "base." + convention.id;
      table_.push_back(convention);
    }
    return std::move(table_);
  }

 private:
  /// An entry that changes the part, or says that it cannot be wrong so.
  template <typename Change>
  void Add(std::string id, Quantity of, std::string words, const Change& change) {
    const auto undo = [change](const StatedPart& given,
                               const StatedPart& right) -> std::optional<StatedPart> {
      StatedPart part = given;
      if constexpr (std::is_void_v<decltype(change(part, right))>) {
        change(part, right);
      } else if (!change(part, right)) {
        return std::nullopt;
      }
      return part;
    };
    table_.push_back({std::move(id), of, std::move(words), undo});
  }

  /// Of an inertia as a tensor along the axes C in which the file gives it.
  template <typename Undo>
  void AddTensor(const std::string& id, const std::string& words, const Undo& undo) {
    Add("inertia." + id, Quantity::kInertia, words, [undo](StatedPart& p, const StatedPart& right) {
      const Matrix3d& R = p.R_LC;
      const std::optional<Matrix3d> I =
          undo(R.transpose() * p.body.inertia * R, R.transpose() * right.body.inertia * R);
      if (I) p.body.inertia = R * *I * R.transpose();
      return I.has_value();
    });
  }

  void AddConstants() {
    for (const Factor& unit : kMasses) {
      Add(std::string("mass.") + unit.id, Quantity::kMass, unit.words,
          [&unit](StatedPart& p, const StatedPart&) { p.body.mass *= unit.right; });
    }
    Add("range.degrees", Quantity::kRange, "as if in degrees", [](StatedPart& p, const StatedPart&) {
      p.lower *= kDegree;
      p.upper *= kDegree;
    });
    Add("range.sign", Quantity::kRange, "turned around (its sign)",
        [](StatedPart& p, const StatedPart&) { std::tie(p.lower, p.upper) = std::pair(-p.upper, -p.lower); });
    const auto add = [this](const char* id, Quantity of, const char* words, double StatedPart::*value,
                            double factor) {
      Add(id, of, words, [=](StatedPart& p, const StatedPart&) { p.*value *= factor; });
    };
    const auto add_missing = [this](const char* id, Quantity of, double StatedPart::*value) {
      Add(id, of, "missing", [=](StatedPart& p, const StatedPart& right) {
        if (p.*value != 0.0) return false;
        p.*value = right.*value;
        return true;
      });
    };
    add("damping.per_degree", Quantity::kDamping, "as if per degree (N m s/deg)", &StatedPart::damping,
        1.0 / kDegree);
    add("damping.per_radian", Quantity::kDamping, "as if times pi / 180", &StatedPart::damping, kDegree);
    add_missing("damping.missing", Quantity::kDamping, &StatedPart::damping);
    add("armature.g_cm2", Quantity::kArmature, "as if in g cm^2", &StatedPart::armature, 1e-7);
    add("armature.kg_mm2", Quantity::kArmature, "as if in kg mm^2", &StatedPart::armature, 1e-6);
    add_missing("armature.missing", Quantity::kArmature, &StatedPart::armature);
  }

  void AddCentres() {
    const auto add = [this](const char* id, const char* words, const auto& change) {
      Add(id, Quantity::kCom, words, change);
    };
    add("com.parent_frame", "as if given in the parent's frame",
        [](StatedPart& p, const StatedPart&) { p.body.com = p.X_PL.inverse() * p.body.com; });
    add("com.parent_axes", "as if given along the parent's axes", [](StatedPart& p, const StatedPart&) {
      p.body.com = (p.X_PL.linear().transpose() * p.body.com).eval();
    });
    add("com.not_parent_frame", "as if given in the link's frame, though the parent's is expected",
        [](StatedPart& p, const StatedPart&) { p.body.com = p.X_PL * p.body.com; });
    add("com.child_frame", "as if given in the next joint's frame",
        [](StatedPart& p, const StatedPart& right) {
          const auto distance = [&](const Pose& X) { return (X * p.body.com - right.body.com).norm(); };
          const auto best = std::ranges::min_element(
              p.X_LD, [&](const Pose& a, const Pose& b) { return distance(a) < distance(b); });
          if (best == p.X_LD.end()) return false;
          p.body.com = *best * p.body.com;
          return true;
        });
  }

  /// Of centres of mass, origins, axes.
  void AddVectors(Quantity of, const std::string& prefix) {
    const auto add = [&](const std::string& id, const std::string& words,
                         const std::function<Vector3d(Vector3d)>& undo) {
      Add(prefix + id, of, words,
          [of, undo](StatedPart& p, const StatedPart&) { Write(of, undo(Read(of, p)), &p); });
    };
    add("sign", "turned around (its sign)", [](const Vector3d& v) { return Vector3d(-v); });
    for (const Order& order : kOrders)
      add(order.id, order.words, [&order](const Vector3d& v) { return UndoOrder(order, v); });
    if (of == Quantity::kAxis) return;
    for (int k = 0; k < 3; ++k) {
      add(std::string("sign_") + "xyz"[k], std::string("with the sign of ") + "xyz"[k] + " turned around",
          [k](Vector3d v) {
            v[k] = -v[k];
            return v;
          });
    }
    // A number that is small by its unit alone is no zero.
    constexpr double kZero = 1e-9;  // m
    for (const Factor& unit : kLengths) {
      Add(prefix + unit.id, of, unit.words, [of, &unit](StatedPart& p, const StatedPart& right) {
        if (Read(of, right).norm() <= kZero) return false;
        Write(of, unit.right * Read(of, p), &p);
        return true;
      });
    }
  }

  void AddInertias() {
    const auto add = [this](const char* id, const char* words, const auto& change) {
      Add(id, Quantity::kInertia, words, change);
    };
    add("inertia.about_origin", "as if given about the link's origin instead of the centre of mass",
        [](StatedPart& p, const StatedPart&) {
          p.body.inertia -= CalcPointInertia(p.body.mass, p.body.com);
        });
    add("inertia.moved_twice", "as if moved from the link's origin to the centre of mass once too often",
        [](StatedPart& p, const StatedPart&) {
          p.body.inertia += CalcPointInertia(p.body.mass, p.body.com);
        });
    add("inertia.parent_axes", "as if given along the parent's axes", [](StatedPart& p, const StatedPart&) {
      p.body.inertia = (p.X_PL.linear().transpose() * p.body.inertia * p.X_PL.linear()).eval();
    });
    add("inertia.carrier_origin", "as if given about the origin of the link that carries it",
        [](StatedPart& p, const StatedPart&) {
          p.body.inertia -=
              CalcPointInertia(p.body.mass, p.X_PL.linear().transpose() * (p.X_PL * p.body.com));
        });
    AddTensor("product_sign", "with the products' sign turned around",
              [](const Matrix3d& I, const Matrix3d&) {
                return Matrix3d(2.0 * Matrix3d(I.diagonal().asDiagonal()) - I);
              });
    AddTensor("no_products", "without its products",
              [](const Matrix3d& I, const Matrix3d& right) -> std::optional<Matrix3d> {
                if (!IsDiagonal(I)) return std::nullopt;
                return I + right - Matrix3d(right.diagonal().asDiagonal());
              });
    AddTensor("no_axes", "of principal moments without their axes (the rotation of its frame is missing)",
              [](const Matrix3d& I, const Matrix3d& right) -> std::optional<Matrix3d> {
                if (!IsDiagonal(I) || IsDiagonal(right)) return std::nullopt;
                return TurnToAxesOf(right, I.diagonal());
              });
    for (const Order& order : kOrders)
      AddTensor(order.id, order.of_axes,
                [&order](const Matrix3d& I, const Matrix3d&) { return UndoOrder(order, I); });
    for (const NumberOrder& order : kNumberOrders)
      AddTensor(order.id, order.words,
                [&order](const Matrix3d& I, const Matrix3d&) { return UndoOrder(order, I); });
    for (const Factor& unit : kInertias)
      AddTensor(unit.id, unit.words,
                [&unit](const Matrix3d& I, const Matrix3d&) { return Matrix3d(unit.right * I); });
  }

  void AddPlaces() {
    Add("origin.link_axes", Quantity::kOrigin, "as if given along the link's axes instead of the parent's",
        [](StatedPart& p, const StatedPart&) {
          p.X_PL.translation() = (p.X_PL.linear() * p.X_PL.translation()).eval();
        });
    Add("axis.parent_axes", Quantity::kAxis, "as if given along the parent's axes",
        [](StatedPart& p, const StatedPart&) { p.axis = (p.X_PL.linear().transpose() * p.axis).eval(); });
    Add("place.inverse", Quantity::kPlace, "inverted (the parent's frame in the link's)",
        [](StatedPart& p, const StatedPart&) { p.X_PL = p.X_PL.inverse(); });
    Add("place.missing", Quantity::kPlace, "missing", [](StatedPart& p, const StatedPart& right) {
      if (!p.X_PL.isApprox(Pose::Identity())) return false;
      p.X_PL = right.X_PL;
      return true;
    });
    const auto add_missing = [this](const char* id, Quantity of, const char* words, const Vector3d& none) {
      Add(id, of, words, [of, none](StatedPart& p, const StatedPart& right) {
        if (Read(of, p) != none) return false;
        Write(of, Read(of, right), &p);
        return true;
      });
    };
    add_missing("origin.missing", Quantity::kOrigin, "missing", Vector3d::Zero());
    add_missing("axis.missing", Quantity::kAxis, "missing (x is taken then)", Vector3d::UnitX());
  }

  /// Of joints' places, and of the frames of inertias.
  void AddRotations() {
    for (const RotationFault& fault : ListRotationFaults()) {
      Add(std::string("rotation.") + fault.id, Quantity::kRotation, fault.words,
          [&fault](StatedPart& p, const StatedPart& right) {
            const std::optional<Matrix3d> R = Undo(fault, p.X_PL.linear(), right.X_PL.linear());
            if (R) p.X_PL.linear() = *R;
            return R.has_value();
          });
      Add(std::string("inertia.frame_") + fault.id, Quantity::kInertia,
          std::string("with the rotation of its frame ") + fault.words,
          [&fault](StatedPart& p, const StatedPart& right) {
            const std::optional<Matrix3d> R = Undo(fault, p.R_LC, right.R_LC);
            if (!R) return false;
            const Matrix3d turn = *R * p.R_LC.transpose();
            p.body.inertia = turn * p.body.inertia * turn.transpose();
            return true;
          });
    }
  }

  std::vector<Convention> table_;
};

}  // namespace

const std::vector<Convention>& ListConventions() {
  static const std::vector<Convention> table = TableMaker().MakeConventions();
  return table;
}

const std::vector<Convention>& ListMountings() {
  static const std::vector<Convention> table = TableMaker().MakeMountings();
  return table;
}

}  // namespace dexcheck
