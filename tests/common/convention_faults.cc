#include "tests/common/convention_faults.h"

#include <Eigen/Eigenvalues>
#include <array>
#include <stdexcept>

namespace dexcheck::testing {
namespace {

using Faults = std::vector<ConventionFault>;
using Numbers = std::array<double, 6>;  // xx yy zz xy xz yz

constexpr double kDegree = 3.14159265358979323846 / 180.0;

Numbers ToNumbers(const Matrix3d& I) { return {I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2)}; }
Matrix3d ToTensor(const Numbers& n) {
  Matrix3d I;
  I << n[0], n[3], n[4], n[3], n[1], n[5], n[4], n[5], n[2];
  return I;
}

/// The vector's entries at the three given indices.
Vector3d Pick(const Vector3d& v, const std::array<int, 3>& from) {
  return {v[from[0]], v[from[1]], v[from[2]]};
}

struct Order {
  std::array<int, 3> from;
  const char* exchanged;  ///< "with x and y exchanged"
  const char* axes;       ///< "with the axes x and y exchanged"
  const char* id;
};
constexpr Order kOrders[] = {
    {{1, 0, 2}, "with x and y exchanged", "with the axes x and y exchanged", "swap_xy"},
    {{2, 1, 0}, "with x and z exchanged", "with the axes x and z exchanged", "swap_xz"},
    {{0, 2, 1}, "with y and z exchanged", "with the axes y and z exchanged", "swap_yz"},
    {{1, 2, 0}, "in the order y, z, x", "with the axes in the order y, z, x", "yzx"},
    {{2, 0, 1}, "in the order z, x, y", "with the axes in the order z, x, y", "zxy"}};

struct Unit {
  double factor;
  const char* text;
  const char* id;
};
constexpr Unit kLengths[] = {{1e3, "as if in mm", "mm"},
                             {1e2, "as if in cm", "cm"},
                             {1.0 / 0.0254, "as if in inches", "inch"},
                             {1e-3, "divided by 1000", "per_1000"}};

// Rotations as three angles and as a quaternion.

Matrix3d TurnAbout(int axis, double angle) {
  return Eigen::AngleAxisd(angle, Vector3d::Unit(axis)).toRotationMatrix();
}
Matrix3d FromAngles(const Vector3d& rpy) {
  return TurnAbout(2, rpy[2]) * TurnAbout(1, rpy[1]) * TurnAbout(0, rpy[0]);
}
Vector3d ToAngles(const Matrix3d& R) {
  const double cos_pitch = std::hypot(R(0, 0), R(1, 0));
  if (cos_pitch > 1e-9)
    return {std::atan2(R(2, 1), R(2, 2)), std::atan2(-R(2, 0), cos_pitch), std::atan2(R(1, 0), R(0, 0))};
  return {std::atan2(-R(1, 2), R(1, 1)), std::atan2(-R(2, 0), cos_pitch), 0.0};
}

struct Rotation {
  const char* id;
  const char* text;
  Matrix3d (*make)(const Matrix3d&);
};
const Rotation kRotations[] = {
    {"transposed", "turned the other way", [](const Matrix3d& R) { return Matrix3d(R.transpose()); }},
    {"other_order", "as if its roll, pitch and yaw were taken in the other order",
     [](const Matrix3d& R) {
       const Vector3d a = ToAngles(R);
       return Matrix3d(TurnAbout(0, a[0]) * TurnAbout(1, a[1]) * TurnAbout(2, a[2]));
     }},
    {"ypr", "with yaw, pitch and roll in the place of roll, pitch and yaw",
     [](const Matrix3d& R) { return FromAngles(ToAngles(R).reverse()); }},
    {"degrees", "in degrees", [](const Matrix3d& R) { return FromAngles(ToAngles(R) / kDegree); }},
    {"radians", "in radians", [](const Matrix3d& R) { return FromAngles(ToAngles(R) * kDegree); }},
    {"sign", "with the sign of its angles turned around",
     [](const Matrix3d& R) { return FromAngles(-ToAngles(R)); }},
    {"xyzw", "xyzw",
     [](const Matrix3d& R) {
       const Eigen::Quaterniond q(R);
       return Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w()).toRotationMatrix();
     }},
    {"wxyz", "wxyz",
     [](const Matrix3d& R) {
       const Eigen::Quaterniond q(R);
       return Eigen::Quaterniond(q.z(), q.w(), q.x(), q.y()).toRotationMatrix();
     }},
    {"missing", "without", [](const Matrix3d&) { return Matrix3d(Matrix3d::Identity()); }}};

