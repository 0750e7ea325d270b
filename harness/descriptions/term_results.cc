#include "harness/descriptions/term_results.h"

#include <map>

#include "controller/common/errors.h"

namespace dexcheck {

Eigen::Map<const MatrixXd> TermResults::Find(Term term) const {
  const auto find = [](const auto& values) {
    return Eigen::Map<const MatrixXd>(values.data(), values.rows(), values.cols());
  };
  const auto find_number = [](const std::optional<double>& value) {
    return Eigen::Map<const MatrixXd>(value ? &*value : nullptr, value ? 1 : 0, value ? 1 : 0);
  };
  switch (term) {
    case Term::kMBar:
      return find(M);
    case Term::kCBarXi:
      return find(coriolis);
    case Term::kGravity:
      return find(gravity);
    case Term::kBias:
      return find(bias);
    case Term::kFriction:
      return find(friction);
    case Term::kKineticEnergy:
      return find_number(kinetic);
    case Term::kPotentialEnergy:
      return find_number(potential);
    default:
      return find_number(std::nullopt);
  }
}

TermResults CollectTerms(const VectorXd& v,
                         const std::function<std::vector<double>(const ResultKey&)>& find) {
  std::map<std::string, MatrixXd> found;
  for (const ResultKey& key : kResultKeys) {
    const std::vector<double> numbers = find(key);
    const Eigen::Index cols = key.dimensions == 2 ? v.size() : 1;
    found[key.name] =
        Eigen::Map<const RowMatrixXd>(numbers.data(), static_cast<Eigen::Index>(numbers.size()) / cols, cols);
  }
  const auto find_number = [&](const char* key) {
    return found[key].size() > 0 ? std::optional(found[key](0, 0)) : std::nullopt;
  };
  TermResults terms;
  terms.M = found["M"];
  terms.coriolis = found["c"];
  if (terms.coriolis.size() == 0 && found["C"].size() > 0) terms.coriolis = found["C"] * v;
  terms.gravity = found["g"];
  terms.bias = found["h"];
  terms.friction = found["friction"];
  terms.kinetic = find_number("kinetic_energy");
  terms.potential = find_number("potential_energy");
  terms.AddBias();
  return terms;
}

void FunctionProvider::CheckSize(const char* term, Eigen::Index rows, Eigen::Index cols,
                                 Eigen::Index expected_cols) const {
  if (rows == size_ && cols == expected_cols) return;
  const auto describe = [](Eigen::Index r, Eigen::Index c) {
    return std::to_string(r) + (c == 1 ? " entries" : " x " + std::to_string(c) + " entries");
  };
  throw InputError(functions_.name + ": " + term + ": must have " + describe(size_, expected_cols) +
                   ", got " + describe(rows, cols));
}

TermResults FunctionProvider::Evaluate(long, const VectorXd& q, const VectorXd& xi) {
  TermResults terms;
  if (functions_.M) {
    terms.M = functions_.M(q);
    CheckSize("M", terms.M.rows(), terms.M.cols(), size_);
  }
  const auto take = [&](const char* name, VectorXd values, VectorXd* term) {
    CheckSize(name, values.rows(), 1, 1);
    *term = std::move(values);
  };
  if (functions_.c) take("c", functions_.c(q, xi), &terms.coriolis);
  if (functions_.g) take("g", functions_.g(q), &terms.gravity);
  if (functions_.friction) take("friction", functions_.friction(q, xi), &terms.friction);
  if (functions_.h) take("h", functions_.h(q, xi), &terms.bias);
  terms.AddBias();
  return terms;
}

namespace {

using Position = BaseConvention::Position;

Matrix3d CalcRotation(const VectorXd& q) {
  return Eigen::Quaterniond(q[3], q[4], q[5], q[6]).normalized().toRotationMatrix();
}

}  // namespace

std::string Describe(const BaseConvention& convention) {
  std::string text = "x y z qw qx qy qz";
  if (convention.position == Position::kXyzXyzw) text = "x y z qx qy qz qw";
  if (convention.position == Position::kWxyzXyz) text = "qw qx qy qz x y z";
  const std::string linear =
      std::string("linear velocity in ") + (convention.linear_in_base ? "the base's" : "world") + " axes";
  const std::string angular =
      std::string("angular velocity in ") + (convention.angular_in_world ? "world" : "the base's") + " axes";
  return text + "; " +
         (convention.angular_first ? angular + ", then " + linear : linear + ", then " + angular);
}

std::vector<BaseConvention> ListBaseConventions() {
  std::vector<BaseConvention> all;
  for (const Position position : {Position::kXyzWxyz, Position::kXyzXyzw, Position::kWxyzXyz}) {
    for (int choice = 0; choice < 8; ++choice) {
      all.push_back({position, (choice & 4) != 0, (choice & 1) != 0, (choice & 2) != 0});
    }
  }
  return all;
}

VectorXd BaseConversion::ConvertPositions(const VectorXd& q) const {
  VectorXd converted = q;
  if (convention_.position == Position::kXyzXyzw) converted.segment<4>(3) << q[4], q[5], q[6], q[3];
  if (convention_.position == Position::kWxyzXyz) converted.head<7>() << q.segment<4>(3), q.head<3>();
  return converted;
}

Matrix6d BaseConversion::CalcB(const VectorXd& q) const {
  const Matrix3d R = CalcRotation(q);
  const Matrix3d one = Matrix3d::Identity();
  Matrix6d B = Matrix6d::Zero();
  const Eigen::Index linear = convention_.angular_first ? 3 : 0;
  B.block<3, 3>(linear, 0) = convention_.linear_in_base ? Matrix3d(R.transpose()) : one;
  B.block<3, 3>(3 - linear, 3) = convention_.angular_in_world ? R : one;
  return B;
}

VectorXd BaseConversion::ConvertVelocities(const VectorXd& q, const VectorXd& xi) const {
  VectorXd converted = xi;
  converted.head<6>() = CalcB(q) * xi.head<6>();
  return converted;
}

VectorXd BaseConversion::CalcRate(const VectorXd& q, const VectorXd& xi) const {
  VectorXd rate = VectorXd::Zero(xi.size());
  if (!convention_.linear_in_base) return rate;
  const Vector3d v = CalcRotation(q).transpose() * xi.head<3>();
  rate.segment<3>(convention_.angular_first ? 3 : 0) = -Vector3d(xi.segment<3>(3)).cross(v);
  return rate;
}

void BaseConversion::Restore(const VectorXd& q, const VectorXd& xi, TermResults* terms) const {
  const Matrix6d B = CalcB(q);
  const VectorXd rate = CalcRate(q, xi);
  for (VectorXd* force : {&terms->coriolis, &terms->bias}) {
    if (force->size() == 0 || rate.isZero(0.0)) continue;
    if (terms->M.size() == 0) {
      force->resize(0);
    } else {
      *force += terms->M * rate;
    }
  }
  for (VectorXd* const force : terms->forces()) {
    if (force->size() > 0) force->head<6>() = (B.transpose() * force->head<6>()).eval();
  }
  if (terms->M.size() == 0) return;
  terms->M.topRows<6>() = (B.transpose() * terms->M.topRows<6>()).eval();
  terms->M.leftCols<6>() = (terms->M.leftCols<6>() * B).eval();
}

void BaseConversion::Apply(const VectorXd& q, const VectorXd& xi, TermResults* terms) const {
  // B is made of rotations: B^-1 = B^T.
  const Matrix6d B = CalcB(q);
  terms->M.topRows<6>() = (B * terms->M.topRows<6>()).eval();
  terms->M.leftCols<6>() = (terms->M.leftCols<6>() * B.transpose()).eval();
  for (VectorXd* const force : terms->forces()) {
    if (force->size() > 0) force->head<6>() = (B * force->head<6>()).eval();
  }
  const VectorXd change = terms->M * CalcRate(q, xi);
  for (VectorXd* force : {&terms->coriolis, &terms->bias}) {
    if (force->size() > 0) *force -= change;
  }
}

}  // namespace dexcheck
