#include "harness/descriptions/body_faults.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>

namespace dexcheck {
namespace {

MassProperties WithInertia(const ComparedBody& body, const Matrix3d& inertia) {
  return {body.given.mass, body.given.com, inertia};
}
MassProperties WithCom(const ComparedBody& body, const Vector3d& com) {
  return {body.given.mass, com, body.given.inertia};
}

/// [Ixx, Iyy, Izz, Ixy, Ixz, Iyz] from and to a tensor.
std::array<double, 6> ToList(const Matrix3d& I) {
  return {I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2)};
}
Matrix3d FromList(const std::array<double, 6>& I) {
  Matrix3d tensor;
  tensor << I[0], I[3], I[4], I[3], I[1], I[5], I[4], I[5], I[2];
  return tensor;
}

/// But for what rotations leave by rounding.
bool IsDiagonal(const Matrix3d& I) {
  constexpr double kRounding = 1e-12;  // of the trace
  const Matrix3d products = I - Matrix3d(I.diagonal().asDiagonal());
  return products.cwiseAbs().maxCoeff() <= kRounding * std::abs(I.trace());
}

void AddInertiaFaults(std::vector<BodyFault>* faults) {
  const auto add = [&](const std::string& text, const UndoBodyFault& undo) {
    faults->push_back({"inertia", "inertias", text, undo});
  };
  add("as if given about the link's origin instead of the centre of mass", [](const ComparedBody& body) {
    return WithInertia(body, body.given.inertia - CalcOffset(body.given));
  });
  add("as if moved from the link's origin to the centre of mass once too often",
      [](const ComparedBody& body) {
        return WithInertia(body, body.given.inertia + CalcOffset(body.given));
      });
  add("as if its frame were turned the other way (the rotation transposed)", [](const ComparedBody& body) {
    const Matrix3d R = body.R_LC;
    return WithInertia(body, R.transpose() * R.transpose() * body.given.inertia * R * R);
  });
  add("as if its frame were turned though its numbers are along the link's axes",
      [](const ComparedBody& body) {
        return WithInertia(body, body.R_LC.transpose() * body.given.inertia * body.R_LC);
      });
  add("with the products' sign turned around", [](const ComparedBody& body) {
    Matrix3d inertia = -body.given.inertia;
    inertia.diagonal() = body.given.inertia.diagonal();
    return WithInertia(body, inertia);
  });
  add("without its products", [](const ComparedBody& body) -> std::optional<MassProperties> {
    Matrix3d products = body.right.inertia;
    products.diagonal().setZero();
    const Matrix3d& I = body.given.inertia;
    if (!IsDiagonal(I)) return std::nullopt;
    return WithInertia(body, body.given.inertia + products);
  });
  add("of principal moments without their axes (the rotation of its frame is missing)",
      [](const ComparedBody& body) -> std::optional<MassProperties> {
        const Matrix3d& I = body.given.inertia;
        if (!IsDiagonal(I)) return std::nullopt;
        const Eigen::SelfAdjointEigenSolver<Matrix3d> right(body.right.inertia);
        Vector3d moments = I.diagonal();
        std::sort(moments.begin(), moments.end());
        const Matrix3d& axes = right.eigenvectors();
        return WithInertia(body, axes * moments.asDiagonal() * axes.transpose());
      });
  // The right one's frame is turned, and the given one has its numbers without that.
  add("without the rotation of its frame", [](const ComparedBody& body) -> std::optional<MassProperties> {
    if (body.parts.size() != 1) return std::nullopt;
    const Matrix3d R = body.parts[0].X_LC.linear();
    return WithInertia(body, R * body.given.inertia * R.transpose());
  });
  static constexpr struct {
    std::array<int, 3> axes;
    const char* text;
  } kPermutations[] = {{{1, 0, 2}, "with the axes x and y exchanged"},
                       {{2, 1, 0}, "with the axes x and z exchanged"},
                       {{0, 2, 1}, "with the axes y and z exchanged"},
                       {{1, 2, 0}, "with the axes in the order y, z, x"},
                       {{2, 0, 1}, "with the axes in the order z, x, y"}};
  for (const auto& permutation : kPermutations) {
    add(permutation.text, [axes = permutation.axes](const ComparedBody& body) {
      Matrix3d inertia;
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j)
          inertia(axes[static_cast<size_t>(i)], axes[static_cast<size_t>(j)]) = body.given.inertia(i, j);
      }
      return WithInertia(body, inertia);
    });
  }
  // Lists of six numbers in other orders than [xx, yy, zz, xy, xz, yz]: which place the number of each
  // belongs to.
  static constexpr struct {
    std::array<int, 6> place;
    const char* text;
  } kOrders[] = {{{0, 3, 4, 1, 5, 2}, "with its six numbers in the order xx, xy, xz, yy, yz, zz"},
                 {{0, 3, 1, 4, 5, 2}, "with its six numbers in the order xx, xy, yy, xz, yz, zz"},
                 {{0, 1, 2, 5, 4, 3}, "with the products in the order yz, xz, xy"},
                 {{0, 1, 2, 3, 5, 4}, "with the products in the order xy, yz, xz"},
                 {{0, 1, 2, 4, 3, 5}, "with the products in the order xz, xy, yz"}};
  for (const auto& order : kOrders) {
    add(order.text, [place = order.place](const ComparedBody& body) {
      const std::array<double, 6> given = ToList(body.given.inertia);
      std::array<double, 6> right = given;
      for (size_t i = 0; i < 6; ++i) right[static_cast<size_t>(place[i])] = given[i];
      return WithInertia(body, FromList(right));
    });
  }
  static constexpr std::pair<double, const char*> kUnits[] = {
      {1e-9, "as if in g mm^2"},
      {1e-7, "as if in g cm^2"},
      {1e-6, "as if in kg mm^2"},
      {1e-4, "as if in kg cm^2"},
      {1e-3, "as if in g m^2"},
      {2.9263965343e-4, "as if in lb in^2"},
      {1e9, "divided by 10^9, as if g mm^2 were made of kg m^2"},
      {1e6, "divided by 10^6, as if kg mm^2 were made of kg m^2"},
      {1e3, "divided by 1000"},
      {2.0, "halved"},
      {0.5, "doubled"}};
  for (const auto& [factor, text] : kUnits) {
    add(text, [factor = factor](const ComparedBody& body) {
      return WithInertia(body, factor * body.given.inertia);
    });
  }
}