/// A fault of the inertia along the axes in which the file gives it.
void AddNumbers(const std::string& text, const std::string& id,
                const std::function<Matrix3d(const Matrix3d&)>& make, Faults* list) {
  list->push_back({"inertia " + text,
                   text,
                   [make](StatedLink* link) {
                     const Matrix3d R = link->R_LC;
                     link->body.inertia = R * make(R.transpose() * link->body.inertia * R) * R.transpose();
                   },
                   FaultOf::kBody,
                   {"inertia." + id}});
}

void AddInertiaFrames(Faults* list) {
  const auto add = [&](const std::string& text, const std::string& id,
                       const std::function<Matrix3d(const StatedLink&)>& make) {
    list->push_back({"inertia " + text,
                     text,
                     [make](StatedLink* link) { link->body.inertia = make(*link); },
                     FaultOf::kBody,
                     {"inertia." + id}});
  };
  add("as if given about the link's origin", "about_origin",
      [](const StatedLink& r) { return Matrix3d(r.body.inertia + CalcOffset(r.body)); });
  add("once too often", "moved_twice",
      [](const StatedLink& r) { return Matrix3d(r.body.inertia - CalcOffset(r.body)); });
  add("as if given along the parent's axes", "parent_axes", [](const StatedLink& r) {
    return Matrix3d(r.X_PL.linear() * r.body.inertia * r.X_PL.linear().transpose());
  });
  for (const Rotation& rotation : kRotations) {
    list->push_back({std::string("inertia's frame ") + rotation.text,
                     rotation.text,
                     [make = rotation.make](StatedLink* link) {
                       const Matrix3d R = make(link->R_LC);
                       const Matrix3d I = link->R_LC.transpose() * link->body.inertia * link->R_LC;
                       link->body.inertia = R * I * R.transpose();
                       link->R_LC = R;
                     },
                     FaultOf::kBody,
                     {std::string("inertia.frame_") + rotation.id}});
  }
}

void AddInertias(Faults* list) {
  AddInertiaFrames(list);
  AddNumbers(
      "with the products' sign turned around", "product_sign",
      [](const Matrix3d& I) {
        Numbers n = ToNumbers(I);
        for (size_t i = 3; i < 6; ++i) n[i] = -n[i];
        return ToTensor(n);
      },
      list);
  AddNumbers(
      "without its products", "no_products",
      [](const Matrix3d& I) { return Matrix3d(I.diagonal().asDiagonal()); }, list);
  AddNumbers(
      "of principal moments without their axes", "no_axes",
      [](const Matrix3d& I) {
        if (I.isDiagonal(1e-12)) return I;  // nothing is lost, and another order is another fault
        return Matrix3d(Eigen::SelfAdjointEigenSolver<Matrix3d>(I).eigenvalues().asDiagonal());
      },
      list);
  for (const Order& order : kOrders) {
    AddNumbers(
        order.axes, order.id,
        [from = order.from](const Matrix3d& right) {
          Matrix3d I;
          for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j)
              I(i, j) = right(from[static_cast<size_t>(i)], from[static_cast<size_t>(j)]);
          }
          return I;
        },
        list);
  }
  // The file's six numbers by names, which are read as xx yy zz xy xz yz.
  const struct {
    std::array<size_t, 6> order;
    const char* text;
    const char* id;
  } orders[] = {{{0, 3, 4, 1, 5, 2}, "in the order xx, xy, xz, yy, yz, zz", "by_rows"},
                {{0, 3, 1, 4, 5, 2}, "in the order xx, xy, yy, xz, yz, zz", "by_columns"},
                {{0, 1, 2, 5, 4, 3}, "with the products in the order yz, xz, xy", "products_yz_xz_xy"},
                {{0, 1, 2, 3, 5, 4}, "with the products in the order xy, yz, xz", "products_xy_yz_xz"},
                {{0, 1, 2, 4, 3, 5}, "with the products in the order xz, xy, yz", "products_xz_xy_yz"}};
  for (const auto& [order, text, id] : orders) {
    AddNumbers(
        text, id,
        [order = order](const Matrix3d& I) {
          const Numbers right = ToNumbers(I);
          Numbers given{};
          for (size_t i = 0; i < 6; ++i) given[i] = right[order[i]];
          return ToTensor(given);
        },
        list);
  }
  const Unit units[] = {{1e9, "as if in g mm^2", "g_mm2"},
                        {1e7, "as if in g cm^2", "g_cm2"},
                        {1e6, "as if in kg mm^2", "kg_mm2"},
                        {1e4, "as if in kg cm^2", "kg_cm2"},
                        {1e3, "as if in g m^2", "g_m2"},
                        {1.0 / 0.45359237 / 0.0254 / 0.0254, "as if in lb in^2", "lb_in2"},
                        {1e-9, "divided by 10^9", "per_1e9"},
                        {1e-6, "divided by 10^6", "per_1e6"},
                        {1e-3, "divided by 1000", "per_1000"},
                        {0.5, "halved", "halved"},
                        {2.0, "doubled", "doubled"}};
  for (const Unit& unit : units) {
    AddNumbers(
        unit.text, unit.id, [factor = unit.factor](const Matrix3d& I) { return Matrix3d(factor * I); }, list);
  }
}

