#include "tests/common/convention_faults.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>

namespace dexcheck::testing {
namespace {

using Numbers = std::array<double, 6>;  // xx yy zz xy xz yz
Numbers ToNumbers(const Matrix3d& I) { return {I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2)}; }
Matrix3d ToTensor(const Numbers& n) {
  Matrix3d I;
  I << n[0], n[3], n[4], n[3], n[1], n[5], n[4], n[5], n[2];
  return I;
}
/// Of entries, from which one each is taken.
Vector3d Pick(const Vector3d& v, const std::array<int, 3>& from) {
  return {v[from[0]], v[from[1]], v[from[2]]};
}

void AddInertias(std::vector<ConventionFault>* list) {
  const auto add = [&](const std::string& text, const std::function<Matrix3d(const StatedLink&)>& make) {
    list->push_back(
        {"inertia " + text, text, [make](StatedLink* link) { link->body.inertia = make(*link); }});
  };
  add("as if given about the link's origin",
      [](const StatedLink& r) { return Matrix3d(r.body.inertia + CalcOffset(r.body)); });
  add("once too often", [](const StatedLink& r) { return Matrix3d(r.body.inertia - CalcOffset(r.body)); });
  add("with the products' sign turned around", [](const StatedLink& r) {
    Numbers n = ToNumbers(r.body.inertia);
    for (size_t i = 3; i < 6; ++i) n[i] = -n[i];
    return ToTensor(n);
  });
  add("without its products",
      [](const StatedLink& r) { return Matrix3d(r.body.inertia.diagonal().asDiagonal()); });
  add("of principal moments without their axes", [](const StatedLink& r) {
    return Matrix3d(Eigen::SelfAdjointEigenSolver<Matrix3d>(r.body.inertia).eigenvalues().asDiagonal());
  });
  const std::pair<std::array<int, 3>, const char*> turns[] = {
      {{1, 0, 2}, "with the axes x and y exchanged"},
      {{2, 1, 0}, "with the axes x and z exchanged"},
      {{0, 2, 1}, "with the axes y and z exchanged"},
      {{1, 2, 0}, "with the axes in the order y, z, x"},
      {{2, 0, 1}, "with the axes in the order z, x, y"}};
  for (const auto& [axes, text] : turns) {
    add(text, [from = axes](const StatedLink& r) {
      Matrix3d I;
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j)
          I(i, j) = r.body.inertia(from[static_cast<size_t>(i)], from[static_cast<size_t>(j)]);
      }
      return I;
    });
  }
  // The file's six numbers by names, which are read as xx yy zz xy xz yz.
  const std::pair<std::array<size_t, 6>, const char*> orders[] = {
      {{0, 3, 4, 1, 5, 2}, "in the order xx, xy, xz, yy, yz, zz"},
      {{0, 3, 1, 4, 5, 2}, "in the order xx, xy, yy, xz, yz, zz"},
      {{0, 1, 2, 5, 4, 3}, "with the products in the order yz, xz, xy"},
      {{0, 1, 2, 3, 5, 4}, "with the products in the order xy, yz, xz"},
      {{0, 1, 2, 4, 3, 5}, "with the products in the order xz, xy, yz"}};
  for (const auto& [order, text] : orders) {
    add(text, [order = order](const StatedLink& r) {
      const Numbers right = ToNumbers(r.body.inertia);
      Numbers given{};
      for (size_t i = 0; i < 6; ++i) given[i] = right[order[i]];
      return ToTensor(given);
    });
  }
  const std::pair<double, const char*> units[] = {
      {1e9, "as if in g mm^2"},  {1e7, "as if in g cm^2"},
      {1e6, "as if in kg mm^2"}, {1e4, "as if in kg cm^2"},
      {1e3, "as if in g m^2"},   {1.0 / 0.45359237 / 0.0254 / 0.0254, "as if in lb in^2"},
      {1e-9, "divided by 10^9"}, {1e-6, "divided by 10^6"},
      {1e-3, "divided by 1000"}, {0.5, "halved"},
      {2.0, "doubled"}};
  for (const auto& [factor, text] : units) {
    add(text, [factor = factor](const StatedLink& r) { return Matrix3d(factor * r.body.inertia); });
  }
}

