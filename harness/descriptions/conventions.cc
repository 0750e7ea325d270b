#include "harness/descriptions/conventions.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>

#include "controller/common/text.h"
#include "controller/model/body_frame.h"
#include "harness/descriptions/parameter_writer.h"

namespace dexcheck {
namespace {

using Table = std::vector<Convention>;

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
};
constexpr Order kOrders[] = {{"swap_xy", {1, 0, 2}, "with x and y exchanged"},
                             {"swap_xz", {2, 1, 0}, "with x and z exchanged"},
                             {"swap_yz", {0, 2, 1}, "with y and z exchanged"},
                             {"yzx", {1, 2, 0}, "in the order y, z, x"},
                             {"zxy", {2, 0, 1}, "in the order z, x, y"}};

Vector3d UndoOrder(const Order& order, const Vector3d& given) {
  Vector3d right;
  for (size_t i = 0; i < 3; ++i) right[order.right[i]] = given[static_cast<int>(i)];
  return right;
}

// Rotations: as angles roll, pitch, yaw and as quaternions.

Matrix3d Turn(int axis, double angle) {
  return Eigen::AngleAxisd(angle, Vector3d::Unit(axis)).toRotationMatrix();
}
Matrix3d FromAngles(const Vector3d& rpy) { return Turn(2, rpy[2]) * Turn(1, rpy[1]) * Turn(0, rpy[0]); }
Matrix3d InOtherOrder(const Vector3d& rpy) { return Turn(0, rpy[0]) * Turn(1, rpy[1]) * Turn(2, rpy[2]); }
Matrix3d FromQuaternion(double w, double x, double y, double z) {
  return Eigen::Quaterniond(w, x, y, z).toRotationMatrix();
}
bool IsSame(const Matrix3d& a, const Matrix3d& b) {
  constexpr double kSame = 1e-6;
  return (a - b).cwiseAbs().maxCoeff() < kSame;
}

/// What makes the given rotation right, or what makes a right one so: one of the two may be unknown, and
/// angles are not unique where the pitch is a quarter turn.
struct RotationFault {
  const char* id;
  const char* words;
  Matrix3d (*undo)(const Matrix3d& given);
  Matrix3d (*apply)(const Matrix3d& right);
};
Matrix3d FromSignedAngles(const Matrix3d& R) { return FromAngles(-CalcRollPitchYaw(R)); }
Matrix3d FromReversedAngles(const Matrix3d& R) { return FromAngles(CalcRollPitchYaw(R).reverse()); }
Matrix3d ToOtherOrder(const Matrix3d& R) { return InOtherOrder(CalcRollPitchYaw(R)); }
Matrix3d FromOtherOrder(const Matrix3d& R) { return FromAngles(-CalcRollPitchYaw(R.transpose())); }
Matrix3d Quarter(const Matrix3d& R) {
  const Eigen::Quaterniond q(R);
  return FromQuaternion(q.z(), q.w(), q.x(), q.y());
}
Matrix3d QuarterBack(const Matrix3d& R) {
  const Eigen::Quaterniond q(R);
  return FromQuaternion(q.x(), q.y(), q.z(), q.w());
}
const RotationFault kRotations[] = {
    {"transposed", "turned the other way (transposed)",
     [](const Matrix3d& R) { return Matrix3d(R.transpose()); }, nullptr},
    {"degrees", "as if its angles were in degrees, though radians are expected", nullptr,
     [](const Matrix3d& R) { return FromAngles(CalcRollPitchYaw(R) / kDegree); }},
    {"radians", "as if its angles were in radians, though degrees are expected",
     [](const Matrix3d& R) { return FromAngles(CalcRollPitchYaw(R) / kDegree); }, nullptr},
    {"missing", "missing", nullptr, [](const Matrix3d&) { return Matrix3d(Matrix3d::Identity()); }},
    {"unneeded", "as if the file should have none",
     [](const Matrix3d&) { return Matrix3d(Matrix3d::Identity()); }, nullptr},
    {"other_order", "as if its roll, pitch and yaw were taken in the other order", FromOtherOrder,
     ToOtherOrder},
    {"meant_other_order", "as if its roll, pitch and yaw were meant in the other order", ToOtherOrder,
     FromOtherOrder},
    {"ypr", "as if yaw, pitch and roll stood in the place of roll, pitch and yaw", FromReversedAngles,
     FromReversedAngles},
    {"sign", "with the sign of its angles turned around", FromSignedAngles, FromSignedAngles},
    {"xyzw", "as if its quaternion were written x, y, z, w and read w, x, y, z", Quarter, nullptr},
    {"wxyz", "as if its quaternion were written w, x, y, z and read x, y, z, w", QuarterBack, nullptr}};

std::optional<Matrix3d> Undo(const RotationFault& fault, const Matrix3d& given, const Matrix3d& right) {
  if (fault.apply != nullptr && IsSame(fault.apply(right), given)) return right;
  if (fault.undo == nullptr) return std::nullopt;
  return fault.undo(given);
}

/// An entry that changes a copy of the part.
template <typename Change>
void Add(std::string id, Quantity of, std::string words, const Change& change, Table* table) {
  table->push_back({std::move(id), of, std::move(words),
                    [change](const StatedPart& given, const StatedPart& right) -> std::optional<StatedPart> {
                      StatedPart part = given;
                      if (!change(&part, right)) return std::nullopt;
                      return part;
                    }});
}

// Vectors: centres of mass, origins, axes.

Vector3d Read(Quantity of, const StatedPart& part) {
  return of == Quantity::kCom ? part.body.com : of == Quantity::kAxis ? part.axis : part.X_PL.translation();
}
void Write(Quantity of, const Vector3d& v, StatedPart* part) {
  if (of == Quantity::kCom) part->body.com = v;
  if (of == Quantity::kAxis) part->axis = v;
  if (of == Quantity::kOrigin) part->X_PL.translation() = v;
}

void AddVectors(Quantity of, const std::string& prefix, Table* table) {
  const auto add = [&](const std::string& id, const std::string& words,
                       const std::function<Vector3d(const Vector3d&)>& undo) {
    Add(
        prefix + id, of, words,
        [of, undo](StatedPart* part, const StatedPart&) {
          Write(of, undo(Read(of, *part)), part);
          return true;
        },
        table);
  };
  add("sign", "turned around (its sign)", [](const Vector3d& v) { return Vector3d(-v); });
  for (int k = 0; k < 3 && of != Quantity::kAxis; ++k) {
    add(std::string("sign_") + "xyz"[k], std::string("with the sign of ") + "xyz"[k] + " turned around",
        [k](Vector3d v) {
          v[k] = -v[k];
          return v;
        });
  }
  for (const Order& order : kOrders)
    add(order.id, order.words, [&order](const Vector3d& v) { return UndoOrder(order, v); });
  if (of == Quantity::kAxis) return;
  for (const Factor& unit : kLengths)
    add(unit.id, unit.words, [&unit](const Vector3d& v) { return Vector3d(unit.right * v); });
}

void AddFrames(Table* table) {
  const auto com = [&](const char* id, const char* words, Vector3d (*undo)(const StatedPart&)) {
    Add(
        std::string("com.") + id, Quantity::kCom, words,
        [undo](StatedPart* part, const StatedPart&) {
          part->body.com = undo(*part);
          return true;
        },
        table);
  };
  com("parent_frame", "as if given in the parent's frame",
      [](const StatedPart& p) { return Vector3d(p.X_PL.inverse() * p.body.com); });
  com("parent_axes", "as if given along the parent's axes",
      [](const StatedPart& p) { return Vector3d(p.X_PL.linear().transpose() * p.body.com); });
  com("not_parent_frame", "as if given in the link's frame, though the parent's is expected",
      [](const StatedPart& p) { return Vector3d(p.X_PL * p.body.com); });
  Add(
      "com.child_frame", Quantity::kCom, "as if given in the next joint's frame",
      [](StatedPart* part, const StatedPart& right) {
        const Vector3d given = part->body.com;
        const auto distance = [&](const Pose& X) { return (X * given - right.body.com).norm(); };
        const auto best =
            std::min_element(part->X_LD.begin(), part->X_LD.end(),
                             [&](const Pose& a, const Pose& b) { return distance(a) < distance(b); });
        if (best == part->X_LD.end()) return false;
        part->body.com = *best * given;
        return true;
      },
      table);
  const auto place = [&](const char* id, Quantity of, const char* words, bool (*undo)(StatedPart*)) {
    Add(
        id, of, words, [undo](StatedPart* part, const StatedPart&) { return undo(part); }, table);
  };
  place("origin.link_axes", Quantity::kOrigin, "as if given along the link's axes instead of the parent's",
        [](StatedPart* part) {
          part->X_PL.translation() = (part->X_PL.linear() * part->X_PL.translation()).eval();
          return true;
        });
  place("place.inverse", Quantity::kPlace, "inverted (the parent's frame in the link's)",
        [](StatedPart* part) {
          part->X_PL = part->X_PL.inverse();
          return true;
        });
  Add(
      "place.missing", Quantity::kPlace, "missing",
      [](StatedPart* part, const StatedPart& right) {
        if (!part->X_PL.isApprox(Pose::Identity())) return false;
        part->X_PL = right.X_PL;
        return true;
      },
      table);
  place("axis.parent_axes", Quantity::kAxis, "as if given along the parent's axes", [](StatedPart* part) {
    part->axis = (part->X_PL.linear().transpose() * part->axis).eval();
    return true;
  });
  for (const Quantity of : {Quantity::kOrigin, Quantity::kAxis}) {
    const bool is_axis = of == Quantity::kAxis;
    const Vector3d none(is_axis ? 1.0 : 0.0, 0.0, 0.0);
    Add(
        is_axis ? "axis.missing" : "origin.missing", of, is_axis ? "missing (x is taken then)" : "missing",
        [of, none](StatedPart* part, const StatedPart& right) {
          if (Read(of, *part) != none) return false;
          Write(of, Read(of, right), part);
          return true;
        },
        table);
  }
}

void AddRotations(Table* table) {
  for (const RotationFault& fault : kRotations) {
    Add(
        std::string("rotation.") + fault.id, Quantity::kRotation, fault.words,
        [&fault](StatedPart* part, const StatedPart& right) {
          const std::optional<Matrix3d> R = Undo(fault, part->X_PL.linear(), right.X_PL.linear());
          if (R) part->X_PL.linear() = *R;
          return R.has_value();
        },
        table);
    Add(
        std::string("inertia.frame_") + fault.id, Quantity::kInertia,
        std::string("as if the rotation of its frame were ") + fault.words,
        [&fault](StatedPart* part, const StatedPart& right) {
          const std::optional<Matrix3d> R = Undo(fault, part->R_LC, right.R_LC);
          if (!R) return false;
          const Matrix3d turn = *R * part->R_LC.transpose();
          part->body.inertia = turn * part->body.inertia * turn.transpose();
          return true;
        },
        table);
  }
}

// Inertias: as a tensor along the axes C in which the file gives it.

using Tensor = std::function<std::optional<Matrix3d>(const Matrix3d& given, const Matrix3d& right)>;

void AddTensor(const std::string& id, const std::string& words, const Tensor& undo, Table* table) {
  Add(
      "inertia." + id, Quantity::kInertia, words,
      [undo](StatedPart* part, const StatedPart& right) {
        const Matrix3d& R = part->R_LC;
        const std::optional<Matrix3d> I =
            undo(R.transpose() * part->body.inertia * R, R.transpose() * right.body.inertia * R);
        if (I) part->body.inertia = R * *I * R.transpose();
        return I.has_value();
      },
      table);
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

/// Lists of six numbers in another order than xx, yy, zz, xy, xz, yz: the place where each belongs.
void AddNumberOrders(Table* table) {
  static constexpr struct {
    const char* id;
    std::array<size_t, 6> place;
    const char* words;
  } kNumbers[] = {
      {"by_rows", {0, 3, 4, 1, 5, 2}, "with its six numbers in the order xx, xy, xz, yy, yz, zz"},
      {"by_columns", {0, 3, 1, 4, 5, 2}, "with its six numbers in the order xx, xy, yy, xz, yz, zz"},
      {"products_yz_xz_xy", {0, 1, 2, 5, 4, 3}, "with the products in the order yz, xz, xy"},
      {"products_xy_yz_xz", {0, 1, 2, 3, 5, 4}, "with the products in the order xy, yz, xz"},
      {"products_xz_xy_yz", {0, 1, 2, 4, 3, 5}, "with the products in the order xz, xy, yz"}};
  for (const auto& order : kNumbers) {
    AddTensor(
        order.id, order.words,
        [&order](const Matrix3d& I, const Matrix3d&) {
          const std::array<double, 6> given = {I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2)};
          std::array<double, 6> n{};
          for (size_t i = 0; i < 6; ++i) n[order.place[i]] = given[i];
          Matrix3d right;
          right << n[0], n[3], n[4], n[3], n[1], n[5], n[4], n[5], n[2];
          return right;
        },
        table);
  }
}

void AddInertias(Table* table) {
  const auto whole = [&](const char* id, const char* words, Matrix3d (*undo)(const StatedPart&)) {
    Add(
        std::string("inertia.") + id, Quantity::kInertia, words,
        [undo](StatedPart* part, const StatedPart&) {
          part->body.inertia = undo(*part);
          return true;
        },
        table);
  };
  whole("about_origin", "as if given about the link's origin instead of the centre of mass",
        [](const StatedPart& p) {
          return Matrix3d(p.body.inertia - CalcPointInertia(p.body.mass, p.body.com));
        });
  whole("moved_twice", "as if moved from the link's origin to the centre of mass once too often",
        [](const StatedPart& p) {
          return Matrix3d(p.body.inertia + CalcPointInertia(p.body.mass, p.body.com));
        });
  whole("parent_axes", "as if given along the parent's axes", [](const StatedPart& p) {
    return Matrix3d(p.X_PL.linear().transpose() * p.body.inertia * p.X_PL.linear());
  });
  whole("carrier_origin", "as if given about the origin of the link that carries it",
        [](const StatedPart& p) {
          const Vector3d arm = p.X_PL.linear().transpose() * (p.X_PL * p.body.com);
          return Matrix3d(p.body.inertia - CalcPointInertia(p.body.mass, arm));
        });
  AddTensor(
      "product_sign", "with the products' sign turned around",
      [](const Matrix3d& I, const Matrix3d&) {
        return Matrix3d(2.0 * Matrix3d(I.diagonal().asDiagonal()) - I);
      },
      table);
  AddTensor(
      "no_products", "without its products",
      [](const Matrix3d& I, const Matrix3d& right) -> std::optional<Matrix3d> {
        if (!IsDiagonal(I)) return std::nullopt;
        return Matrix3d(I + right - Matrix3d(right.diagonal().asDiagonal()));
      },
      table);
  AddTensor(
      "no_axes", "of principal moments without their axes (the rotation of its frame is missing)",
      [](const Matrix3d& I, const Matrix3d& right) -> std::optional<Matrix3d> {
        if (!IsDiagonal(I) || IsDiagonal(right)) return std::nullopt;
        return TurnToAxesOf(right, I.diagonal());
      },
      table);
  for (const Order& order : kOrders) {
    std::string words = order.words;
    const size_t at = words.find("the order") == std::string::npos ? 5 : 3;
    words = at == 5 ? "with the axes " + words.substr(at) : "with the axes " + words;
    AddTensor(
        order.id, words,
        [&order](const Matrix3d& I, const Matrix3d&) {
          Matrix3d right;
          for (size_t i = 0; i < 3; ++i) {
            for (size_t j = 0; j < 3; ++j)
              right(order.right[i], order.right[j]) = I(static_cast<int>(i), static_cast<int>(j));
          }
          return right;
        },
        table);
  }
  AddNumberOrders(table);
  for (const Factor& unit : kInertias) {
    AddTensor(
        unit.id, unit.words, [&unit](const Matrix3d& I, const Matrix3d&) { return Matrix3d(unit.right * I); },
        table);
  }
}

void AddNumber(std::string id, Quantity of, const char* words, double StatedPart::*value, double factor,
               Table* table) {
  Add(
      std::move(id), of, words,
      [value, factor](StatedPart* part, const StatedPart& right) {
        if (factor == 0.0 && part->*value != 0.0) return false;
        part->*value = factor == 0.0 ? right.*value : factor * (part->*value);
        return true;
      },
      table);
}

void AddConstants(Table* table) {
  for (const Factor& unit : kMasses) {
    Add(
        std::string("mass.") + unit.id, Quantity::kMass, unit.words,
        [&unit](StatedPart* part, const StatedPart&) {
          part->body.mass *= unit.right;
          return true;
        },
        table);
  }
  const auto range = [&](const char* id, const char* words, void (*undo)(StatedPart*)) {
    Add(
        id, Quantity::kRange, words,
        [undo](StatedPart* part, const StatedPart&) {
          undo(part);
          return true;
        },
        table);
  };
  range("range.degrees", "as if in degrees", [](StatedPart* part) {
    part->lower *= kDegree;
    part->upper *= kDegree;
  });
  range("range.sign", "turned around (its sign)", [](StatedPart* part) {
    std::swap(part->lower, part->upper);
    part->lower = -part->lower;
    part->upper = -part->upper;
  });
  AddNumber("damping.per_degree", Quantity::kDamping, "as if per degree (N m s/deg)", &StatedPart::damping,
            1.0 / kDegree, table);
  AddNumber("damping.per_radian", Quantity::kDamping, "as if times 180 / pi", &StatedPart::damping, kDegree,
            table);
  AddNumber("damping.missing", Quantity::kDamping, "missing", &StatedPart::damping, 0.0, table);
  AddNumber("armature.g_cm2", Quantity::kArmature, "as if in g cm^2", &StatedPart::armature, 1e-7, table);
  AddNumber("armature.kg_mm2", Quantity::kArmature, "as if in kg mm^2", &StatedPart::armature, 1e-6, table);
  AddNumber("armature.missing", Quantity::kArmature, "missing", &StatedPart::armature, 0.0, table);
}

Table MakeConventions() {
  Table table;
  AddConstants(&table);
  AddFrames(&table);
  AddVectors(Quantity::kCom, "com.", &table);
  AddInertias(&table);
  AddVectors(Quantity::kOrigin, "origin.", &table);
  AddVectors(Quantity::kAxis, "axis.", &table);
  AddRotations(&table);
  return table;
}

Table MakeMountings() {
  static constexpr const char* kTurns[] = {"a quarter", "half", "a quarter"};
  Table table;
  for (int axis = 0; axis < 3; ++axis) {
    for (int quarters = 1; quarters < 4; ++quarters) {
      Add(
          std::string(quarters == 2 ? "base.half_" : "base.quarter_") + "xyz"[axis], Quantity::kRotation,
          std::string("turned ") + kTurns[quarters - 1] + " about " + "xyz"[axis],
          [axis, quarters](StatedPart* part, const StatedPart&) {
            part->X_PL.linear() = (part->X_PL.linear() * Turn(axis, -0.5 * kPi * quarters)).eval();
            return true;
          },
          &table);
    }
  }
  AddVectors(Quantity::kOrigin, "base.origin_", &table);
  for (const Convention& convention : ListConventions()) {
    if (convention.of == Quantity::kRotation || convention.of == Quantity::kPlace ||
        convention.id == "origin.missing") {
      table.push_back(convention);
      table.back().id = "base." + convention.id;
    }
  }
  return table;
}

}  // namespace