void AddCentres(Faults* list) {
  const auto add = [&](const std::string& text, const std::string& id,
                       const std::function<Vector3d(const StatedLink&)>& make) {
    list->push_back({"centre " + text,
                     text,
                     [make](StatedLink* link) { link->body.com = make(*link); },
                     FaultOf::kBody,
                     {"com." + id}});
  };
  add("as if given in the parent's frame", "parent_frame",
      [](const StatedLink& r) { return Vector3d(r.X_PL * r.body.com); });
  add("as if given along the parent's axes", "parent_axes",
      [](const StatedLink& r) { return Vector3d(r.X_PL.linear() * r.body.com); });
  add("though the parent's is expected", "not_parent_frame",
      [](const StatedLink& r) { return Vector3d(r.X_PL.inverse() * r.body.com); });
  add("as if given in the next joint's frame", "child_frame",
      [](const StatedLink& r) { return r.X_LD ? Vector3d(r.X_LD->inverse() * r.body.com) : r.body.com; });
  add("with its sign turned around", "sign", [](const StatedLink& r) { return Vector3d(-r.body.com); });
  for (const int axis : {0, 1, 2}) {
    add(std::string("with the sign of ") + "xyz"[axis], std::string("sign_") + "xyz"[axis],
        [axis](const StatedLink& r) {
          Vector3d c = r.body.com;
          c[axis] *= -1.0;
          return c;
        });
  }
  for (const Order& order : kOrders) {
    add(order.exchanged, order.id,
        [from = order.from](const StatedLink& r) { return Pick(r.body.com, from); });
  }
  for (const Unit& unit : kLengths) {
    add(unit.text, unit.id,
        [factor = unit.factor](const StatedLink& r) { return Vector3d(factor * r.body.com); });
  }
}

void AddMasses(Faults* list) {
  const struct {
    Unit unit;
    const char* inertia;  ///< The text of the inertia when it has the same factor.
  } units[] = {{{1e3, "as if in g", "g"}, "g_m2"},
               {{1.0 / 0.45359237, "as if in lb", "lb"}, "lb_m2"},
               {{1e-3, "divided by 1000", "per_1000"}, "per_1000"},
               {{0.5, "halved", "halved"}, "halved"},
               {{2.0, "doubled", "doubled"}, "doubled"}};
  for (const auto& [unit, inertia] : units) {
    const double factor = unit.factor;
    const std::string mass = std::string("mass.") + unit.id;
    list->push_back({std::string("mass ") + unit.text,
                     unit.text,
                     [factor](StatedLink* link) { link->body.mass *= factor; },
                     FaultOf::kBody,
                     {mass}});
    list->push_back({std::string("mass and inertia ") + unit.text,
                     unit.text,
                     [factor](StatedLink* link) {
                       link->body.mass *= factor;
                       link->body.inertia *= factor;
                     },
                     FaultOf::kBody,
                     {mass, std::string("inertia.") + inertia}});
  }
  list->push_back({"millimetres",
                   "as if in mm and kg mm^2",
                   [](StatedLink* link) {
                     link->body.com *= 1e3;
                     link->body.inertia *= 1e6;
                   },
                   FaultOf::kBody,
                   {"com.mm", "inertia.kg_mm2"}});
  list->push_back({"gram millimetres",
                   "as if in g, mm and g mm^2",
                   [](StatedLink* link) {
                     link->body.mass *= 1e3;
                     link->body.com *= 1e3;
                     link->body.inertia *= 1e9;
                   },
                   FaultOf::kBody,
                   {"mass.g", "com.mm", "inertia.g_mm2"}});
}