void AddCentres(std::vector<ConventionFault>* list) {
  const auto add = [&](const std::string& text, const std::function<Vector3d(const StatedLink&)>& make) {
    list->push_back({"centre " + text, text, [make](StatedLink* link) { link->body.com = make(*link); }});
  };
  add("as if given in the parent's frame", [](const StatedLink& r) { return Vector3d(r.X_PL * r.body.com); });
  add("as if given along the parent's axes",
      [](const StatedLink& r) { return Vector3d(r.X_PL.linear() * r.body.com); });
  add("though the parent's is expected",
      [](const StatedLink& r) { return Vector3d(r.X_PL.inverse() * r.body.com); });
  add("with its sign turned around", [](const StatedLink& r) { return Vector3d(-r.body.com); });
  for (const int axis : {0, 1, 2}) {
    add(std::string("with the sign of ") + "xyz"[axis], [axis](const StatedLink& r) {
      Vector3d c = r.body.com;
      c[axis] *= -1.0;
      return c;
    });
  }
  const std::pair<std::array<int, 3>, const char*> orders[] = {{{1, 0, 2}, "with x and y exchanged"},
                                                               {{2, 1, 0}, "with x and z exchanged"},
                                                               {{0, 2, 1}, "with y and z exchanged"},
                                                               {{1, 2, 0}, "in the order y, z, x"},
                                                               {{2, 0, 1}, "in the order z, x, y"}};
  for (const auto& [from, text] : orders) {
    add(text, [from = from](const StatedLink& r) { return Pick(r.body.com, from); });
  }
  const std::pair<double, const char*> units[] = {{1e3, "as if in mm"},
                                                  {1e2, "as if in cm"},
                                                  {1.0 / 0.0254, "as if in inches"},
                                                  {1e-3, "divided by 1000"}};
  for (const auto& [factor, text] : units) {
    add(text, [factor = factor](const StatedLink& r) { return Vector3d(factor * r.body.com); });
  }
}

void AddMasses(std::vector<ConventionFault>* list) {
  const std::pair<double, const char*> units[] = {{1e3, "as if in g"},
                                                  {1.0 / 0.45359237, "as if in lb"},
                                                  {1e-3, "divided by 1000"},
                                                  {0.5, "halved"},
                                                  {2.0, "doubled"}};
  for (const auto& [factor, text] : units) {
    list->push_back({std::string("mass ") + text, text,
                     [factor = factor](StatedLink* link) { link->body.mass *= factor; }});
    list->push_back({std::string("mass and inertia ") + text, text, [factor = factor](StatedLink* link) {
                       link->body.mass *= factor;
                       link->body.inertia *= factor;
                     }});
  }
  list->push_back({"millimetres", "as if in mm and kg mm^2", [](StatedLink* link) {
                     link->body.com *= 1e3;
                     link->body.inertia *= 1e6;
                   }});
  list->push_back({"gram millimetres", "as if in g, mm and g mm^2", [](StatedLink* link) {
                     link->body.mass *= 1e3;
                     link->body.com *= 1e3;
                     link->body.inertia *= 1e9;
                   }});
}

void AddJoints(std::vector<ConventionFault>* list) {
  const auto add = [&](const std::string& text, const std::function<Pose(const Pose&)>& make) {
    list->push_back(
        {"joint " + text, text, [make](StatedLink* link) { link->X_PL = make(link->X_PL); }, true});
  };
  const auto move = [&](const std::string& text, const std::function<Vector3d(const Vector3d&)>& make) {
    add(text, [make](Pose X) {
      X.translation() = make(X.translation());
      return X;
    });
  };
  const std::pair<double, const char*> units[] = {{1e3, "as if in mm"},
                                                  {1e2, "as if in cm"},
                                                  {1.0 / 0.0254, "as if in inches"},
                                                  {1e-3, "divided by 1000"}};
  for (const auto& [factor, text] : units) {
    move(text, [factor = factor](const Vector3d& p) { return Vector3d(factor * p); });
  }
  move("turned around", [](const Vector3d& p) { return Vector3d(-p); });
  for (const int axis : {0, 1, 2}) {
    move(std::string("turned around in ") + "xyz"[axis], [axis](Vector3d p) {
      p[axis] *= -1.0;
      return p;
    });
  }
  move("with x and y exchanged", [](const Vector3d& p) { return Pick(p, {1, 0, 2}); });
  move("with x and z exchanged", [](const Vector3d& p) { return Pick(p, {2, 1, 0}); });
  move("with y and z exchanged", [](const Vector3d& p) { return Pick(p, {0, 2, 1}); });
  add("transposed", [](Pose X) {
    X.linear() = X.linear().transpose().eval();
    return X;
  });
}

std::vector<ConventionFault> MakeFaults() {
  std::vector<ConventionFault> list;
  AddInertias(&list);
  AddCentres(&list);
  AddMasses(&list);
  AddJoints(&list);
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

std::vector<double> ListInertia(const Matrix3d& inertia) {
  const Numbers numbers = ToNumbers(inertia);
  return {numbers.begin(), numbers.end()};
}

}  // namespace dexcheck::testing