const char* NameOf(Quantity quantity, bool many) {
  static constexpr const char* kNames[][2] = {
      {"mass", "masses"},        {"centre of mass", "centres of mass"},
      {"inertia", "inertias"},   {"origin", "origins"},
      {"rotation", "rotations"}, {"place", "places"},
      {"axis", "axes"},          {"range", "ranges"},
      {"damping", "dampings"},   {"armature", "armatures"}};
  return kNames[static_cast<size_t>(quantity)][many ? 1 : 0];
}

bool AgreesIn(Quantity quantity, const StatedPart& a, const StatedPart& b, double length, double tolerance) {
  const auto same = [&](double x, double y) {
    return std::abs(x - y) <= tolerance * std::max(std::abs(x), std::abs(y));
  };
  const double trace = std::max(std::abs(a.body.inertia.trace()), std::abs(b.body.inertia.trace()));
  switch (quantity) {
    case Quantity::kMass:
      return same(a.body.mass, b.body.mass);
    case Quantity::kCom:
      return (a.body.com - b.body.com).cwiseAbs().maxCoeff() <= tolerance * length;
    case Quantity::kInertia:
      return (a.body.inertia - b.body.inertia).cwiseAbs().maxCoeff() <= tolerance * trace;
    case Quantity::kRange:
      return same(a.lower, b.lower) && same(a.upper, b.upper);
    case Quantity::kDamping:
      return same(a.damping, b.damping);
    case Quantity::kArmature:
      return same(a.armature, b.armature);
    default:
      return a.axis == b.axis && a.X_PL.isApprox(b.X_PL, tolerance);
  }
}

void TakeFrom(const StatedPart& other, Quantity quantity, StatedPart* part) {
  if (quantity == Quantity::kMass) part->body.mass = other.body.mass;
  if (quantity == Quantity::kCom) part->body.com = other.body.com;
  if (quantity == Quantity::kInertia) part->body.inertia = other.body.inertia;
  if (quantity == Quantity::kRange) std::tie(part->lower, part->upper) = std::tie(other.lower, other.upper);
  if (quantity == Quantity::kDamping) part->damping = other.damping;
  if (quantity == Quantity::kArmature) part->armature = other.armature;
}

const std::vector<Convention>& ListConventions() {
  static const Table table = MakeConventions();
  return table;
}

const std::vector<Convention>& ListMountings() {
  static const Table table = MakeMountings();
  return table;
}

}  // namespace dexcheck