void AddOrigins(Faults* list) {
  const auto move = [&](const std::string& text, const std::string& id,
                        const std::function<Vector3d(const Vector3d&)>& make) {
    list->push_back({"joint " + text,
                     text,
                     [make](StatedLink* link) { link->X_PL.translation() = make(link->X_PL.translation()); },
                     FaultOf::kJoint,
                     {"origin." + id}});
  };
  for (const Unit& unit : kLengths) {
    move(unit.text, unit.id, [factor = unit.factor](const Vector3d& p) { return Vector3d(factor * p); });
  }
  move("turned around", "sign", [](const Vector3d& p) { return Vector3d(-p); });
  for (const int axis : {0, 1, 2}) {
    move(std::string("turned around in ") + "xyz"[axis], std::string("sign_") + "xyz"[axis],
         [axis](Vector3d p) {
           p[axis] *= -1.0;
           return p;
         });
  }
  for (const Order& order : kOrders) {
    move(order.exchanged, order.id, [from = order.from](const Vector3d& p) { return Pick(p, from); });
  }
}

void AddJoints(Faults* list) {
  AddOrigins(list);
  const auto add = [&](const std::string& name, const std::string& text, const std::string& id,
                       const std::function<void(StatedLink*)>& make) {
    list->push_back({"joint's " + name, text, make, FaultOf::kJoint, {id}});
  };
  for (const Rotation& rotation : kRotations) {
    add(std::string("rotation ") + rotation.text, rotation.text, std::string("rotation.") + rotation.id,
        [make = rotation.make](StatedLink* link) { link->X_PL.linear() = make(link->X_PL.linear()); });
  }
  add("place inverted", "the inverse", "place.inverse",
      [](StatedLink* link) { link->X_PL = link->X_PL.inverse(); });
  add("axis turned around", "turned around", "axis.sign", [](StatedLink* link) { link->axis *= -1.0; });
  add("axis along the parent's axes", "parent", "axis.parent_axes",
      [](StatedLink* link) { link->axis = link->X_PL.linear() * link->axis; });
  add("axis missing", "axis looks", "axis.missing", [](StatedLink* link) { link->axis = Vector3d::UnitX(); });
  for (const Order& order : kOrders) {
    add(std::string("axis ") + order.exchanged, order.exchanged, std::string("axis.") + order.id,
        [from = order.from](StatedLink* link) { link->axis = Pick(link->axis, from); });
  }
  for (const double degrees : {30.0, 90.0, 180.0}) {
    add("zero offset by " + std::to_string(static_cast<int>(degrees)) + " deg", "zero looks offset",
        "zero.offset", [degrees](StatedLink* link) {
          link->X_PL = link->X_PL * Eigen::AngleAxisd(degrees * kDegree, link->axis);
        });
  }
}

void AddConstants(Faults* list) {
  const auto add = [&](const std::string& name, const std::string& text, const std::string& id,
                       const std::function<void(StatedLink*)>& make) {
    list->push_back({name, text, make, FaultOf::kConstant, {id}});
  };
  add("range in degrees", "in degrees", "range.degrees", [](StatedLink* link) {
    link->lower /= kDegree;
    link->upper /= kDegree;
  });
  add("range turned around", "sign", "range.sign", [](StatedLink* link) {
    const double lower = link->lower;
    link->lower = -link->upper;
    link->upper = -lower;
  });
  add("damping per degree", "per degree", "damping.per_degree",
      [](StatedLink* link) { link->damping *= kDegree; });
  add("damping missing", "missing", "damping.missing", [](StatedLink* link) { link->damping = 0.0; });
  add("armature in g cm^2", "as if in g cm^2", "armature.g_cm2",
      [](StatedLink* link) { link->armature *= 1e7; });
  add("armature in kg mm^2", "as if in kg mm^2", "armature.kg_mm2",
      [](StatedLink* link) { link->armature *= 1e6; });
  add("armature missing", "missing", "armature.missing", [](StatedLink* link) { link->armature = 0.0; });
}

Faults MakeFaults() {
  Faults list;
  AddInertias(&list);
  AddCentres(&list);
  AddMasses(&list);
  AddJoints(&list);
  AddConstants(&list);
  return list;
}

}  // namespace

const std::vector<ConventionFault>& ListConventionFaults() {
  static const std::vector<ConventionFault> faults = MakeFaults();
  return faults;
}

const ConventionFault& FindConventionFault(const std::string& name) {
  for (const ConventionFault& fault : ListConventionFaults()) {
    if (fault.name == name) return fault;
  }
  throw std::out_of_range("no fault of conventions is called " + name);
}

Matrix3d CalcOffset(const MassProperties& body) {
  return body.mass * (body.com.squaredNorm() * Matrix3d::Identity() - body.com * body.com.transpose());
}

}  // namespace dexcheck::testing
