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
    return WithInertia(body, body.given.inertia - CalcPointInertia(body.given.mass, body.given.com));
  });
  add("as if moved from the link's origin to the centre of mass once too often",
      [](const ComparedBody& body) {
        return WithInertia(body, body.given.inertia + CalcPointInertia(body.given.mass, body.given.com));
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
  for (const auto& [axes, order] : kAxisOrders) {
    add(std::string("with the axes ") + order, [axes = axes](const ComparedBody& body) {
      Matrix3d inertia;
      for (size_t i = 0; i < 3; ++i) {
        for (size_t j = 0; j < 3; ++j)
          inertia(axes[i], axes[j]) = body.given.inertia(static_cast<int>(i), static_cast<int>(j));
      }
      return WithInertia(body, inertia);
    });
  }
  // Lists of six numbers in other orders than [xx, yy, zz, xy, xz, yz]: which place the number of each
  // belongs to.
  static constexpr std::pair<std::array<size_t, 6>, const char*> kOrders[] = {
      {{0, 3, 4, 1, 5, 2}, "with its six numbers in the order xx, xy, xz, yy, yz, zz"},
      {{0, 3, 1, 4, 5, 2}, "with its six numbers in the order xx, xy, yy, xz, yz, zz"},
      {{0, 1, 2, 5, 4, 3}, "with the products in the order yz, xz, xy"},
      {{0, 1, 2, 3, 5, 4}, "with the products in the order xy, yz, xz"},
      {{0, 1, 2, 4, 3, 5}, "with the products in the order xz, xy, yz"}};
  for (const auto& [place, text] : kOrders) {
    add(text, [place = place](const ComparedBody& body) {
      const Matrix3d& I = body.given.inertia;
      const std::array<double, 6> given = {I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2)};
      std::array<double, 6> right = given;
      for (size_t i = 0; i < 6; ++i) right[place[i]] = given[i];
      Matrix3d tensor;
      tensor << right[0], right[3], right[4], right[3], right[1], right[5], right[4], right[5], right[2];
      return WithInertia(body, tensor);
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
  add("as if given in the link's frame, though the parent's is expected",
      [](const ComparedBody& body) { return WithCom(body, body.X_PL * body.given.com); });
  add("with its sign turned around", [](const ComparedBody& body) { return WithCom(body, -body.given.com); });
  for (int axis = 0; axis < 3; ++axis) {
    add(std::string("with the sign of ") + "xyz"[axis] + " turned around", [axis](const ComparedBody& body) {
      Vector3d com = body.given.com;
      com[axis] = -com[axis];
      return WithCom(body, com);
    });
  }
  for (size_t order = 0; order < std::size(kAxisOrders); ++order) {
    const auto& [axes, text] = kAxisOrders[order];
    add((order < kAxisExchanges ? "with " : "") + std::string(text), [axes = axes](const ComparedBody& body) {
      Vector3d com;
      for (size_t i = 0; i < 3; ++i) com[axes[i]] = body.given.com[static_cast<int>(i)];
      return WithCom(body, com);
    });
  }
  for (const auto& [factor, text] : kLengthUnits) {
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
  const auto add = [&](const char* noun, const char* plural, const char* text, double mass, double com,
                       double inertia) {
    faults->push_back({noun, plural, text, [=](const ComparedBody& body) {
                         const MassProperties& given = body.given;
                         return MassProperties{mass * given.mass, com * given.com, inertia * given.inertia};
                       }});
  };
  for (const auto& [factor, text] : kUnits) {
    add("mass", "masses", text, factor, 1.0, 1.0);
    add("mass with its inertia", "masses with their inertias", text, factor, 1.0, factor);
  }
  // As drawing programs write them.
  add("centre of mass and inertia", "centres of mass and inertias", "as if in mm and kg mm^2", 1.0, 1e-3,
      1e-6);
  add("body", "bodies", "as if in g, mm and g mm^2", 1e-3, 1e-3, 1e-9);
}

}  // namespace

std::vector<BodyFault> ListBodyFaults() {
  std::vector<BodyFault> faults;
  AddInertiaFaults(&faults);
  AddComFaults(&faults);
  AddMassFaults(&faults);
  return faults;
}

BodyDifference CompareBodies(const MassProperties& a, const MassProperties& b, double length) {
  const double mass = std::max(a.mass, b.mass);
  const double trace = std::max(std::abs(a.inertia.trace()), std::abs(b.inertia.trace()));
  return {mass > 0.0 ? std::abs(a.mass - b.mass) / mass : 0.0, (a.com - b.com).cwiseAbs().maxCoeff() / length,
          trace > 0.0 ? (a.inertia - b.inertia).cwiseAbs().maxCoeff() / trace : 0.0};
}

}  // namespace dexcheck