void AddComFaults(std::vector<BodyFault>* faults) {
  const auto add = [&](const std::string& text, const UndoBodyFault& undo) {
    faults->push_back({"centre of mass", "centres of mass", text, undo});
  };
  add("as if given in the parent's frame",
      [](const ComparedBody& body) { return WithCom(body, body.X_PL.inverse() * body.given.com); });
  add("as if given along the parent's axes", [](const ComparedBody& body) {
    return WithCom(body, body.X_PL.linear().transpose() * body.given.com);
  });
  add("as if given in the link's frame, though the parent's is meant",
      [](const ComparedBody& body) { return WithCom(body, body.X_PL * body.given.com); });
  add("with its sign turned around", [](const ComparedBody& body) { return WithCom(body, -body.given.com); });
  for (int axis = 0; axis < 3; ++axis) {
    add(std::string("with the sign of ") + "xyz"[axis] + " turned around", [axis](const ComparedBody& body) {
      Vector3d com = body.given.com;
      com[axis] = -com[axis];
      return WithCom(body, com);
    });
  }
  static constexpr std::pair<std::array<int, 3>, const char*> kPermutations[] = {
      {{1, 0, 2}, "with x and y exchanged"},
      {{2, 1, 0}, "with x and z exchanged"},
      {{0, 2, 1}, "with y and z exchanged"},
      {{1, 2, 0}, "in the order y, z, x"},
      {{2, 0, 1}, "in the order z, x, y"}};
  for (const auto& [axes, text] : kPermutations) {
    add(text, [axes = axes](const ComparedBody& body) {
      Vector3d com;
      for (int i = 0; i < 3; ++i) com[axes[static_cast<size_t>(i)]] = body.given.com[i];
      return WithCom(body, com);
    });
  }
  static constexpr std::pair<double, const char*> kUnits[] = {
      {1e-3, "as if in mm"}, {1e-2, "as if in cm"}, {0.0254, "as if in inches"}, {1e3, "divided by 1000"}};
  for (const auto& [factor, text] : kUnits) {
    add(text, [factor = factor](const ComparedBody& body) { return WithCom(body, factor * body.given.com); });
  }
}

/// Units of mass take the inertia along when it was computed from the mass.
void AddMassFaults(std::vector<BodyFault>* faults) {
  static constexpr std::pair<double, const char*> kUnits[] = {{1e-3, "as if in g"},
                                                              {0.45359237, "as if in lb"},
                                                              {1e3, "divided by 1000"},
                                                              {2.0, "halved"},
                                                              {0.5, "doubled"}};
  for (const auto& [factor, text] : kUnits) {
    faults->push_back({"mass", "masses", text, [factor = factor](const ComparedBody& body) {
                         return MassProperties{factor * body.given.mass, body.given.com, body.given.inertia};
                       }});
    faults->push_back(
        {"mass with its inertia", "masses with their inertias", text,
         [factor = factor](const ComparedBody& body) {
           return MassProperties{factor * body.given.mass, body.given.com, factor * body.given.inertia};
         }});
  }
  // Com and inertia in mm at once, as drawing programs write them.
  faults->push_back(
      {"centre of mass and inertia", "centres of mass and inertias", "as if in mm and kg mm^2",
       [](const ComparedBody& body) {
         return MassProperties{body.given.mass, 1e-3 * body.given.com, 1e-6 * body.given.inertia};
       }});
  faults->push_back(
      {"body", "bodies", "as if in g, mm and g mm^2", [](const ComparedBody& body) {
         return MassProperties{1e-3 * body.given.mass, 1e-3 * body.given.com, 1e-9 * body.given.inertia};
       }});
}

}  // namespace

std::vector<BodyFault> ListBodyFaults() {
  std::vector<BodyFault> faults;
  AddInertiaFaults(&faults);
  AddComFaults(&faults);
  AddMassFaults(&faults);
  return faults;
}

Matrix3d CalcOffset(const MassProperties& body) {
  const Vector3d& c = body.com;
  return body.mass * (c.squaredNorm() * Matrix3d::Identity() - c * c.transpose());
}

BodyDifference CompareBodies(const MassProperties& a, const MassProperties& b, double length) {
  const double mass = std::max(a.mass, b.mass);
  const double trace = std::max(std::abs(a.inertia.trace()), std::abs(b.inertia.trace()));
  return {mass > 0.0 ? std::abs(a.mass - b.mass) / mass : 0.0, (a.com - b.com).cwiseAbs().maxCoeff() / length,
          trace > 0.0 ? (a.inertia - b.inertia).cwiseAbs().maxCoeff() / trace : 0.0};
}

}  // namespace dexcheck
